// Whether edges of one GPIO line are missing, and whether a stamp on one can be true. Pure.
//
// libgpiod 2 numbers the edges of a line: a gap in the numbers is the number of edges lost. libgpiod 1 does
// not: the kernel's buffer holds 16 edges a line and drops what comes on top, silently. There, a loss shows
// as two edges of the same direction one after the other (where both are asked for), or must be feared when a
// buffer was found full.
#pragma once

#include <cstdint>
#include <optional>

#include "alces_drivers/encoder/edge.h"
#include "alces_platform/linux/clock_bridge.h"

namespace alces {

class EdgeCheck {
 public:
  /// `has_both`: rising and falling edges were asked for, so they alternate.
  explicit EdgeCheck(bool has_both = true) : has_both_(has_both) {}

  /// To be told of every edge. Nothing: none is missing before it. 0: some are, how many is not known.
  [[nodiscard]] std::optional<std::uint32_t> missing_before(const GpioEdge& edge);
  /// The line was requested anew; or, without numbers, a loss has been reported already.
  void restart() { is_known_ = false; }

 private:
  bool has_both_;
  bool is_known_ = false;  ///< last_ is an edge
  GpioEdge last_;
};

/// The monotonic time of an edge's stamp, read at `now_ns`. Kernels before 5.7 stamp with CLOCK_REALTIME,
/// which lies far in monotonic's future: those go through the bridge. Answers `now_ns`, and counts, when
/// neither clock explains it.
[[nodiscard]] std::int64_t edge_stamp_ns(std::int64_t stamp_ns, std::int64_t now_ns, ClockBridge& bridge,
                                         std::uint64_t& implausible_count);

}  // namespace alces
