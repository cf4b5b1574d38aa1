#include "places/place_drive.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "alces_platform/sim/random.h"

namespace alces::places {
namespace {

using Eigen::Vector3d;

constexpr double revisit_m = 2.0;       // at most: the same place
constexpr double nearest_other_m = 2.0;  // other places in open view are farther apart
constexpr double farthest_m = 15;        // as far as the mapper looks for loops
constexpr double gap_m = 12;             // of way in between
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
  return static_cast<double>(place.scene.ground.height_m(static_cast<float>(at.x()), static_cast<float>(at.y())));
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
  const sim::Hit hit = scene.cast(from.cast<float>(), ((to - from) / way_m).cast<float>(), static_cast<float>(way_m));
  return hit.surface == sim::Surface::none || static_cast<double>(hit.range_m) >= way_m - 0.05;
}

/// Of each sort of pairs so many, spread over the drive. Every other pair of different places is the nearest
/// such scan, as the mapper itself would offer it; the rest are any within reach.
std::vector<Pair> choose_pairs(const Place& place, const std::vector<Pose>& world_from_scanner, std::size_t most) {
  const auto count = static_cast<std::uint32_t>(world_from_scanner.size());
  std::vector<double> way_m(count, 0);
  for (std::uint32_t i = 1; i < count; ++i)
    way_m[i] = way_m[i - 1] + (world_from_scanner[i].translation_m - world_from_scanner[i - 1].translation_m).norm();
  const double least_way_m = place.kind == Kind::pass ? 11 : gap_m;
  std::vector<Pair> others;
  std::vector<Pair> revisits;
  sim::Random random(sim::mix(place.seed, 30));
  for (std::uint32_t last = 0; last < count; ++last) {
    std::vector<std::pair<double, std::uint32_t>> near_others;
    std::pair<double, std::uint32_t> nearest_revisit{revisit_m, count};
    for (std::uint32_t first = 0; first + gap_scans <= last; ++first) {
      if (way_m[last] - way_m[first] < least_way_m) break;
      const Vector3d& a = world_from_scanner[first].translation_m;
      const Vector3d& b = world_from_scanner[last].translation_m;
      const double apart_m = (a - b).norm();
      const double reach_m = place.kind == Kind::yards ? 25 : farthest_m;
      if (apart_m > reach_m) continue;
      const bool is_seen = in_sight(place.scene, a, b);
      if (is_seen && apart_m <= nearest_revisit.first) nearest_revisit = {apart_m, first};
      if (!is_seen || apart_m > nearest_other_m) near_others.emplace_back(apart_m, first);
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
    const std::size_t take = std::min(most, sort->size());
    for (std::size_t k = 0; k < take; ++k) chosen.push_back((*sort)[(2 * k + 1) * sort->size() / (2 * take)]);
  }
  return chosen;
}

}  // namespace

std::vector<Pose> PlaceDrive::odometry(double noise) const {
  sim::OdometrySettings settings;
  settings.scale_error *= noise;
  settings.way_noise *= noise;
  settings.heading_bias_deg_per_m *= noise;
  settings.heading_walk_deg *= noise;
  settings.turn_scale_error *= noise;
  return sim::planar_odometry(truth, settings, place.seed);
}

PlaceDrive drive_through(Place place, Scanner scanner, std::size_t pairs_a_sort) {
  PlaceDrive drive;
  const ScannerModel model(scanner, place.reach_m);
  const std::uint64_t seed = sim::mix(place.seed, static_cast<std::uint64_t>(place.kind), static_cast<std::uint64_t>(scanner));
  const std::vector<Pose> world_from_scanner = poses_along(place, model.height_m(), seed);
  const Pose map_from_world = world_from_scanner.front().inverse();
  for (std::size_t i = 0; i < world_from_scanner.size(); ++i) {
    drive.truth.push_back(i == 0 ? Pose{} : map_from_world * world_from_scanner[i]);
    drive.scans.push_back(model.scan(place.scene, world_from_scanner[i], sim::mix(seed, 40, i)));
  }
  drive.pairs = choose_pairs(place, world_from_scanner, pairs_a_sort);
  drive.place = std::move(place);
  drive.scanner = scanner;
  return drive;
}

}  // namespace alces::places
