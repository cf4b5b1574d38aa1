#include "mounting.h"

#include <algorithm>
#include <cmath>

namespace alces::offline {

Mounting mounting_of(const Pose& parent_from_child) {
  const Eigen::Matrix3d r = parent_from_child.rotation.toRotationMatrix();
  const Eigen::Vector3d& t = parent_from_child.translation_m;
  return {t.x(),
          t.y(),
          t.z(),
          std::atan2(r(2, 1), r(2, 2)),
          std::asin(std::clamp(-r(2, 0), -1.0, 1.0)),
          std::atan2(r(1, 0), r(0, 0))};
}

Pose pose_of(const Mounting& mounting) {
  Pose pose;
  pose.translation_m = {mounting[key_x], mounting[key_y], mounting[key_z]};
  pose.rotation = Eigen::AngleAxisd(mounting[key_yaw], Eigen::Vector3d::UnitZ()) *
                  Eigen::AngleAxisd(mounting[key_pitch], Eigen::Vector3d::UnitY()) *
                  Eigen::AngleAxisd(mounting[key_roll], Eigen::Vector3d::UnitX());
  return pose;
}

const char* name(MountingKey key) {
  static constexpr std::array<const char*, mounting_keys> names{"x_m",      "y_m",       "z_m",
                                                                "roll_deg", "pitch_deg", "yaw_deg"};
  return names[static_cast<std::size_t>(key)];
}

bool is_angle(MountingKey key) {
  return key >= key_roll;
}

std::vector<Eigen::Vector3d> ray_ends_m(std::span<const StandingRay> rays, std::span<const Mounting> lasers) {
  std::vector<Pose> poses;
  for (const Mounting& laser : lasers) poses.push_back(pose_of(laser));
  std::vector<Eigen::Matrix3d> rotations;
  for (const Pose& pose : poses) rotations.push_back(pose.rotation.toRotationMatrix());
  std::vector<Eigen::Vector3d> ends_m;
  ends_m.reserve(rays.size());
  for (const StandingRay& ray : rays) {
    const double range_m = static_cast<double>(ray.range_m);
    const double angle_rad = static_cast<double>(ray.ray_angle_rad);
    const Eigen::Vector3d in_laser(range_m * std::cos(angle_rad), range_m * std::sin(angle_rad), 0);
    const Eigen::Vector3d in_head = rotations[ray.laser] * in_laser + poses[ray.laser].translation_m;
    const double c = std::cos(ray.head_angle_rad);
    const double s = std::sin(ray.head_angle_rad);
    ends_m.emplace_back(c * in_head.x() - s * in_head.y(), s * in_head.x() + c * in_head.y(), in_head.z());
  }
  return ends_m;
}

}  // namespace alces::offline
