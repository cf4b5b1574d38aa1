#include "alces_platform/linux/gpio/edge_check.h"

namespace alces {

std::optional<std::uint32_t> EdgeCheck::missing_before(const GpioEdge& edge) {
  const GpioEdge last = last_;
  const bool was_known = is_known_;
  last_ = edge;
  is_known_ = true;
  if (edge.sequence != 0) {
    // The kernel counts from 1 since the request, in 32 bits.
    const std::uint32_t expected = was_known ? last.sequence + 1 : 1;
    const std::uint32_t missing = edge.sequence - expected;
    if (missing == 0) return std::nullopt;
    // Backwards: the line was requested anew behind our back. Anything may be missing.
    return missing < UINT32_MAX / 2 ? missing : 0;
  }
  if (was_known && has_both_ && last.is_rising == edge.is_rising) return 0;
  return std::nullopt;
}

std::int64_t edge_stamp_ns(std::int64_t stamp_ns, std::int64_t now_ns, ClockBridge& bridge,
                           std::uint64_t& implausible_count) {
  if (stamp_ns > 0 && stamp_ns <= now_ns) return stamp_ns;
  if (stamp_ns > now_ns) {
    const std::uint64_t refused_before = bridge.counters().future_stamps + bridge.counters().stale_stamps;
    const std::int64_t converted_ns = bridge.monotonic_ns(stamp_ns, now_ns);
    if (bridge.counters().future_stamps + bridge.counters().stale_stamps == refused_before)
      return converted_ns;
  }
  ++implausible_count;
  return now_ns;
}

}  // namespace alces
