// The head's yaw and place on the vehicle from a drive: scan matching says how the head moved, odometry says
// what is ahead.
//
// A vehicle on wheels does not move sideways at the origin of its body frame. Of a step between two scans,
// the chord that matching saw, turned back by half the step's turn, therefore lies ahead, but for the arm of
// the head in a bend (phi: turn of the step, psi: error of the yaw, x and y: errors of the head's place; o:
// chord of the odometry, k: its scale):
//   a_y + psi a_x = 2 sin(phi / 2) x           the sideways part gives yaw, from straight steps,
//                                               and x, from bends
//   a_x - psi a_y = k o_x - 2 sin(phi / 2) y    the part ahead gives y, from bends both ways, and k
// Two small least-squares problems, with Cauchy weights.
#pragma once

#include <cstddef>
#include <span>

#include "alces/pose.h"
#include "mounting.h"

namespace alces::offline {

/// From one scan to a later one, both as earlier_from_later of the body frame.
struct DriveStep {
  Pose matched;
  Pose odometry;
};

struct DriveGeometrySettings {
  double least_way_m = 0.3;  ///< of a step, ahead
  double largest_turn_rad = 0.7;
  std::size_t least_steps = 10;
  double largest_sigma_yaw_rad = 0.0035;  ///< 0.2 deg; less certain is not estimated
  double largest_sigma_m = 0.02;
};

struct DriveGeometry {
  std::size_t steps = 0;  ///< used
  double way_m = 0;       ///< of these
  double turned_rad = 0;  ///< of these, both ways together
  bool has_yaw = false;
  bool has_x = false;
  bool has_y = false;
  Mounting head{};  ///< as configured, but for what was estimated of x, y, yaw
  double sigma_yaw_rad = 0;
  double sigma_x_m = 0;
  double sigma_y_m = 0;
  double odometry_scale = 1;  ///< matched way by odometry's
  double sigma_scale = 0;
};

/// `configured_head` is what `matched` was made with. With too few steps nothing is estimated.
[[nodiscard]] DriveGeometry estimate_drive_geometry(std::span<const DriveStep> steps,
                                                    const Mounting& configured_head,
                                                    const DriveGeometrySettings& settings = {});

}  // namespace alces::offline
