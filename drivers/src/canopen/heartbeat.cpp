#include "alces_drivers/canopen/heartbeat.h"

#include <algorithm>

#include "alces_drivers/canopen/cob_id.h"

namespace alces::canopen {

void HeartbeatConsumer::watch(std::int64_t timeout_ns, std::int64_t now_ns) {
  timeout_ns_ = timeout_ns;
  watched_since_ns_ = now_ns;
  is_lost_ = false;
}

HeartbeatEvent HeartbeatConsumer::on_frame(const CanFrame& frame, std::int64_t stamp_ns) {
  if (frame.id != heartbeat_cob_id(node_) || !frame.is_classical_data()) return HeartbeatEvent::none;
  const std::optional<NmtState> state = decode_heartbeat(frame);
  if (!state) {
    ++counters_.malformed;
    return HeartbeatEvent::none;
  }
  const NmtState before = state_;
  last_stamp_ns_ = std::max(last_stamp_ns_, stamp_ns);
  if (*state == NmtState::boot_up) {
    const bool is_repeated = last_boot_up_ns_ != no_stamp_ns && stamp_ns - last_boot_up_ns_ < repetition_ns;
    last_boot_up_ns_ = stamp_ns;
    if (is_repeated) {
      ++counters_.boot_ups_repeated;
      return HeartbeatEvent::none;
    }
    ++counters_.boot_ups;
    is_lost_ = false;
    state_ = NmtState::boot_up;
    if (before != NmtState::operational) return HeartbeatEvent::boot_up;
    ++counters_.resets_detected;
    return HeartbeatEvent::reset_detected;
  }
  ++counters_.heartbeats;
  state_ = *state;
  if (is_lost_) {
    is_lost_ = false;
    return HeartbeatEvent::found;
  }
  return state_ == before ? HeartbeatEvent::none : HeartbeatEvent::state_changed;
}

HeartbeatEvent HeartbeatConsumer::on_tick(std::int64_t now_ns) {
  if (timeout_ns_ <= 0 || is_lost_) return HeartbeatEvent::none;
  if (now_ns - std::max(last_stamp_ns_, watched_since_ns_) <= timeout_ns_) return HeartbeatEvent::none;
  is_lost_ = true;
  state_ = NmtState::unknown;
  ++counters_.losses;
  return HeartbeatEvent::lost;
}

void HeartbeatProducer::on_tick(std::int64_t now_ns, CanPort& port) {
  if (period_ns_ <= 0 || (due_ns_ != no_stamp_ns && now_ns < due_ns_)) return;
  if (!port.send(heartbeat_frame(node_, is_booted_ ? NmtState::operational : NmtState::boot_up))) {
    ++not_taken_count_;  // and again on the next tick
    return;
  }
  is_booted_ = true;
  due_ns_ = now_ns + period_ns_;
}

}  // namespace alces::canopen
