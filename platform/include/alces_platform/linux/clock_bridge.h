// From CLOCK_REALTIME stamps to CLOCK_MONOTONIC, over steps of the clock (NTP, GPS, a user with `date`).
//
// The offset between the clocks is measured by reading realtime between two reads of monotonic; the tightest
// of a few such brackets counts. It is measured anew when it is older than 10 ms, and at once when a stamp
// does not fit it: lies after its own arrival or more than 5 ms before. Frames that were stamped before a
// step are still in the socket's queue after it, so for a second after a step the offset from before it is
// tried too; the one that makes the frame younger wins. A stamp that neither offset explains (in the future,
// or over 1 s old) is replaced by the arrival time and counted: late by the latency, but never absurd.
//
// Error: half the tightest bracket, some 50 ns on an idle machine; a step smaller than 5 ms may go unnoticed
// for 10 ms. Cost: a few ns a stamp, about 0.3 us every 10 ms.
#pragma once

#include <cstdint>

#include "alces_platform/linux/clock.h"

namespace alces {

class ClockBridge {
 public:
  static constexpr std::int64_t measure_every_ns = 10 * ns_per_ms;
  static constexpr std::int64_t doubtful_age_ns = 5 * ns_per_ms;
  static constexpr std::int64_t maximum_age_ns = ns_per_s;

  struct Counters {
    std::uint64_t measurements = 0;
    std::uint64_t steps = 0;          ///< of the realtime clock, seen as a jump of the offset
    std::uint64_t future_stamps = 0;  ///< replaced by the arrival time: after it
    std::uint64_t stale_stamps = 0;   ///< replaced by the arrival time: more than maximum_age_ns before it

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("measurements", measurements);
      visit("steps", steps);
      visit("future_stamps", future_stamps);
      visit("stale_stamps", stale_stamps);
    }
  };

  explicit ClockBridge(ClockReader& clocks) : clocks_(clocks) {}

  /// The monotonic time of a realtime stamp on something that was read at `arrival_ns` (monotonic). Never
  /// after `arrival_ns`, never more than maximum_age_ns before.
  [[nodiscard]] std::int64_t monotonic_ns(std::int64_t realtime_ns, std::int64_t arrival_ns);

  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  void measure();
  /// The age that the stamp has at `arrival_ns` by this offset; negative: in the future.
  [[nodiscard]] static std::int64_t age_ns(std::int64_t realtime_ns, std::int64_t offset_ns,
                                           std::int64_t arrival_ns);

  ClockReader& clocks_;
  std::int64_t offset_ns_ = 0;  ///< realtime - monotonic
  std::int64_t uncertainty_ns_ = 0;
  std::int64_t measured_ns_ = no_stamp_ns;
  std::int64_t offset_before_step_ns_ = 0;
  std::int64_t step_ns_ = no_stamp_ns;  ///< when the last step was seen
  Counters counters_;
};

}  // namespace alces
