// One edge on a GPIO line.
#pragma once

#include <cstdint>

namespace alces {

struct GpioEdge {
  std::uint8_t line = 0;  ///< which of the configured lines, counted from 0 in the order of the configuration
  bool is_rising = true;
  std::uint32_t sequence = 0;  ///< the kernel's count on this line, from 1; 0: not known (libgpiod 1)

  friend bool operator==(const GpioEdge&, const GpioEdge&) = default;
};

}  // namespace alces
