// All that makes one drive differ from another: object writes, PDO mappings, speeds in the drive's own unit,
// and how patient to be. CiA 301 and CiA 402 (profile velocity); see motor.h for what is done with it.
#pragma once

#include <cstdint>

#include "alces_drivers/canopen/object.h"
#include "alces_drivers/canopen/pdo.h"
#include "alces_drivers/canopen/sdo_client.h"
#include "alces_drivers/canopen/sync.h"
#include "alces_drivers/motor/back_off.h"
#include "alces_drivers/motor/permit.h"
#include "alces_drivers/stamp.h"
#include "alces_drivers/static_vector.h"

namespace alces {

/// How a bring-up begins.
enum class MotorReset : std::uint8_t {
  none,           ///< pre-operational, and configure over what is there
  communication,  ///< NMT reset communication: 0x1000 to 0x1FFF as after power-up
  node,           ///< NMT reset node: everything as after power-up
};

struct MotorConfig {
  static constexpr std::size_t maximum_checks = 8;
  static constexpr std::size_t maximum_writes = 48;
  static constexpr std::size_t maximum_watchdog_writes = 4;
  static constexpr std::size_t maximum_pdos = 4;

  const char* name = "motor";  ///< the source in its notices; static storage

  // The bus.
  std::uint8_t node = 1;
  std::uint8_t axis = 0;     ///< of a node with several: its objects are 0x6000 + 0x800 * axis and following
  canopen::SyncConfig sync;  ///< period 0: no SYNC; frames are then sent every control_period_ns
  bool is_sync_producer =
      true;  ///< false: a canopen::Master or another node sends SYNC, with the same period
  std::int64_t control_period_ns = 20 * ns_per_ms;
  std::uint8_t own_node = 127;
  std::int64_t own_heartbeat_period_ns = 0;    ///< 0: none, or a canopen::Master sends it
  std::uint32_t own_heartbeat_timeout_ms = 0;  ///< not 0: 0x1016:1, so that the drive stops when we are gone
  bool sets_master_loss_reaction =
      true;  ///< quick stop into 0x6007, where the drive has it: see master_loss.h
  std::uint16_t heartbeat_period_ms = 100;  ///< 0x1017 of the node; 0: left as it is, and not watched
  std::int64_t heartbeat_timeout_ns = 350 * ns_per_ms;  ///< 0: not watched
  canopen::SdoTiming sdo;

  // The configuration, in this order: checks, writes, mode of operation, PDOs, heartbeats.
  MotorReset reset = MotorReset::communication;
  StaticVector<canopen::ObjectCheck, maximum_checks> checks;  ///< such as 0x1000, 0x1018, 0x6502
  StaticVector<canopen::ObjectWrite, maximum_writes>
      writes;  ///< such as 0x6083 to 0x6085, 0x605A, maker's objects
  StaticVector<canopen::ObjectWrite, maximum_watchdog_writes>
      watchdog_writes;        ///< the maker's own watchdog of its master, where it has one; after the writes
  bool writes_mode = true;    ///< 0x6060; false: the drive has no other mode
  bool verifies_mode = true;  ///< 0x6061 must show profile velocity once operation is enabled
  StaticVector<canopen::PdoConfig, maximum_pdos>
      tpdos;  ///< must hold 0x6041, 0x6064, 0x606C; one or several PDOs
  StaticVector<canopen::PdoConfig, maximum_pdos>
      rpdos;  ///< must hold 0x6040, 0x60FF; may hold 0x6060; nothing else
  StaticVector<canopen::PdoConfig, maximum_pdos> tpdos_to_disable;  ///< only their numbers and COB-IDs count
  StaticVector<canopen::PdoConfig, maximum_pdos> rpdos_to_disable;

  // The speed, in the unit of 0x60FF and 0x606C.
  std::int32_t target_velocity_units = 0;
  std::int32_t velocity_tolerance_units = 0;
  std::int32_t stall_velocity_units = 0;  ///< up to this it stands
  double ramp_units_per_s =
      0;  ///< our own ramp of the target velocity; 0: the drive's profile acceleration does it
  std::int64_t spin_up_timeout_ns = 15 * ns_per_s;
  std::int64_t settle_time_ns = 500 * ns_per_ms;        ///< within the tolerance for so long: at speed
  std::int64_t deviation_time_ns = 1 * ns_per_s;        ///< outside for so long: too slow, too fast, stalled
  std::int64_t stop_timeout_ns = 5 * ns_per_s;          ///< to stand still
  std::int64_t stop_confirm_timeout_ns = 5 * ns_per_s;  ///< beyond that, for the drive to say so by SDO

  // Patience.
  std::int64_t boot_timeout_ns = 3 * ns_per_s;  ///< for the boot-up message after a reset; then SDO must tell
  std::int64_t transition_timeout_ns =
      2 * ns_per_s;                               ///< for each transition of CiA 402, and for the first PDO
  std::int64_t pdo_timeout_ns = 250 * ns_per_ms;  ///< without a PDO with the position; 0: not watched
  std::uint32_t attempt_limit =
      5;  ///< failures in a row; the next one is final, until a person resets the motor
  BackOff back_off;
  std::int64_t healthy_after_ns = 10 * ns_per_s;  ///< at speed for so long: failures are forgotten
  PermitConfig permit;                            ///< who lets the head turn
};

/// An object of the drive profile (0x6000 to 0x67FF), as the axis has it.
[[nodiscard]] constexpr std::uint16_t of_axis(std::uint16_t index, std::uint8_t axis) {
  return static_cast<std::uint16_t>(index + 0x800 * axis);
}

enum class MotorConfigStatus : std::uint8_t {
  ok,
  bad_node,    ///< not 1 to 127, or our own; an axis above 7
  bad_period,  ///< SYNC, control or heartbeat periods; a time that is negative; a SYNC counter of 1 or above
               ///< 240
  bad_heartbeat,          ///< the time-out is not longer than the period
  bad_write,              ///< a write whose size is not 1 to 4 bytes
  table_overflow,         ///< a table was filled beyond its capacity
  bad_pdo,                ///< see canopen::is_valid()
  same_cob_id,            ///< two PDOs share an identifier
  missing_in_tpdos,       ///< statusword, position or velocity is not mapped with 16, 32 and 32 bits
  missing_in_rpdos,       ///< controlword or target velocity is not mapped with 16 and 32 bits
  foreign_in_rpdos,       ///< an object that we have no value for
  pdo_never_comes,        ///< position or velocity is watched for, but sent on change only: transmission type
                          ///< 0, 254 or 255 without event timer
  pdo_timeout_too_short,  ///< less than two of the periods in which position and velocity come
  bad_speed,  ///< target 0, tolerance negative or as large as the target, stall speed negative or within it
  ramp_too_slow,  ///< our ramp takes longer than spin_up_timeout_ns
  bad_back_off,   ///< delays not positive, or the first above the maximum
  bad_permit,     ///< see validate(PermitConfig)
};
[[nodiscard]] const char* to_string(MotorConfigStatus status);
[[nodiscard]] MotorConfigStatus validate(const MotorConfig& config);

}  // namespace alces
