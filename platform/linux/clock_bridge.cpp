#include "alces_platform/linux/clock_bridge.h"

#include <algorithm>
#include <cstdlib>

namespace alces {
namespace {

constexpr int brackets = 4;
/// adjtimex(2) slews by 500 ppm at most, and adjtime by as much again.
constexpr std::int64_t slew_divisor = 1000;
constexpr std::int64_t step_floor_ns = 50 * ns_per_us;

}  // namespace

void ClockBridge::measure() {
  std::int64_t best_width_ns = INT64_MAX;
  std::int64_t best_offset_ns = 0;
  std::int64_t before_ns = clocks_.monotonic_ns();
  for (int bracket = 0; bracket < brackets; ++bracket) {
    const std::int64_t realtime_ns = clocks_.realtime_ns();
    const std::int64_t after_ns = clocks_.monotonic_ns();
    const std::int64_t width_ns = after_ns - before_ns;
    if (width_ns < best_width_ns) {
      best_width_ns = width_ns;
      best_offset_ns = realtime_ns - (before_ns + width_ns / 2);
    }
    before_ns = after_ns;
  }
  const std::int64_t uncertainty_ns = best_width_ns / 2 + 1;
  if (measured_ns_ != no_stamp_ns) {
    const std::int64_t slew_ns = (before_ns - measured_ns_) / slew_divisor;
    const std::int64_t jump_ns = std::abs(best_offset_ns - offset_ns_);
    if (jump_ns > uncertainty_ns + uncertainty_ns_ + slew_ns + step_floor_ns) {
      ++counters_.steps;
      offset_before_step_ns_ = offset_ns_;
      step_ns_ = before_ns;
    }
  }
  offset_ns_ = best_offset_ns;
  uncertainty_ns_ = uncertainty_ns;
  measured_ns_ = before_ns;
  ++counters_.measurements;
}

std::int64_t ClockBridge::age_ns(std::int64_t realtime_ns, std::int64_t offset_ns, std::int64_t arrival_ns) {
  // Stamps are 0 or some 1e18; an absurd one must not overflow.
  constexpr std::int64_t far_ns = INT64_MAX / 4;
  return arrival_ns + offset_ns - std::clamp(realtime_ns, -far_ns, far_ns);
}

std::int64_t ClockBridge::monotonic_ns(std::int64_t realtime_ns, std::int64_t arrival_ns) {
  if (measured_ns_ == no_stamp_ns || arrival_ns - measured_ns_ > measure_every_ns) measure();
  std::int64_t age = age_ns(realtime_ns, offset_ns_, arrival_ns);
  if (age < -uncertainty_ns_ || age > doubtful_age_ns) {
    measure();
    age = age_ns(realtime_ns, offset_ns_, arrival_ns);
  }
  const auto explains = [this](std::int64_t age_then) {
    return age_then >= -uncertainty_ns_ && age_then <= maximum_age_ns;
  };
  if (step_ns_ != no_stamp_ns && arrival_ns - step_ns_ < maximum_age_ns) {
    const std::int64_t age_before = age_ns(realtime_ns, offset_before_step_ns_, arrival_ns);
    if (explains(age_before) && (!explains(age) || age_before < age)) age = age_before;
  }
  if (explains(age)) return arrival_ns - std::max<std::int64_t>(age, 0);
  ++(age < 0 ? counters_.future_stamps : counters_.stale_stamps);
  return arrival_ns;
}

}  // namespace alces
