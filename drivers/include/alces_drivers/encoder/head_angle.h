// The port through which the head's angle is asked for: an encoder live, a function in tests.
#pragma once

#include <cstdint>

namespace alces {

enum class AngleStatus : std::uint8_t {
  ok,
  not_yet,  ///< ask again later: a reference after that time may still come
  too_old,  ///< before what is remembered
  lost,     ///< not known, and later events will hardly change that
};
[[nodiscard]] const char* to_string(AngleStatus status);

struct AngleAnswer {
  AngleStatus status = AngleStatus::lost;
  double angle_rad = 0;  ///< about the head's z axis, anticlockwise; not wrapped: it grows by 2 pi a turn
  double sigma_rad = 0;  ///< standard deviation
};

class HeadAngle {
 public:
  /// An answer that was ok once is the same for ever, as long as it is not too_old.
  [[nodiscard]] virtual AngleAnswer angle_at(std::int64_t stamp_ns) const = 0;

 protected:
  ~HeadAngle() = default;
};

}  // namespace alces
