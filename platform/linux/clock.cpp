#include "alces_platform/linux/clock.h"

namespace alces {
namespace {

std::int64_t read(clockid_t clock) {
  std::timespec time{};
  clock_gettime(clock, &time);
  return nanoseconds(time);
}

}  // namespace

SystemClocks system_clocks;

std::int64_t now_ns() {
  return read(CLOCK_MONOTONIC);
}

std::int64_t suspended_ns() {
  return read(CLOCK_BOOTTIME) - read(CLOCK_MONOTONIC);
}

std::int64_t SystemClocks::monotonic_ns() {
  return read(CLOCK_MONOTONIC);
}

std::int64_t SystemClocks::realtime_ns() {
  return read(CLOCK_REALTIME);
}

}  // namespace alces
