// Takes the motion of the sensor out of a scan: points measured one after the other become those that a
// sensor standing still at one reference time would have measured.
//
// The motion is a list of poses at times, from an odometry, a map or an IMU, or one constant twist. Between
// two poses the body goes on a screw: constant speeds along and around one axis of its own (the exponential
// map of SE(3)), which a wheel, a turn and a hand-held swing do over a tenth of a second. Before the first
// and behind the last pose it goes on as it went, no farther than `longest_extrapolation_s`.
//
// Works in place. The result of a point follows from its place and time alone, not from the order of points.
// A body that stands leaves all bits as they are.
//
// Cost: O(n + log(poses) for each change of time between neighbours), some 150 multiplications where the time
// changes and 9 a point; points of one firing share their time. Memory: 128 bytes a pose of capacity.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "alces/arena.h"
#include "alces/point.h"
#include "alces/pose.h"

namespace alces {

enum class DeskewStatus : std::uint8_t {
  ok,
  no_motion,    ///< fewer than two poses and no twist: how the body moved is not known
  no_capacity,  ///< more poses than there is room for
  bad_pose,     ///< not finite, a quaternion that is none, or faster than farthest_place_m (or rad) a second
  times_not_growing,  ///< a pose's time is not finite, or not later than the one before
  times_missing,      ///< not one time a point
  time_not_finite,    ///< of a point, or of the reference
  outside_of_motion,  ///< a time farther off the poses than longest_extrapolation_s
};
/// A short English clause; never null, static storage.
[[nodiscard]] const char* to_string(DeskewStatus status);

struct DeskewConfig {
  std::uint32_t pose_capacity = 64;
  double longest_extrapolation_s = 0.25;  ///< not of a constant twist, which holds for all times
};

/// One measurement of a gyroscope, in the axes of the body.
struct GyroSample {
  double time_s = 0;
  Eigen::Vector3d rate_rad_s = Eigen::Vector3d::Zero();
};

class Deskew {
 public:
  constexpr Deskew(Arena& arena, const DeskewConfig& config)
      : config_(config), knots_(arena.allocate<Knot>(config.pose_capacity)) {}

  /// Forgets the motion.
  void clear();

  /// The next pose of the body in any fixed frame; its time on the clock of the points, later than all
  /// before. no_capacity, bad_pose, times_not_growing: it was not taken.
  [[nodiscard]] DeskewStatus add_pose(double time_s, const Pose& fixed_from_body);

  /// Replaces the motion by a constant one: speed in m/s, then rate in rad/s, both in axes of the body.
  [[nodiscard]] DeskewStatus set_twist(const Vector6d& twist_per_s);

  /// Replaces the motion by what an IMU saw: turns are integrated from one sample to the next by the mean of
  /// both rates, each less `bias_rad_s`, and the body moves at a constant velocity along its own axes.
  /// Between any two samples at most a half turn. As add_pose.
  [[nodiscard]] DeskewStatus set_gyro(std::span<const GyroSample> samples,
                                      const Eigen::Vector3d& body_velocity_m_s,
                                      const Eigen::Vector3d& bias_rad_s = Eigen::Vector3d::Zero());

  [[nodiscard]] std::uint32_t pose_count() const { return count_; }

  /// Where the body was at `time_s`, in the fixed frame of the poses.
  [[nodiscard]] DeskewStatus pose_at(double time_s, Pose& fixed_from_body) const;

  /// Moves each point of the body frame at its own time into the body frame at `reference_time_s`. Points
  /// that are not finite stay. Unless ok, no point was touched.
  [[nodiscard]] DeskewStatus apply(std::span<Point> points, std::span<const float> time_s,
                                   double reference_time_s) const;

 private:
  // A pose, and the way to the next one.
  struct Knot {
    double time_s = 0;
    Pose fixed_from_body;
    Vector6d twist_per_s = Vector6d::Zero();
  };

  [[nodiscard]] bool is_inside(double time_s) const;
  [[nodiscard]] Pose at(double time_s) const;
  [[nodiscard]] bool stands() const;

  DeskewConfig config_;
  std::span<Knot> knots_;
  std::uint32_t count_ = 0;
  bool is_constant_ = false;  // one knot, whose twist holds for all times
};

}  // namespace alces
