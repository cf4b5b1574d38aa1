// The port through which the vehicle's motion is asked for: odometry live, a function in tests.
#pragma once

#include <cstdint>

#include "alces/pose.h"

namespace alces {

enum class MotionStatus : std::uint8_t {
  ok,
  not_yet,  ///< ask again later: the frame after that time may still come
  too_old,  ///< before what is remembered
  stale,    ///< no believable odometry at that time
};
[[nodiscard]] const char* to_string(MotionStatus status);

struct MotionAnswer {
  MotionStatus status = MotionStatus::stale;
  Pose odometry_from_body;       ///< in a frame that drifts, but never jumps
  bool is_extrapolated = false;  ///< past the newest frame
};

class Motion {
 public:
  [[nodiscard]] virtual MotionAnswer pose_at(std::int64_t stamp_ns) const = 0;

 protected:
  ~Motion() = default;
};

}  // namespace alces
