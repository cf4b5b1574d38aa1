#include "places/scanner_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "alces_platform/sim/random.h"

namespace alces::places {

std::string_view name(Scanner scanner) {
  switch (scanner) {
    case Scanner::turning:
      return "turning";
    case Scanner::rings16:
      return "rings16";
    case Scanner::rings64:
      return "rings64";
  }
  return "unknown";
}

std::optional<Scanner> scanner_named(std::string_view wanted) {
  for (const Scanner scanner : all_scanners) {
    if (name(scanner) == wanted) return scanner;
  }
  return std::nullopt;
}

ScannerModel::ScannerModel(Scanner scanner, double reach_m) {
  constexpr double deg = std::numbers::pi / 180;
  double azimuth_step_deg = 2;
  double elevation_deg = -90;
  double elevation_step_deg = 1;
  errors_.max_range_m = std::min(reach_m, 40.0);
  if (scanner == Scanner::turning) {
    column_rays_ = 181;
    own_vehicle_rad_ = -57 * deg;
  } else {
    const bool is_dense = scanner == Scanner::rings64;
    column_rays_ = is_dense ? 64 : 16;
    azimuth_step_deg = is_dense ? 0.6 : 0.8;
    elevation_deg = is_dense ? -24.9 : -15;
    elevation_step_deg = is_dense ? 26.9 / 63 : 2;
    height_m_ = is_dense ? 1.7 : 1.0;
    own_vehicle_rad_ = -90 * deg;
    errors_ = {
        .noise_m = 0.02, .quantum_m = 0.002, .max_range_m = std::min(reach_m, 80.0), .mixed_share = 0.02};
  }
  const auto columns = static_cast<std::size_t>(std::lround(360 / azimuth_step_deg));
  for (std::size_t column = 0; column < columns; ++column) {
    const double azimuth = 2 * std::numbers::pi * static_cast<double>(column) / static_cast<double>(columns);
    for (std::size_t ray = 0; ray < column_rays_; ++ray) {
      const double elevation = (elevation_deg + elevation_step_deg * static_cast<double>(ray)) * deg;
      directions_.emplace_back(std::cos(elevation) * std::cos(azimuth),
                               std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    }
  }
}

std::vector<Point> ScannerModel::scan(const sim::Scene& scene, const Pose& world_from_scanner,
                                      std::uint64_t seed) const {
  const Eigen::Matrix3d rotation = world_from_scanner.rotation.toRotationMatrix();
  const Eigen::Vector3f origin = world_from_scanner.translation_m.cast<float>();
  const auto limit = static_cast<float>(errors_.max_range_m + 1);
  const double own_z = std::sin(own_vehicle_rad_);
  sim::Random random(seed);
  sim::RangeMeter meter(errors_);
  std::vector<Point> points;
  points.reserve(directions_.size());
  for (std::size_t ray = 0; ray < directions_.size(); ++ray) {
    if (ray % column_rays_ == 0) meter.reset();
    const Eigen::Vector3d& direction = directions_[ray];
    if (direction.z() < own_z) continue;
    const Eigen::Vector3f world_direction = (rotation * direction).cast<float>();
    const double range_m = meter.measure(scene.cast(origin, world_direction, limit), random);
    if (range_m <= 0) continue;
    const Eigen::Vector3f point = (range_m * direction).cast<float>();
    points.push_back({point.x(), point.y(), point.z()});
  }
  return points;
}

}  // namespace alces::places
