#include "alces_drivers/motor/cia402.h"

namespace alces::cia402 {

const char* to_string(State state) {
  switch (state) {
    case State::unknown:
      return "its statusword is no state of CiA 402";
    case State::not_ready_to_switch_on:
      return "not ready to switch on";
    case State::switch_on_disabled:
      return "switch-on disabled";
    case State::ready_to_switch_on:
      return "ready to switch on";
    case State::switched_on:
      return "switched on";
    case State::operation_enabled:
      return "operation enabled";
    case State::quick_stop_active:
      return "quick stop active";
    case State::fault_reaction_active:
      return "fault reaction active";
    case State::fault:
      return "fault";
  }
  return "unknown";
}

State state_of(std::uint16_t statusword) {
  switch (statusword & 0x4F) {  // quick-stop bit does not matter
    case 0x00:
      return State::not_ready_to_switch_on;
    case 0x40:
      return State::switch_on_disabled;
    case 0x0F:
      return State::fault_reaction_active;
    case 0x08:
      return State::fault;
    default:
      break;
  }
  switch (statusword & 0x6F) {
    case 0x21:
      return State::ready_to_switch_on;
    case 0x23:
      return State::switched_on;
    case 0x27:
      return State::operation_enabled;
    case 0x07:
      return State::quick_stop_active;
    default:
      return State::unknown;
  }
}

std::uint16_t controlword_towards(State target, State now) {
  if (target == State::switch_on_disabled) return controlword::disable_voltage;
  switch (now) {
    case State::switch_on_disabled:
      return target == State::quick_stop_active ? controlword::disable_voltage : controlword::shutdown;
    case State::ready_to_switch_on:
      if (target == State::quick_stop_active) return controlword::disable_voltage;
      return target == State::ready_to_switch_on ? controlword::shutdown : controlword::switch_on;
    case State::switched_on:
      if (target == State::quick_stop_active) return controlword::disable_voltage;
      if (target == State::ready_to_switch_on) return controlword::shutdown;
      return target == State::switched_on ? controlword::switch_on : controlword::enable_operation;
    case State::operation_enabled:
      if (target == State::quick_stop_active) return controlword::quick_stop;
      if (target == State::ready_to_switch_on) return controlword::shutdown;
      return target == State::switched_on ? controlword::switch_on : controlword::enable_operation;
    case State::quick_stop_active:
      return target == State::quick_stop_active ? controlword::quick_stop : controlword::disable_voltage;
    case State::unknown:
    case State::not_ready_to_switch_on:
    case State::fault_reaction_active:
    case State::fault:
      break;
  }
  return controlword::disable_voltage;
}

}  // namespace alces::cia402
