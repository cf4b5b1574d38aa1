// How the simulated scanner is mounted: what the drivers' configuration must say to get it right.
//
// Frames: body (on the ground between the wheels, x ahead), head (turns about its z axis, origin at the
// height of the laser's mirror), laser (x straight ahead, rays turn anticlockwise about z). At head angle 0
// the head's axes are body_from_head's.
#pragma once

#include <cstdint>

#include "alces/pose.h"

namespace alces::sim {

struct RigGeometry {
  static constexpr std::uint8_t maximum_lasers = 2;

  Pose body_from_head{Eigen::Quaterniond::Identity(), {0.05, 0, 1.0}};
  /// From the axis to the mirror, along the laser's x axis.
  double mirror_offset_m = 0.08;
  /// The index pulse's rising edge comes at this head angle (turning anticlockwise).
  double index_angle_rad = 0.4;
  /// The own vehicle's deck: a disc about the head's axis. Rays that meet it measure it, at up to 0.84 m:
  /// drivers have to leave out what is nearer than own_vehicle_range_m().
  double deck_height_m = 0.3;
  double deck_radius_m = 0.45;
  Eigen::Vector3d body_from_antenna_m{-0.2, 0, 1.1};

  /// The scan plane is vertical, ray 0 points down, the middle ray away from the axis, the last ray up. Laser
  /// 0 looks along the head's x axis, laser 1 to the other side (back to back: RTS/ScanDriveDuo).
  [[nodiscard]] Pose head_from_laser(std::uint8_t laser) const;
  [[nodiscard]] Pose body_from_laser(std::uint8_t laser, double head_angle_rad) const;
  /// All of the own vehicle is nearer than this to each laser.
  [[nodiscard]] double own_vehicle_range_m() const;
};

}  // namespace alces::sim
