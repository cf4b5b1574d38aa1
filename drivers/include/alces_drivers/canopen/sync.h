// SYNC: the cycle at which nodes sample and send. Producer, with or without the counter. CiA 301
// version 4.2, 7.2.5.
#pragma once

#include <cstdint>

#include "alces_drivers/can_frame.h"
#include "alces_drivers/port/can_port.h"
#include "alces_drivers/stamp.h"

namespace alces::canopen {

struct SyncConfig {
  std::int64_t period_ns = 10 * ns_per_ms;  ///< 0: there is no SYNC on this bus
  std::uint8_t counter_overflow = 0;  ///< 0: no counter; 2 to 240: the last number (nodes' 0x1019 must agree)
};

class SyncProducer {
 public:
  struct Counters {
    std::uint64_t sent = 0;
    std::uint64_t skipped = 0;    ///< SYNC cycles that were over before a tick came
    std::uint64_t not_taken = 0;  ///< the port's queue was full; skipped as well

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("syncs_sent", sent);
      visit("syncs_skipped", skipped);
      visit("syncs_not_taken", not_taken);
    }
  };

  explicit SyncProducer(const SyncConfig& config) : config_(config) {}

  /// The first SYNC at `now_ns`, with counter 1.
  void start(std::int64_t now_ns);
  void stop() { due_ns_ = no_stamp_ns; }

  /// Sends one SYNC when a SYNC cycle is due, also when several were missed; the SYNC cycles stay where
  /// start() put them. True: it was sent just now.
  bool on_tick(std::int64_t now_ns, CanPort& port);

  /// When the next one is due: the latest time for a tick that is not to delay it. no_stamp_ns: none is.
  [[nodiscard]] std::int64_t due_ns() const { return due_ns_; }
  [[nodiscard]] bool is_running() const { return due_ns_ != no_stamp_ns; }
  /// The one sent last.
  [[nodiscard]] const CanFrame& frame() const { return frame_; }
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  SyncConfig config_;
  std::int64_t due_ns_ = no_stamp_ns;
  std::uint8_t counter_ = 0;  ///< sent last; 0: none
  CanFrame frame_;
  Counters counters_;
};

}  // namespace alces::canopen
