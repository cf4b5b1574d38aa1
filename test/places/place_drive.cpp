#include "places/place_drive.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "alces_platform/sim/random.h"

namespace alces::places {
namespace {

using Eigen::Vector3d;

constexpr double revisit_m = 2.0;  // at most: the same place
constexpr std::uint32_t gap_scans = 15;

/// The way with its corners rounded, a point every few centimetres.
std::vector<Vector3d> rounded(const std::vector<Vector3d>& corners, double radius_m) {
  constexpr double spacing_m = 0.05;
  std::vector<Vector3d> fine;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const double length_m = (corners[i + 1] - corners[i]).norm();
    const int count = std::max(1, static_cast<int>(length_m / spacing_m));
    for (int k = 0; k < count; ++k)
      fine.push_back(corners[i] + (corners[i + 1] - corners[i]) * (static_cast<double>(k) / count));
  }
  fine.push_back(corners.back());
  const auto half = static_cast<std::ptrdiff_t>(radius_m / spacing_m);
  const auto size = static_cast<std::ptrdiff_t>(fine.size());
  std::vector<Vector3d> smooth;
  for (std::ptrdiff_t i = 0; i < size; ++i) {
    const std::ptrdiff_t reach = std::min({half, i, size - 1 - i});
    Vector3d sum = Vector3d::Zero();
    for (std::ptrdiff_t k = i - reach; k <= i + reach; ++k) sum += fine[static_cast<std::size_t>(k)];
    smooth.push_back(sum / static_cast<double>(2 * reach + 1));
  }
  return smooth;
}

double ground_m(const Place& place, const Vector3d& at) {
  if (!place.is_outdoors) return at.z();
  return static_cast<double>(
      place.scene.ground.height_m(static_cast<float>(at.x()), static_cast<float>(at.y())));
}

/// Poses every step_m; where the way turns sharply the vehicle turns on the spot, 25 deg a scan at most.
std::vector<Pose> poses_along(const Place& place, double scanner_height_m, std::uint64_t seed) {
  const std::vector<Vector3d> line = rounded(place.corners_m, place.corner_radius_m);
  constexpr double most_turn_rad = 25 * std::numbers::pi / 180;
  sim::Random random(sim::mix(seed, 20));
  std::vector<Pose> poses;
  double last_yaw = 0;
  double driven_m = 0;
  const auto stand = [&](const Vector3d& at, double yaw) {
    constexpr double half_m = 0.4;  // between the axles
    const Vector3d ahead(std::cos(yaw) * half_m, std::sin(yaw) * half_m, 0);
    const Vector3d left(-std::sin(yaw) * 0.3, std::cos(yaw) * 0.3, 0);
    double pitch = 0;
    double roll = 0;
    if (place.is_outdoors) {
      pitch = -std::atan2(ground_m(place, at + ahead) - ground_m(place, at - ahead), 2 * half_m);
      roll = std::atan2(ground_m(place, at + left) - ground_m(place, at - left), 0.6);
    }
    constexpr double rough_rad = 0.004;
    pitch += rough_rad * random.normal();
    roll += rough_rad * random.normal();
    Pose body;
    body.translation_m = {at.x(), at.y(), ground_m(place, at)};
    body.rotation = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
                    Eigen::AngleAxisd(roll, Vector3d::UnitX());
    body.translation_m += body.rotation * Vector3d(0, 0, scanner_height_m);
    poses.push_back(body);
  };
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    if (i > 0) driven_m += (line[i] - line[i - 1]).norm();
    if (!poses.empty() && driven_m < place.step_m) continue;
    const Vector3d along = line[std::min(line.size() - 1, i + 4)] - line[i - std::min<std::size_t>(i, 4)];
    const double yaw = std::atan2(along.y(), along.x());
    if (poses.empty()) last_yaw = yaw;
    double turn = std::remainder(yaw - last_yaw, 2 * std::numbers::pi);
    while (std::abs(turn) > most_turn_rad) {
      last_yaw += std::copysign(most_turn_rad, turn);
      stand(line[i], last_yaw);
      turn = std::remainder(yaw - last_yaw, 2 * std::numbers::pi);
    }
    last_yaw = yaw;
    const double slope = along.head<2>().norm() > 1e-6 ? std::atan2(along.z(), along.head<2>().norm()) : 0.0;
    stand(line[i], yaw + 0.01 * random.normal());
    if (!place.is_outdoors && slope != 0.0) {
      poses.back().rotation = poses.back().rotation * Eigen::AngleAxisd(-slope, Vector3d::UnitY());
    }
    driven_m = 0;
  }
  return poses;
}

bool in_sight(const sim::Scene& scene, const Vector3d& from, const Vector3d& to) {
  const double way_m = (to - from).norm();
  if (way_m < 0.1) return true;
  const sim::Hit hit =
      scene.cast(from.cast<float>(), ((to - from) / way_m).cast<float>(), static_cast<float>(way_m));
  return hit.surface == sim::Surface::none || static_cast<double>(hit.range_m) >= way_m - 0.05;
}

/// Outdoors: whether fewer than three things stand around, each in a direction of its own.
bool is_bare(const Place& place, const Pose& world_from_scanner, const std::vector<Point>& scan) {
  constexpr double standing_m = 0.3;  // above the ground
  constexpr std::size_t sectors = 36;
  constexpr int enough_points = 3;
  constexpr int enough_sectors = 3;
  if (!place.is_outdoors) return false;
  int points_in[sectors] = {};
  for (const Point& point : scan) {
    const Vector3d at = world_from_scanner * Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
    if (at.z() < ground_m(place, at) + standing_m) continue;
    const double turn =
        std::atan2(static_cast<double>(point.y), static_cast<double>(point.x)) / (2 * std::numbers::pi);
    ++points_in[static_cast<std::size_t>((turn + 1) * sectors) % sectors];
  }
  return std::count_if(std::begin(points_in), std::end(points_in),
                       [](int count) { return count >= enough_points; }) < enough_sectors;
}

