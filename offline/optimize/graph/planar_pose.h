// Poses of a planar graph: x, y and an angle about z.
#pragma once

#include <cmath>
#include <numbers>

#include "alces/pose.h"

namespace alces::offline {

/// In (-pi, pi].
[[nodiscard]] inline double wrapped_angle_rad(double angle_rad) {
  const double turned = std::remainder(angle_rad, 2 * std::numbers::pi);
  return turned <= -std::numbers::pi ? std::numbers::pi : turned;
}

[[nodiscard]] inline double heading_rad(const Pose& pose) {
  return wrapped_angle_rad(2 * std::atan2(pose.rotation.z(), pose.rotation.w()));
}

[[nodiscard]] inline Pose planar_pose(double x_m, double y_m, double heading_rad) {
  Pose pose;
  pose.translation_m = {x_m, y_m, 0};
  pose.rotation = Eigen::Quaterniond(std::cos(heading_rad / 2), 0, 0, std::sin(heading_rad / 2));
  return pose;
}

}  // namespace alces::offline
