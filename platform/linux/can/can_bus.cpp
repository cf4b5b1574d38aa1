#include "alces_platform/linux/can/can_bus.h"

#include "alces_platform/linux/can/can_wire.h"

namespace alces {

const char* to_string(CanBusState state) {
  switch (state) {
    case CanBusState::down:
      return "down";
    case CanBusState::bus_off:
      return "bus-off";
    case CanBusState::error_passive:
      return "error-passive";
    case CanBusState::error_warning:
      return "error-warning";
    case CanBusState::error_active:
      return "error-active";
  }
  return "unknown";
}

void CanBus::on_frame(const CanFrame& frame, std::int64_t stamp_ns) {
  Event event;
  event.stamp_ns = stamp_ns;
  event.kind = EventKind::can_frame;
  event.channel = channel_;
  event.frame = frame;
  loop_.sink().on_event(event);
  if (frame.is_error) {
    ++counters_.error_frames;
    on_error_frame(frame, stamp_ns);
  } else {
    ++counters_.frames;
    // Traffic is proof that the controller takes part again, whatever was missed meanwhile.
    if (!is_up()) enter(CanBusState::error_active, stamp_ns);
  }
}

void CanBus::on_error_frame(const CanFrame& frame, std::int64_t stamp_ns) {
  const CanErrorReport report = read_error_frame(frame);
  if (report.is_bus_error) ++counters_.bus_errors;
  if (report.has_lost_arbitration) ++counters_.lost_arbitrations;
  if (report.has_no_acknowledge) {
    ++counters_.missing_acknowledges;
    if (acknowledge_notice_.may(stamp_ns)) {
      loop_.raise(
          stamp_ns, Severity::warning, name_,
          "nobody acknowledges our frames: is a node switched on, at this bit rate, with both terminators?");
    }
  }
  if (report.is_transceiver_fault) {
    ++counters_.transceiver_faults;
    if (transceiver_notice_.may(stamp_ns)) {
      loop_.raise(stamp_ns, Severity::error, name_, "the transceiver sees a wire that is broken or shorted",
                  frame.data[4]);
    }
  }
  if (report.has_lost_received) ++counters_.controller_receive_overflows;
  if (report.has_lost_sent) ++counters_.controller_transmit_overflows;
  if ((report.has_lost_received || report.has_lost_sent) && overflow_notice_.may(stamp_ns)) {
    loop_.raise(stamp_ns, Severity::warning, name_,
                report.has_lost_received
                    ? "the controller lost frames that it received: the machine is too slow to fetch them"
                    : "the controller lost frames that it was to send");
  }

  if (report.is_restarted) ++counters_.restarts;
  if (report.is_bus_off) {
    enter(CanBusState::bus_off, stamp_ns);
  } else if (report.is_error_passive) {
    enter(CanBusState::error_passive, stamp_ns);
  } else if (report.is_error_warning) {
    enter(CanBusState::error_warning, stamp_ns);
  } else if (report.is_error_active || report.is_restarted) {
    enter(CanBusState::error_active, stamp_ns);
  }
}

void CanBus::on_interface(bool is_interface_up, bool is_running, std::int64_t now_ns) {
  if (!is_interface_up) {
    enter(CanBusState::down, now_ns);
  } else if (!is_running) {
    enter(CanBusState::bus_off, now_ns);
  } else if (state_ == CanBusState::down ||
             (state_ == CanBusState::bus_off && now_ns - bus_off_stamp_ns_ > flags_lag_ns)) {
    enter(CanBusState::error_active, now_ns);
  }
}

void CanBus::enter(CanBusState state, std::int64_t stamp_ns) {
  if (state == state_) return;
  const bool was_up = is_up();
  const CanBusState before = state_;
  state_ = state;
  if (is_up() != was_up) {
    Event event;
    event.stamp_ns = stamp_ns;
    event.kind = EventKind::can_link;
    event.channel = channel_;
    event.is_up = is_up();
    loop_.sink().on_event(event);
  }
  switch (state) {
    case CanBusState::down:
      ++counters_.interface_downs;
      loop_.raise(stamp_ns, Severity::error, name_,
                  "the interface is down or gone; waiting for it: ip link set ... up type can bitrate ...");
      return;
    case CanBusState::bus_off:
      ++counters_.bus_offs;
      bus_off_stamp_ns_ = stamp_ns;
      if (bus_off_notice_.may(stamp_ns)) {
        loop_.raise(stamp_ns, Severity::error, name_,
                    "bus-off: wrong bit rate, no terminator or a short; comes back by itself only with "
                    "restart-ms set");
      }
      return;
    case CanBusState::error_passive:
      ++counters_.error_passives;
      if (state_notice_.may(stamp_ns)) {
        loop_.raise(stamp_ns, Severity::warning, name_,
                    "error-passive: look at cable, terminators and bit rate");
      }
      return;
    case CanBusState::error_warning:
      ++counters_.error_warnings;
      return;
    case CanBusState::error_active:
      if (before == CanBusState::down) {
        loop_.raise(stamp_ns, Severity::info, name_, "the bus is up");
      } else if (before == CanBusState::bus_off) {
        loop_.raise(stamp_ns, Severity::info, name_, "back on the bus after bus-off");
      }
      return;
  }
}

}  // namespace alces
