// Is the node there, and did it start anew? Heartbeat consumer and producer, CiA 301 version 4.2, 7.2.8.3.2.
#pragma once

#include <cstdint>

#include "alces_drivers/can_frame.h"
#include "alces_drivers/canopen/nmt.h"
#include "alces_drivers/port/can_port.h"
#include "alces_drivers/stamp.h"

namespace alces::canopen {

enum class HeartbeatEvent : std::uint8_t {
  none,
  boot_up,         ///< a boot-up message of a node that was not known to be past it
  reset_detected,  ///< a boot-up message of a node that was operational: it lost its configuration
  state_changed,   ///< state() is another one
  lost,            ///< none came for longer than the time-out; raised once
  found,           ///< one came after `lost`
};

/// Follows one node. Watching for loss begins with watch(); boot-up messages and states are followed always.
class HeartbeatConsumer {
 public:
  /// A second boot-up message within this time is the same one, repeated by the bus.
  static constexpr std::int64_t repetition_ns = 20 * ns_per_ms;

  struct Counters {
    std::uint64_t heartbeats = 0;
    std::uint64_t boot_ups = 0;
    std::uint64_t boot_ups_repeated = 0;
    std::uint64_t resets_detected = 0;
    std::uint64_t losses = 0;
    std::uint64_t malformed = 0;

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("heartbeats", heartbeats);
      visit("boot_ups", boot_ups);
      visit("boot_ups_repeated", boot_ups_repeated);
      visit("resets_detected", resets_detected);
      visit("heartbeat_losses", losses);
      visit("heartbeats_malformed", malformed);
    }
  };

  explicit HeartbeatConsumer(std::uint8_t node) : node_(node) {}

  /// From now on one must come every `timeout_ns`; 0: do not watch.
  void watch(std::int64_t timeout_ns, std::int64_t now_ns);
  /// Forgets the state, as after our own order to reset: the boot-up that follows is no surprise.
  void forget() { state_ = NmtState::unknown; }

  /// Any frame; not this node's heartbeat: none.
  HeartbeatEvent on_frame(const CanFrame& frame, std::int64_t stamp_ns);
  HeartbeatEvent on_tick(std::int64_t now_ns);

  /// The last that it said; boot_up until another one came.
  [[nodiscard]] NmtState state() const { return state_; }
  [[nodiscard]] bool is_lost() const { return is_lost_; }
  [[nodiscard]] std::int64_t last_stamp_ns() const { return last_stamp_ns_; }
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  std::uint8_t node_;
  NmtState state_ = NmtState::unknown;
  std::int64_t timeout_ns_ = 0;
  std::int64_t watched_since_ns_ = no_stamp_ns;
  std::int64_t last_stamp_ns_ = no_stamp_ns;
  std::int64_t last_boot_up_ns_ = no_stamp_ns;
  bool is_lost_ = false;
  Counters counters_;
};

/// Our own: so that drives can stop by themselves when we are gone.
class HeartbeatProducer {
 public:
  /// Period 0: none.
  HeartbeatProducer(std::uint8_t node, std::int64_t period_ns) : node_(node), period_ns_(period_ns) {}

  /// Sends when it is due, with a boot-up message first; after a late tick one, not all that were missed.
  void on_tick(std::int64_t now_ns, CanPort& port);

  [[nodiscard]] std::uint64_t not_taken_count() const { return not_taken_count_; }

 private:
  std::uint8_t node_;
  std::int64_t period_ns_;
  std::int64_t due_ns_ = no_stamp_ns;
  bool is_booted_ = false;
  std::uint64_t not_taken_count_ = 0;
};

}  // namespace alces::canopen
