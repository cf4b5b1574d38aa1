#include "alces_platform/sim/motor/can_bus.h"

#include <algorithm>
#include <cmath>

namespace alces::sim {
namespace {

// linux/can/error.h
constexpr std::uint32_t error_controller = 0x004, error_bus_off = 0x040, error_bus = 0x080,
                        error_restarted = 0x100;
constexpr std::uint32_t sync_id = 0x080;
constexpr std::uint8_t passive_both = 0x30;  // CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE

bool is_of_node(const CanFrame& frame, std::uint32_t function, const CanNode& node) {
  return !frame.is_extended && !frame.is_error && frame.id == function + node.node_id();
}

bool is_transmit_pdo(const CanFrame& frame, const CanNode& node) {
  return is_of_node(frame, 0x180, node) || is_of_node(frame, 0x280, node) || is_of_node(frame, 0x380, node) ||
         is_of_node(frame, 0x480, node);
}

/// Order of arbitration: the 11 high bits first; a standard frame beats an extended one that begins alike.
std::uint32_t priority(const CanFrame& frame) {
  return frame.is_extended ? (frame.id << 1) | 1U : frame.id << 19;
}

}  // namespace

CanBus::CanBus(const CanBusSettings& settings, std::uint64_t seed, std::int64_t start_stamp_ns,
               const FaultPlan& faults, EventQueue& events)
    : settings_(settings),
      random_(mix(seed, 110)),
      faults_(faults),
      events_(events),
      now_ns_(start_stamp_ns),
      free_ns_(start_stamp_ns) {}

std::int64_t CanBus::duration_ns(const CanFrame& frame) const {
  const double bits = (frame.is_extended ? 67 : 47) + (frame.is_remote ? 0 : 8 * frame.size);
  return static_cast<std::int64_t>(1.08 * bits * 1e9 / settings_.bit_rate);
}

void CanBus::pend(const CanFrame& frame, std::int64_t ready_ns, std::size_t sender) {
  pending_.push_back({frame, ready_ns, sender, order_++});
}

bool CanBus::send(const CanFrame& frame) {
  if (!is_up_ || host_pending_ >= settings_.host_queue_frames) {
    ++counters_.refused;
    return false;
  }
  ++host_pending_;
  ++counters_.from_host;
  std::int64_t ready_ns = now_ns_;
  if (settings_.queue_us > 0) {
    // In their order: one queue.
    ready_ns += static_cast<std::int64_t>(-settings_.queue_us * std::log(1 - random_.uniform()) * 1e3);
    ready_ns = host_ready_ns_ = std::max(host_ready_ns_, ready_ns);
  }
  pend(frame, ready_ns, from_host);
  return true;
}

void CanBus::send_from_sensor(const CanFrame& frame, std::int64_t ready_stamp_ns) {
  pend(frame, ready_stamp_ns, from_sensor);
}

void CanBus::send_emergency(std::uint16_t error_code) {
  if (nodes_.empty()) return;
  CanFrame frame;
  frame.id = 0x080U + nodes_.front()->node_id();
  frame.size = 8;
  frame.data[0] = static_cast<std::uint8_t>(error_code);
  frame.data[1] = static_cast<std::uint8_t>(error_code >> 8);
  frame.data[2] = 0x01;  // error register: generic
  pend(frame, now_ns_, 0);
}

bool CanBus::strikes(const Injection* injection) {
  return injection != nullptr && random_.chance(static_cast<double>(argument_or(*injection, 1000)) * 1e-3);
}

void CanBus::tell_host(const CanFrame& frame, std::int64_t stamp_ns, EventKind kind) {
  Event event;
  event.stamp_ns = stamp_ns;
  event.kind = kind;
  event.frame = frame;
  const double late_us = 10 - settings_.latency_us * std::log(1 - random_.uniform());
  last_due_ns_ = std::max(last_due_ns_, stamp_ns + static_cast<std::int64_t>(late_us * 1e3));
  events_.push(last_due_ns_, event);
}

void CanBus::tell_link(bool is_up, std::int64_t stamp_ns) {
  is_up_ = is_up;
  Event event;
  event.stamp_ns = stamp_ns;
  event.kind = EventKind::can_link;
  event.is_up = is_up;
  last_due_ns_ = std::max(last_due_ns_, stamp_ns);
  events_.push(last_due_ns_, event);
}

void CanBus::tell_error(std::uint32_t error_class, std::uint8_t controller, std::int64_t stamp_ns) {
  CanFrame frame;
  frame.is_error = true;
  frame.id = error_class;
  frame.size = 8;
  frame.data[1] = controller;
  ++counters_.error_frames;
  tell_host(frame, stamp_ns);
}

void CanBus::step_state(std::int64_t now_ns) {
  const bool is_off = faults_.active(Fault::bus_off, now_ns) != nullptr;
  if (is_off == is_up_) {
    if (is_off) {
      tell_error(error_bus_off, 0, now_ns);
      std::erase_if(pending_, [](const Pending& pending) { return pending.sender == from_host; });
      counters_.lost_by_fault += host_pending_;
      host_pending_ = 0;
    } else if (counters_.error_frames > 0) {
      tell_error(error_restarted, 0, now_ns);
    }
    tell_link(!is_off, now_ns);
  }
  const Injection* flood = faults_.active(Fault::error_passive_flood, now_ns);
  if (flood == nullptr || !is_up_) return;
  const double interval_ns = 1e9 / static_cast<double>(std::max<std::int64_t>(1, argument_or(*flood, 1000)));
  next_error_ns_ = std::max(next_error_ns_, static_cast<double>(now_ns_));
  for (; next_error_ns_ <= static_cast<double>(now_ns); next_error_ns_ += interval_ns) {
    const auto stamp_ns = static_cast<std::int64_t>(next_error_ns_);
    tell_error(random_.chance(0.1) ? error_controller : error_controller | error_bus, passive_both, stamp_ns);
    free_ns_ = std::max(free_ns_, stamp_ns) + static_cast<std::int64_t>(23e9 / settings_.bit_rate);
  }
}

void CanBus::step_traffic(std::int64_t now_ns) {
  const Injection* load = faults_.active(Fault::bus_load, now_ns);
  if (load == nullptr) return;
  const double share = std::clamp(static_cast<double>(argument_or(*load, 90)) * 1e-2, 0.01, 0.98);
  next_other_ns_ = std::max(next_other_ns_, static_cast<double>(now_ns_));
  while (next_other_ns_ <= static_cast<double>(now_ns)) {
    CanFrame frame;
    const int kind = random_.integer(0, 9);
    if (kind < 4) {
      frame.id =
          0x010U + static_cast<std::uint32_t>(random_.integer(0, 0x2f));  // goes before all of CANopen's
    } else if (kind < 8) {
      frame.id = 0x7a0U + static_cast<std::uint32_t>(random_.integer(0, 0x2f));  // goes after it
    } else {
      frame.id = 0x18ff0000U + static_cast<std::uint32_t>(random_.integer(0, 0xffff));
      frame.is_extended = true;
    }
    frame.size = static_cast<std::uint8_t>(random_.integer(4, 8));
    for (std::size_t i = 0; i < frame.size; ++i) frame.data[i] = static_cast<std::uint8_t>(random_.next());
    pend(frame, static_cast<std::int64_t>(next_other_ns_), from_sensor);
    next_other_ns_ += static_cast<double>(duration_ns(frame)) / share * random_.uniform(0.5, 1.5);
  }
}

void CanBus::step(std::int64_t now_ns) {
  step_state(now_ns);
  step_traffic(now_ns);
  // Before the nodes get to `now_ns`: they are to hear each frame at the time of its last bit.
  transmit(now_ns);
  for (std::size_t node = 0; node < nodes_.size(); ++node) {
    polled_.clear();
    nodes_[node]->poll(now_ns, polled_);
    for (const CanFrame& frame : polled_) pend(frame, now_ns, node);
  }
  if (held_ && faults_.active(Fault::pdo_reordered, now_ns) == nullptr) {
    tell_host(held_->frame, now_ns);
    held_.reset();
  }
  now_ns_ = now_ns;
}

void CanBus::transmit(std::int64_t now_ns) {
  while (!pending_.empty()) {
    std::int64_t first_ready_ns = INT64_MAX;
    for (const Pending& pending : pending_) first_ready_ns = std::min(first_ready_ns, pending.ready_ns);
    const std::int64_t start_ns = std::max(free_ns_, first_ready_ns);
    auto winner = pending_.end();
    for (auto pending = pending_.begin(); pending != pending_.end(); ++pending) {
      if (pending->ready_ns > start_ns) continue;
      // Of one sender's equal identifiers, the first queued.
      if (winner == pending_.end() || priority(pending->frame) < priority(winner->frame) ||
          (priority(pending->frame) == priority(winner->frame) && pending->order < winner->order))
        winner = pending;
    }
    const std::int64_t wire_ns = duration_ns(winner->frame);
    if (start_ns + wire_ns > now_ns) return;
    const Pending sent = *winner;
    pending_.erase(winner);
    free_ns_ = start_ns + wire_ns;
    ++counters_.frames;
    counters_.busy_us += static_cast<std::uint64_t>(wire_ns / 1000);
    arrive(sent, free_ns_);
  }
}

void CanBus::arrive(const Pending& sent, std::int64_t end_ns) {
  const bool is_absent = faults_.active(Fault::node_absent, end_ns) != nullptr;
  if (sent.sender < nodes_.size() && is_absent) {
    ++counters_.lost_by_fault;
    return;
  }
  for (std::size_t node = 0; node < nodes_.size(); ++node)
    if (node != sent.sender && !is_absent) nodes_[node]->on_frame(sent.frame, end_ns);
  if (sent.sender == from_host) {
    --host_pending_;
    if (settings_.echoes_sync && sent.frame.id == sync_id && !sent.frame.is_extended)
      tell_host(sent.frame, end_ns, EventKind::sync_sent);
    if (settings_.reports_sent) tell_host(sent.frame, end_ns, EventKind::can_sent);
  } else {
    arrive_at_host(sent, end_ns);
  }
}

void CanBus::arrive_at_host(const Pending& sent, std::int64_t end_ns) {
  if (!is_up_) {
    ++counters_.lost_by_fault;
    return;
  }
  if (sent.sender >= nodes_.size()) return tell_host(sent.frame, end_ns);
  const CanNode& node = *nodes_[sent.sender];
  const bool is_swallowed =
      (is_of_node(sent.frame, 0x700, node) && faults_.active(Fault::heartbeat_lost, end_ns) != nullptr) ||
      (is_of_node(sent.frame, 0x580, node) && faults_.active(Fault::sdo_silence, end_ns) != nullptr) ||
      (is_transmit_pdo(sent.frame, node) && strikes(faults_.active(Fault::pdo_lost, end_ns)));
  if (is_swallowed) {
    ++counters_.lost_by_fault;
    return;
  }
  if (!is_transmit_pdo(sent.frame, node)) return tell_host(sent.frame, end_ns);

  if (const Injection* delayed = faults_.active(Fault::pdo_delayed, end_ns)) {
    // Behind the back of tell_host's order: later frames overtake it.
    Event event;
    event.stamp_ns = end_ns + argument_or(*delayed, 15'000) * 1000;
    event.kind = EventKind::can_frame;
    event.frame = sent.frame;
    events_.push(event.stamp_ns + 50'000, event);
    return;
  }
  if (faults_.active(Fault::pdo_reordered, end_ns) != nullptr) {
    if (!held_) {
      held_ = sent;
      return;
    }
    tell_host(sent.frame, end_ns);
    tell_host(held_->frame, end_ns + 1000);
    held_.reset();
    return;
  }
  tell_host(sent.frame, end_ns);
  if (strikes(faults_.active(Fault::pdo_duplicated, end_ns)))
    tell_host(sent.frame, end_ns + duration_ns(sent.frame));
}

}  // namespace alces::sim
