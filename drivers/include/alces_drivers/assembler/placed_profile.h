// One sweep of a 2D laser with all that places its rays: the head's angle and the vehicle's motion at its
// begin and its end. What a calibration of the mounting needs, which undoes the mounting that points have in
// them.
#pragma once

#include <cstdint>
#include <span>

#include "alces/pose.h"

namespace alces {

/// Ray i was measured along first_angle_rad + i * angle_step_rad (profile.h). Between begin (ray 0) and end
/// (the last ray) the head's angle and the motion are linear.
struct PlacedProfile {
  std::uint8_t laser = 0;
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
  double first_angle_rad = 0;
  double angle_step_rad = 0;
  std::span<const float> ranges_m;  ///< 0: no measurement, or masked; the assembler's, valid during the call
  double begin_head_angle_rad = 0;  ///< not wrapped (head_angle.h)
  double end_head_angle_rad = 0;
  bool has_motion = false;
  Pose odometry_from_begin_body;  ///< identity without motion
  Pose odometry_from_end_body;
};

class PlacedProfileSink {
 public:
  /// The profile is the caller's and is overwritten by the next one.
  virtual void on_placed_profile(const PlacedProfile& profile) = 0;

 protected:
  ~PlacedProfileSink() = default;
};

}  // namespace alces
