#include "alces_platform/sim/scanner.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "alces_platform/sim/random.h"

namespace alces::sim {

Scanner::Scanner(const ScannerSettings& settings, std::uint64_t seed) : settings_(settings), seed_(seed) {
  profiles_ = std::max<std::size_t>(1, (settings.points_per_scan + rays_per_profile / 2) / rays_per_profile);
  for (std::size_t profile = 0; profile < profiles_; ++profile) {
    const double yaw = 2 * std::numbers::pi * static_cast<double>(profile) / static_cast<double>(profiles_);
    for (std::size_t ray = 0; ray < rays_per_profile; ++ray) {
      const double elevation = (static_cast<double>(ray) - 90.0) * std::numbers::pi / 180.0;
      directions_.emplace_back(std::cos(elevation) * std::cos(yaw), std::cos(elevation) * std::sin(yaw),
                               std::sin(elevation));
    }
  }
}

void Scanner::scan(const Scene& scene, const Pose& town_from_body, std::size_t scan,
                   std::vector<Point>& points) const {
  points.clear();
  const Eigen::Vector3d head(0, 0, settings_.height_m);
  const Eigen::Matrix3d rotation = town_from_body.rotation.toRotationMatrix();
  const Eigen::Vector3f origin = (town_from_body * head).cast<float>();
  const auto limit = static_cast<float>(settings_.max_range_m);
  const double steepest =
      -std::atan2(settings_.height_m - 0.3, settings_.own_radius_m);  // 0.3: height of the deck
  const double own_z = std::sin(steepest);
  Random random(mix(seed_, scan));

  RangeMeter meter(settings_);
  for (std::size_t ray = 0; ray < directions_.size(); ++ray) {
    if (ray % rays_per_profile == 0) meter.reset();
    const Eigen::Vector3d& direction = directions_[ray];
    if (direction.z() < own_z) continue;
    const Eigen::Vector3f ray_direction = (rotation * direction).cast<float>();
    const double range = meter.measure(scene.cast(origin, ray_direction, limit), random);
    if (range <= 0) continue;
    const Eigen::Vector3f point = (head + range * direction).cast<float>();
    points.push_back({point.x(), point.y(), point.z()});
  }
}

}  // namespace alces::sim
