#include "alces_platform/sim/rig_geometry.h"

#include <cmath>
#include <numbers>

namespace alces::sim {

Pose RigGeometry::head_from_laser(std::uint8_t laser) const {
  // Columns: the laser's axes in the head frame. x: away from the axis, y: up, z = x cross y.
  Eigen::Matrix3d axes;
  axes.col(0) = laser == 0 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d(-Eigen::Vector3d::UnitX());
  axes.col(1) = Eigen::Vector3d::UnitZ();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  Pose pose;
  pose.rotation = Eigen::Quaterniond(axes);
  pose.translation_m = mirror_offset_m * axes.col(0);
  return pose;
}

Pose RigGeometry::body_from_laser(std::uint8_t laser, double head_angle_rad) const {
  Pose turned;
  turned.rotation = Eigen::AngleAxisd(head_angle_rad, Eigen::Vector3d::UnitZ());
  return body_from_head * turned * head_from_laser(laser);
}

double RigGeometry::own_vehicle_range_m() const {
  const double drop_m = body_from_head.translation_m.z() - deck_height_m;
  const double reach_m = deck_radius_m + mirror_offset_m;
  return std::sqrt(drop_m * drop_m + reach_m * reach_m) + 0.08;
}

}  // namespace alces::sim
