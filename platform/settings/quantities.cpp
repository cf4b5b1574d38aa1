#include "quantities.h"

#include "alces/portable_math.h"

namespace alces::settings {

Pose pose_of(const Placement& placement) {
  const auto turn = [](double angle_deg, const Eigen::Vector3d& axis) {
    return exp_so3(radians(angle_deg) * axis);
  };
  Pose pose;
  pose.rotation = (turn(placement.yaw_deg, Eigen::Vector3d::UnitZ()) *
                   turn(placement.pitch_deg, Eigen::Vector3d::UnitY()) *
                   turn(placement.roll_deg, Eigen::Vector3d::UnitX()))
                      .normalized();
  pose.translation_m = {placement.position_m[0], placement.position_m[1], placement.position_m[2]};
  return pose;
}

Placement placement_of(const Pose& pose) {
  const Eigen::Matrix3d r = pose.rotation.normalized().toRotationMatrix();
  const double cos_pitch = portable::hypot(r(0, 0), r(1, 0));
  double roll_rad = portable::atan2(r(2, 1), r(2, 2));
  double yaw_rad = portable::atan2(r(1, 0), r(0, 0));
  if (cos_pitch < 1e-9) {  // straight up or down: roll and yaw turn about the same axis
    roll_rad = 0;
    yaw_rad = portable::atan2(-r(0, 1), r(1, 1));
  }
  const auto in_range = [](double angle_rad) {
    const double angle_deg = degrees(angle_rad);
    return angle_deg == -180 ? 180 : angle_deg;
  };
  Placement placement;
  placement.position_m = {pose.translation_m.x(), pose.translation_m.y(), pose.translation_m.z()};
  placement.roll_deg = in_range(roll_rad);
  placement.pitch_deg = degrees(portable::atan2(-r(2, 0), cos_pitch));
  placement.yaw_deg = in_range(yaw_rad);
  return placement;
}

}  // namespace alces::settings
