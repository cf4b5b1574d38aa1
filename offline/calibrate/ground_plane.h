// How the head stands over the ground: its roll, pitch and height on a vehicle whose wheels stand on the
// plane that the scanner sees around it.
//
// The ground is the plane of most points within `reach_m` of the head, of those that the configured mounting
// puts within `search_m` of the ground and that is not steeper than `steepest_rad`: RANSAC with a fixed seed,
// then least squares with Cauchy weights. Of several stands the mean is taken, each weighing alike.
//
// Standard deviation: of one stand, from the residuals, as if 200 of them were independent; of several, from
// their spread, if that is larger. What the ground under the wheels differs from the plane is not in it: 5 mm
// under one wheel of a track of 0.6 m are 0.5 deg. Stand on a flat floor, best in two directions.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "mounting.h"

namespace alces::offline {

struct GroundSettings {
  double ground_z_m = 0;  ///< of the ground in the body frame, under the wheels
  double reach_m = 3;
  double search_m = 0.4;
  double steepest_rad = 0.17;
  double tolerance_m = 0.04;
  std::size_t least_points = 200;
};

struct GroundEstimate {
  bool is_found = false;
  std::size_t points = 0;  ///< in the plane, of all stands
  std::size_t stands = 0;  ///< where it was found
  double rms_m = 0;        ///< of these points
  Mounting head{};         ///< as configured, but for z, roll and pitch
  double sigma_z_m = 0;
  double sigma_roll_rad = 0;
  double sigma_pitch_rad = 0;
};

/// `ends_m`: where rays end in the frame of the head (ray_ends_m). Not found: is_found is false, and `head`
/// as configured.
[[nodiscard]] GroundEstimate estimate_ground(std::span<const StandingRay> rays,
                                             std::span<const Eigen::Vector3d> ends_m,
                                             const Mounting& configured_head,
                                             const GroundSettings& settings = {});

}  // namespace alces::offline
