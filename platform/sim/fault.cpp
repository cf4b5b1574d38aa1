#include "alces_platform/sim/fault.h"

namespace alces::sim {

const char* name(Fault fault) {
  switch (fault) {
    case Fault::node_absent:
      return "node_absent";
    case Fault::late_boot_up:
      return "late_boot_up";
    case Fault::node_reset:
      return "node_reset";
    case Fault::heartbeat_lost:
      return "heartbeat_lost";
    case Fault::emergency:
      return "emergency";
    case Fault::sdo_abort:
      return "sdo_abort";
    case Fault::sdo_silence:
      return "sdo_silence";
    case Fault::drive_fault_once:
      return "drive_fault_once";
    case Fault::drive_fault_for_ever:
      return "drive_fault_for_ever";
    case Fault::bus_off:
      return "bus_off";
    case Fault::error_passive_flood:
      return "error_passive_flood";
    case Fault::pdo_lost:
      return "pdo_lost";
    case Fault::pdo_duplicated:
      return "pdo_duplicated";
    case Fault::pdo_delayed:
      return "pdo_delayed";
    case Fault::pdo_reordered:
      return "pdo_reordered";
    case Fault::bus_load:
      return "bus_load";
    case Fault::index_missing:
      return "index_missing";
    case Fault::index_extra:
      return "index_extra";
    case Fault::index_bouncing:
      return "index_bouncing";
    case Fault::ab_swapped:
      return "ab_swapped";
    case Fault::edges_lost:
      return "edges_lost";
    case Fault::laser_garbage:
      return "laser_garbage";
    case Fault::laser_crc_errors:
      return "laser_crc_errors";
    case Fault::laser_wrong_baud:
      return "laser_wrong_baud";
    case Fault::laser_half_telegram:
      return "laser_half_telegram";
    case Fault::laser_unplugged:
      return "laser_unplugged";
    case Fault::laser_reset:
      return "laser_reset";
    case Fault::odometry_frozen:
      return "odometry_frozen";
    case Fault::odometry_silent:
      return "odometry_silent";
    case Fault::odometry_jump:
      return "odometry_jump";
    case Fault::gps_absurd:
      return "gps_absurd";
    case Fault::gps_silent:
      return "gps_silent";
  }
  return "unknown";
}

const char* to_string(Fault fault) {
  switch (fault) {
    case Fault::node_absent:
      return "node absent";
    case Fault::late_boot_up:
      return "late boot-up";
    case Fault::node_reset:
      return "node reset";
    case Fault::heartbeat_lost:
      return "heartbeat lost";
    case Fault::emergency:
      return "emergency message";
    case Fault::sdo_abort:
      return "SDO aborted";
    case Fault::sdo_silence:
      return "SDO not answered";
    case Fault::drive_fault_once:
      return "drive fault, once";
    case Fault::drive_fault_for_ever:
      return "drive fault, for ever";
    case Fault::bus_off:
      return "bus-off";
    case Fault::error_passive_flood:
      return "error-passive flood";
    case Fault::pdo_lost:
      return "PDO lost";
    case Fault::pdo_duplicated:
      return "PDO duplicated";
    case Fault::pdo_delayed:
      return "PDO delayed";
    case Fault::pdo_reordered:
      return "PDO reordered";
    case Fault::bus_load:
      return "bus load of other nodes";
    case Fault::index_missing:
      return "index pulse missing";
    case Fault::index_extra:
      return "index pulse extra";
    case Fault::index_bouncing:
      return "index pulse bouncing";
    case Fault::ab_swapped:
      return "A and B swapped";
    case Fault::edges_lost:
      return "edges lost";
    case Fault::laser_garbage:
      return "laser garbage";
    case Fault::laser_crc_errors:
      return "laser CRC errors";
    case Fault::laser_wrong_baud:
      return "laser at the wrong baud rate";
    case Fault::laser_half_telegram:
      return "laser half telegram";
    case Fault::laser_unplugged:
      return "laser unplugged";
    case Fault::laser_reset:
      return "laser reset";
    case Fault::odometry_frozen:
      return "odometry frozen";
    case Fault::odometry_silent:
      return "odometry silent";
    case Fault::odometry_jump:
      return "odometry jump";
    case Fault::gps_absurd:
      return "GPS absurd";
    case Fault::gps_silent:
      return "GPS silent";
  }
  return "unknown fault";
}

namespace {
bool lasts(const Injection& injection, std::int64_t stamp_ns) {
  return stamp_ns >= injection.at_ns && stamp_ns - injection.at_ns < injection.duration_ns;
}
}  // namespace

const Injection* FaultPlan::active(Fault fault, std::int64_t stamp_ns) const {
  for (const Entry& entry : entries_)
    if (entry.injection.fault == fault && lasts(entry.injection, stamp_ns)) return &entry.injection;
  return nullptr;
}

const Injection* FaultPlan::active(Fault fault, std::uint8_t laser, std::int64_t stamp_ns) const {
  for (const Entry& entry : entries_)
    if (entry.injection.fault == fault && laser_of(entry.injection) == laser &&
        lasts(entry.injection, stamp_ns))
      return &entry.injection;
  return nullptr;
}

std::optional<Injection> FaultPlan::take(std::int64_t stamp_ns) {
  Entry* first = nullptr;
  for (Entry& entry : entries_) {
    if (entry.is_taken || entry.injection.at_ns > stamp_ns) continue;
    if (first == nullptr || entry.injection.at_ns < first->injection.at_ns) first = &entry;
  }
  if (first == nullptr) return std::nullopt;
  first->is_taken = true;
  return first->injection;
}

}  // namespace alces::sim
