// The vehicle's true motion in continuous time: where its body is at any nanosecond, and how fast.
//
// The body (origin on the ground between the wheels, x ahead) goes along a tour's line without slipping
// sideways: its heading is the line's tangent. Height, pitch and roll follow the ground under four wheels,
// smoothed by the suspension; paving shakes it. Position, height and tilt are C2 splines of the way, the way
// is a C2 spline of time: velocities and accelerations have no jumps, and what odometry and gyro measure is
// their exact derivative.
//
// The vehicle stands at first (so that a gyro's bias can be estimated while the scanner comes up), then
// drives for scans * scan_period_s at the mean speed, slower in bends, faster on straights, and stands again.
//
// Memory: about 160 bytes a metre and 80 bytes a second. at(): about 0.2 us.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

#include "alces/pose.h"
#include "alces_platform/sim/world/spline.h"
#include "alces_platform/sim/world/tour.h"
#include "alces_platform/sim/world/town.h"

namespace alces::sim {

struct MotionSettings {
  std::uint64_t seed = 1;
  std::int64_t start_stamp_ns = 100'000'000'000;  ///< when the simulation begins; the vehicle stands
  double standstill_s = 6;                        ///< before it drives
  std::size_t scans = 924;                        ///< it drives for so many scan periods
  double scan_period_s = 1.2;
  double mean_speed_m_per_s = way_per_scan_m / 1.2;  ///< while driving; about 1.1
  double bend_radius_m =
      3.7;  ///< tighter bends are driven slower than the mean speed, in proportion to their radius
  double acceleration_m_per_s2 = 0.4;  ///< and braking
  double suspension_m =
      0.8;  ///< the body follows the ground averaged over a Gaussian of this sigma along the way
  double vibration_rad = 0.002;  ///< standard deviation of pitch and roll from the paving
  double vibration_length_m = 1.5;
};

/// The tour that is long enough for this motion.
[[nodiscard]] Tour make_tour(const MotionSettings& settings);

class VehicleMotion {
 public:
  struct State {
    Pose town_from_body;
    Eigen::Vector3d velocity_m_per_s;  ///< of the body's origin, in the body frame: x is what wheels measure
    Eigen::Vector3d rate_rad_per_s;    ///< angular velocity in the body frame: z is what a yaw gyro measures
  };

  /// An open tour that is too short ends the drive early. Takes about 0.1 s a kilometre.
  VehicleMotion(const MotionSettings& settings, const Tour& tour, const Town& town);

  /// Any time; before the start and after the end the vehicle stands.
  [[nodiscard]] State at(std::int64_t stamp_ns) const;
  [[nodiscard]] Pose town_from_body(std::int64_t stamp_ns) const { return at(stamp_ns).town_from_body; }

  /// Way driven since the start, m.
  [[nodiscard]] double way_m(std::int64_t stamp_ns) const;
  [[nodiscard]] std::int64_t start_stamp_ns() const { return settings_.start_stamp_ns; }
  /// When the vehicle starts to roll, and when it stands again for good.
  [[nodiscard]] std::int64_t roll_stamp_ns() const { return roll_stamp_ns_; }
  [[nodiscard]] std::int64_t stop_stamp_ns() const { return stop_stamp_ns_; }
  [[nodiscard]] double tour_length_m() const { return tour_length_m_; }

 private:
  void lay_out(const TourLine& line, const Town& town, std::size_t cells);
  void set_timetable(std::size_t cells);

  static constexpr double cell_m = 0.25;   ///< between knots along the way
  static constexpr double knot_s = 0.1;    ///< between knots in time
  static constexpr int margin_cells = 16;  ///< knots before the first place and after the last

  MotionSettings settings_;
  double tour_length_m_ = 0;
  std::int64_t roll_stamp_ns_ = 0;
  std::int64_t stop_stamp_ns_ = 0;
  UniformSpline<2> xy_m_;      ///< of the way, m
  UniformSpline<3> standing_;  ///< of the way: height m, pitch rad, roll rad
  UniformSpline<1> way_m_;     ///< of the time since start, s
};

}  // namespace alces::sim
