#include "alces_drivers/motor/motor_state.h"

namespace alces {

const char* to_string(MotorState state) {
  switch (state) {
    case MotorState::stopped:
      return "stopped";
    case MotorState::connecting:
      return "connecting";
    case MotorState::configuring:
      return "configuring";
    case MotorState::enabling:
      return "enabling";
    case MotorState::ramping:
      return "ramping";
    case MotorState::running:
      return "running";
    case MotorState::stopping:
      return "stopping";
    case MotorState::recovering:
      return "recovering";
    case MotorState::failed:
      return "failed";
    case MotorState::held:
      return "held";
    case MotorState::unconfirmed:
      return "not confirmed to stand";
  }
  return "unknown";
}

const char* to_string(MotorReason reason) {
  switch (reason) {
    case MotorReason::not_started:
      return "not started";
    case MotorReason::stop_wanted:
      return "a stop was asked for";
    case MotorReason::quick_stop_wanted:
      return "a quick stop was asked for";
    case MotorReason::waits_for_boot_up:
      return "waits for the drive's boot-up message";
    case MotorReason::configures:
      return "writes the drive's configuration";
    case MotorReason::walks_to_enabled:
      return "switches the drive on";
    case MotorReason::resets_fault:
      return "resets the drive's fault";
    case MotorReason::ramps_up:
      return "ramps to speed";
    case MotorReason::at_speed:
      return "at speed";
    case MotorReason::waits_for_permit:
      return "waits for a permit: it has to be off, and then be given";
    case MotorReason::permit_gone:
      return "the permit is gone: the motor is stopped";
    case MotorReason::bus_down:
      return "the CAN bus is down";
    case MotorReason::bad_configuration:
      return "the motor's configuration is not valid";
    case MotorReason::node_absent:
      return "the drive does not answer: check its supply, wiring, bit rate and node number";
    case MotorReason::node_reset:
      return "the drive started anew by itself: check its supply";
    case MotorReason::node_not_operational:
      return "the drive left the operational state by itself";
    case MotorReason::heartbeat_lost:
      return "the drive's heartbeat is lost";
    case MotorReason::pdo_lost:
      return "the drive's position no longer comes";
    case MotorReason::no_process_data:
      return "the drive sends no statusword: check its TPDO configuration";
    case MotorReason::sdo_aborted:
      return "the drive refused an object";
    case MotorReason::sdo_timed_out:
      return "the drive did not answer about an object";
    case MotorReason::sdo_not_sent:
      return "the bus takes no frames";
    case MotorReason::sdo_malformed:
      return "the drive's answer about an object is not usable";
    case MotorReason::wrong_device:
      return "an object has another value than the configuration asks for: another drive?";
    case MotorReason::wrong_mode:
      return "the drive does not take profile velocity mode";
    case MotorReason::transition_refused:
      return "the drive does not follow the controlword: check its supply and enable input";
    case MotorReason::drive_fault:
      return "the drive reports a fault";
    case MotorReason::fault_not_cleared:
      return "the drive's fault cannot be reset";
    case MotorReason::operation_left:
      return "the drive switched off by itself";
    case MotorReason::speed_not_reached:
      return "the motor does not come to speed";
    case MotorReason::too_slow:
      return "the motor turns too slowly";
    case MotorReason::too_fast:
      return "the motor turns too fast";
    case MotorReason::stalled:
      return "the motor stands although it should turn";
    case MotorReason::wrong_way:
      return "the motor turns the wrong way";
    case MotorReason::does_not_stop:
      return "the motor did not come to rest in time";
    case MotorReason::stop_not_confirmed:
      return "the drive did not confirm that the motor stands without torque: it may turn; keep away, and "
             "cut "
             "its supply";
  }
  return "unknown";
}

}  // namespace alces
