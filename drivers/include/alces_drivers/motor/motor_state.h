// Where a motor is on its way, and why.
#pragma once

#include <cstdint>

namespace alces {

enum class MotorState : std::uint8_t {
  stopped,      ///< nothing is sent; after stop(): the drive said that it has no torque and stands
  connecting,   ///< waits for the bus, or for the node's boot-up message
  configuring,  ///< object after object, by SDO
  enabling,     ///< walks CiA 402's states to operation enabled, resetting a fault on the way
  ramping,      ///< operation enabled; not yet at speed
  running,      ///< at speed
  stopping,     ///< to zero, disabled, pre-operational
  recovering,   ///< something failed; the next attempt comes after a delay
  failed,       ///< too many failures in a row: disabled until a person resets it
  held,         ///< there is no permit: disabled
  unconfirmed,  ///< after stop(): nothing more is sent, and the drive did not say that it stands
};
[[nodiscard]] const char* to_string(MotorState state);

enum class MotorReason : std::uint8_t {
  // On the way.
  not_started,
  stop_wanted,
  quick_stop_wanted,
  waits_for_boot_up,
  configures,
  walks_to_enabled,
  resets_fault,
  ramps_up,
  at_speed,
  waits_for_permit,
  permit_gone,
  // Failures: they can be told from the others by is_failure().
  bus_down,
  bad_configuration,
  node_absent,
  node_reset,
  node_not_operational,
  heartbeat_lost,
  pdo_lost,
  no_process_data,
  sdo_aborted,
  sdo_timed_out,
  sdo_not_sent,
  sdo_malformed,
  wrong_device,
  wrong_mode,
  transition_refused,
  drive_fault,
  fault_not_cleared,
  operation_left,
  speed_not_reached,
  too_slow,
  too_fast,
  stalled,
  wrong_way,
  does_not_stop,
  stop_not_confirmed,
};
/// A sentence for people, with what to do where one can say; static storage.
[[nodiscard]] const char* to_string(MotorReason reason);
[[nodiscard]] constexpr bool is_failure(MotorReason reason) {
  return reason >= MotorReason::bus_down;
}

}  // namespace alces
