// How long to wait before the next attempt: twice as long each time, up to a limit.
#pragma once

#include <algorithm>
#include <cstdint>

#include "alces_drivers/stamp.h"

namespace alces {

struct BackOff {
  std::int64_t first_ns = 200 * ns_per_ms;
  std::int64_t maximum_ns = 10 * ns_per_s;

  /// After the first, second, ... failed attempt (counted from 1).
  [[nodiscard]] constexpr std::int64_t delay_ns(std::uint32_t attempt) const {
    std::int64_t delay_ns = first_ns;
    for (std::uint32_t doubled = 1; doubled < attempt && delay_ns < maximum_ns; ++doubled) delay_ns *= 2;
    return std::min(delay_ns, maximum_ns);
  }
};

}  // namespace alces
