#include "alces_platform/sim/drive.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "alces_platform/sim/random.h"

namespace alces::sim {
namespace {

constexpr double deg = std::numbers::pi / 180.0;

}  // namespace

std::vector<Pose> planar_odometry(const std::vector<Pose>& truth, const OdometrySettings& settings,
                                  std::uint64_t seed) {
  Random random(mix(seed, 40));
  const double scale_error = settings.scale_error * random.uniform(0.7, 1.3);
  const double scale = 1.0 + (random.chance(0.5) ? scale_error : -scale_error);
  const double turn_scale = 1.0 + settings.turn_scale_error * random.normal();
  const double bias = settings.heading_bias_deg_per_m * deg * random.normal();
  std::vector<Pose> odometry(1);
  double x = 0, y = 0, yaw = 0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Pose step = truth[i - 1].inverse() * truth[i];
    const double way = step.translation_m.norm();
    const Eigen::Vector3d ahead = step.rotation * Eigen::Vector3d::UnitX();
    const double turn = std::atan2(ahead.y(), ahead.x());
    const double turn_measured =
        turn_scale * turn + bias * way + settings.heading_walk_deg * deg * random.normal();
    const double way_measured = scale * way * (1.0 + settings.way_noise * random.normal());
    x += way_measured * std::cos(yaw + 0.5 * turn_measured);
    y += way_measured * std::sin(yaw + 0.5 * turn_measured);
    yaw += turn_measured;
    Pose pose;
    pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
    pose.translation_m = {x, y, 0};
    odometry.push_back(pose);
  }
  return odometry;
}

Drive::Drive(const DriveSettings& settings, const Tour& tour)
    : town_(std::make_shared<Town>(tour.layout)), scanner_(settings.scanner, mix(settings.seed, 50)) {
  const Route route(tour, *town_, std::max<std::size_t>(1, settings.scans), settings.seed);
  town_from_body_ = route.poses();
  tour_length_m_ = route.length_m();
  const Pose start_from_town = town_from_body_.front().inverse();
  for (const Pose& town_from_body : town_from_body_) truth_.push_back(start_from_town * town_from_body);
  truth_.front() = Pose{};
  odometry_ = planar_odometry(truth_, settings.odometry, settings.seed);
}

void Drive::points(std::size_t index, std::vector<Point>& points) const {
  scanner_.scan(town_->scene(), town_from_body_[index], index, points);
}

std::vector<Point> Drive::points(std::size_t index) const {
  std::vector<Point> result;
  points(index, result);
  return result;
}

Drive drive(const DriveSettings& settings) {
  return {settings, make_tour(settings.scans, settings.seed)};
}

LookAlike look_alike_drive(std::uint64_t seed, const DriveSettings& settings) {
  constexpr double block_m = 48;
  constexpr std::size_t columns = 13, apart = 8;
  Tour tour;
  tour.layout.seed = seed;
  tour.layout.period_m = block_m * static_cast<double>(apart);
  for (std::size_t line = 0; line <= columns; ++line) {
    tour.layout.column_lines_m.push_back(block_m * static_cast<double>(line));
    tour.layout.column_keys.push_back(line >= apart ? line - apart : line);
  }
  for (int line = 0; line <= 4; ++line) tour.layout.row_lines_m.push_back(block_m * line);
  tour.crossings = {{1, 2}, {static_cast<int>(columns) - 1, 2}};
  tour.closed = false;
  DriveSettings drive_settings = settings;
  drive_settings.seed = seed;
  drive_settings.scans = static_cast<std::size_t>(block_m * (columns - 2) / Route::step_m);
  Drive drive(drive_settings, tour);

  // The middle of the first stretch (blocks 0 to 4 are alike with 8 to 12), and the scan nearest to its
  // counterpart.
  const double middle_m = 1.5 * block_m;
  LookAlike result{std::move(drive), static_cast<std::size_t>(middle_m / Route::step_m), 0, {}};
  const Eigen::Vector3d here = result.drive.truth(result.first).translation_m;
  double best = 1e9;
  for (std::size_t i = result.first; i < result.drive.size(); ++i) {
    const double gap = std::abs((result.drive.truth(i).translation_m - here).norm() - tour.layout.period_m);
    if (gap < best) {
      best = gap;
      result.second = i;
    }
  }
  Pose moved = result.drive.town_from_body(result.second);
  moved.translation_m.head<2>() -= tour.layout.period_m * result.drive.town().east();
  result.first_from_second = result.drive.town_from_body(result.first).inverse() * moved;
  return result;
}

}  // namespace alces::sim
