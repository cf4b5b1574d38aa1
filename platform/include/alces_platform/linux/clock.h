// The two clocks of the world outside. Everything inside Alces is CLOCK_MONOTONIC (alces_drivers/stamp.h);
// the kernel's stamps on network frames are CLOCK_REALTIME and pass through a ClockBridge.
#pragma once

#include <ctime>

#include <cstdint>

#include "alces_drivers/stamp.h"

namespace alces {

[[nodiscard]] constexpr std::int64_t nanoseconds(const std::timespec& time) {
  return std::int64_t{time.tv_sec} * ns_per_s + std::int64_t{time.tv_nsec};
}

/// CLOCK_MONOTONIC. About 30 ns, no system call.
[[nodiscard]] std::int64_t now_ns();

/// How long the machine has been suspended since it booted: CLOCK_BOOTTIME less CLOCK_MONOTONIC.
[[nodiscard]] std::int64_t suspended_ns();

/// Where code that must be tested against stepping clocks gets its time.
class ClockReader {
 public:
  [[nodiscard]] virtual std::int64_t monotonic_ns() = 0;
  [[nodiscard]] virtual std::int64_t realtime_ns() = 0;

 protected:
  ~ClockReader() = default;
};

/// The machine's own clocks.
class SystemClocks final : public ClockReader {
 public:
  [[nodiscard]] std::int64_t monotonic_ns() override;
  [[nodiscard]] std::int64_t realtime_ns() override;
};

/// The one that everybody may share: it has no state.
extern SystemClocks system_clocks;

}  // namespace alces