sim::OdometrySettings times(double noise) {
  sim::OdometrySettings settings;
  settings.scale_error *= noise;
  settings.way_noise *= noise;
  settings.heading_bias_deg_per_m *= noise;
  settings.heading_walk_deg *= noise;
  settings.turn_scale_error *= noise;
  return settings;
}

}  // namespace

std::vector<Pair> choose_pairs(std::span<const Pose> truth, const PairRules& rules) {
  const auto count = static_cast<std::uint32_t>(truth.size());
  std::vector<double> way_m(count, 0);
  for (std::uint32_t i = 1; i < count; ++i)
    way_m[i] = way_m[i - 1] + (truth[i].translation_m - truth[i - 1].translation_m).norm();
  std::vector<Pair> others;
  std::vector<Pair> revisits;
  sim::Random random(sim::mix(rules.seed, 30));
  for (std::uint32_t last = 0; last < count; ++last) {
    std::vector<std::pair<double, std::uint32_t>> near_others;
    std::pair<double, std::uint32_t> nearest_revisit{revisit_m, count};
    for (std::uint32_t first = 0; first + gap_scans <= last; ++first) {
      const double driven_m = way_m[last] - way_m[first];
      if (driven_m < rules.least_way_m) break;
      const double apart_m = (truth[first].translation_m - truth[last].translation_m).norm();
      if (apart_m > rules.reach_m) continue;
      const bool is_seen = rules.in_sight(first, last);
      if (is_seen && apart_m <= nearest_revisit.first && driven_m >= rules.revisit_way_m)
        nearest_revisit = {apart_m, first};
      if (!is_seen || apart_m > rules.nearest_other_m) near_others.emplace_back(apart_m, first);
    }
    if (nearest_revisit.second < count) {
      revisits.push_back({nearest_revisit.second, last, true});
    } else if (!near_others.empty()) {
      const bool takes_nearest = last % 2 == 0;
      const auto nearest = std::min_element(near_others.begin(), near_others.end());
      const auto any = near_others.begin() + random.integer(0, static_cast<int>(near_others.size()) - 1);
      others.push_back({(takes_nearest ? nearest : any)->second, last, false});
    }
  }
  std::vector<Pair> chosen;
  for (const std::vector<Pair>* sort : {&others, &revisits}) {
    const std::size_t take = std::min(rules.most, sort->size());
    for (std::size_t k = 0; k < take; ++k) chosen.push_back((*sort)[(2 * k + 1) * sort->size() / (2 * take)]);
  }
  return chosen;
}

std::vector<Pose> disturbed(std::span<const Pose> odometry, double noise, std::uint64_t seed) {
  constexpr double deg = std::numbers::pi / 180;
  const sim::OdometrySettings settings = times(noise - 1);
  sim::Random random(sim::mix(seed, 41));
  const double scale = 1 + settings.scale_error * random.uniform(0.7, 1.3) * (random.chance(0.5) ? 1 : -1);
  const double bias_rad_per_m = settings.heading_bias_deg_per_m * deg * random.normal();
  std::vector<Pose> worse{odometry.front()};
  for (std::size_t i = 1; i < odometry.size(); ++i) {
    Pose step = odometry[i - 1].inverse() * odometry[i];
    const double way_m = step.translation_m.norm();
    step.translation_m *= scale * (1 + settings.way_noise * random.normal());
    const double turn_rad = bias_rad_per_m * way_m + settings.heading_walk_deg * deg * random.normal();
    step.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Vector3d::UnitZ())) * step.rotation;
    worse.push_back(worse.back() * step);
  }
  return worse;
}

std::vector<Pose> PlaceDrive::odometry(double noise) const {
  return sim::planar_odometry(truth, times(noise), place.seed);
}

PlaceDrive drive_through(Place place, Scanner scanner, std::size_t pairs_a_sort) {
  PlaceDrive drive;
  const ScannerModel model(scanner, place.reach_m);
  const std::uint64_t seed =
      sim::mix(place.seed, static_cast<std::uint64_t>(place.kind), static_cast<std::uint64_t>(scanner));
  const std::vector<Pose> world_from_scanner = poses_along(place, model.height_m(), seed);
  const Pose map_from_world = world_from_scanner.front().inverse();
  for (std::size_t i = 0; i < world_from_scanner.size(); ++i) {
    drive.truth.push_back(i == 0 ? Pose{} : map_from_world * world_from_scanner[i]);
    drive.scans.push_back(model.scan(place.scene, world_from_scanner[i], sim::mix(seed, 40, i)));
  }
  PairRules rules;
  rules.most = pairs_a_sort;
  rules.seed = place.seed;
  if (place.kind == Kind::pass) rules.least_way_m = 11;
  if (place.kind == Kind::yards) rules.reach_m = 25;
  rules.in_sight = [&](std::uint32_t first, std::uint32_t last) {
    return in_sight(place.scene, world_from_scanner[first].translation_m,
                    world_from_scanner[last].translation_m);
  };
  drive.pairs = choose_pairs(world_from_scanner, rules);
  for (Pair& pair : drive.pairs) {
    for (const std::uint32_t scan : {pair.first, pair.last})
      pair.is_bare = pair.is_bare || is_bare(place, world_from_scanner[scan], drive.scans[scan]);
  }
  drive.place = std::move(place);
  drive.scanner = scanner;
  return drive;
}

}  // namespace alces::places
