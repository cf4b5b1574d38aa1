#include "alces_drivers/motor/motor_config.h"

#include <algorithm>
#include <cmath>

#include "alces_drivers/canopen/cob_id.h"
#include "alces_drivers/motor/cia402.h"

namespace alces {
namespace {

using canopen::PdoConfig;
using canopen::PdoDirection;
using canopen::PdoEntry;
using Pdos = StaticVector<PdoConfig, MotorConfig::maximum_pdos>;

const PdoConfig* pdo_with(const Pdos& pdos, std::uint16_t index, std::uint8_t bits) {
  const auto* found = std::ranges::find_if(pdos, [&](const PdoConfig& pdo) {
    const auto field = canopen::field_of(pdo, {index, 0});
    return field && field->bits == bits;
  });
  return found == pdos.end() ? nullptr : found;
}

bool are_valid(const Pdos& pdos, PdoDirection direction, std::uint8_t node) {
  return std::ranges::all_of(pdos,
                             [&](const PdoConfig& pdo) { return canopen::is_valid(pdo, direction, node); });
}

/// Those to disable need no mapping.
bool are_addressable(const Pdos& pdos) {
  return std::ranges::all_of(pdos, [](const PdoConfig& pdo) {
    return pdo.number >= 1 && pdo.number <= 512 && (pdo.cob_id != 0 || pdo.number <= 4) &&
           pdo.cob_id <= 0x7FF;
  });
}

bool share_cob_id(const MotorConfig& config) {
  StaticVector<std::uint16_t, 2 * MotorConfig::maximum_pdos> used;
  const auto is_new = [&used](std::uint16_t cob_id) {
    return std::ranges::find(used, cob_id) == used.end() && used.add(cob_id);
  };
  for (const PdoConfig& pdo : config.tpdos) {
    if (!is_new(pdo.cob_id_of(PdoDirection::from_node, config.node))) return true;
  }
  for (const PdoConfig& pdo : config.rpdos) {
    if (!is_new(pdo.cob_id_of(PdoDirection::to_node, config.node))) return true;
  }
  return false;
}

bool are_times_good(const MotorConfig& config) {
  if (config.sync.period_ns < 0 || config.sync.counter_overflow == 1 || config.sync.counter_overflow > 240)
    return false;
  if (config.sync.period_ns == 0 && config.control_period_ns <= 0) return false;
  return config.own_heartbeat_period_ns >= 0 && config.own_heartbeat_timeout_ms <= 0xFFFF &&
         config.sdo.response_timeout_ns > 0 && config.spin_up_timeout_ns > 0 && config.settle_time_ns >= 0 &&
         config.deviation_time_ns >= 0 && config.stop_timeout_ns > 0 && config.stop_confirm_timeout_ns > 0 &&
         config.boot_timeout_ns > 0 && config.transition_timeout_ns > 0 && config.pdo_timeout_ns >= 0 &&
         config.healthy_after_ns >= 0;
}

/// In which a PDO comes at the latest; 0: only when something changes.
std::int64_t period_ns(const PdoConfig& pdo, const MotorConfig& config) {
  const bool is_cyclic = config.sync.period_ns > 0 && canopen::is_cyclic_on_sync(pdo.transmission_type);
  return is_cyclic ? pdo.transmission_type * config.sync.period_ns : pdo.event_timer_ms * ns_per_ms;
}

bool is_speed_good(const MotorConfig& config) {
  const std::int64_t target = std::abs(std::int64_t{config.target_velocity_units});
  const std::int64_t slowest = target - config.velocity_tolerance_units;
  return target > 0 && config.velocity_tolerance_units >= 0 && slowest > 0 &&
         config.stall_velocity_units >= 0 && config.stall_velocity_units < slowest &&
         std::isfinite(config.ramp_units_per_s) && config.ramp_units_per_s >= 0;
}

}  // namespace

const char* to_string(MotorConfigStatus status) {
  switch (status) {
    case MotorConfigStatus::ok:
      return "ok";
    case MotorConfigStatus::bad_node:
      return "the node is not 1 to 127, or it is our own, or the axis is above 7";
    case MotorConfigStatus::bad_period:
      return "a period or time-out is negative or missing, or the SYNC counter is not 0 or 2 to 240";
    case MotorConfigStatus::bad_heartbeat:
      return "the heartbeat's time-out is not longer than its period";
    case MotorConfigStatus::bad_write:
      return "an object to write is not 1 to 4 bytes long";
    case MotorConfigStatus::table_overflow:
      return "a table has more entries than there is room for";
    case MotorConfigStatus::bad_pdo:
      return "a PDO has no valid number, identifier or mapping";
    case MotorConfigStatus::same_cob_id:
      return "two PDOs share an identifier";
    case MotorConfigStatus::missing_in_tpdos:
      return "the TPDOs must map 0x6041 (16 bits), 0x6064 and 0x606C (32 bits)";
    case MotorConfigStatus::missing_in_rpdos:
      return "the RPDOs must map 0x6040 (16 bits) and 0x60FF (32 bits)";
    case MotorConfigStatus::foreign_in_rpdos:
      return "the RPDOs map an object other than 0x6040, 0x60FF and 0x6060";
    case MotorConfigStatus::pdo_never_comes:
      return "position or velocity is sent on change only: give it a SYNC transmission type, an event "
             "timer, or no time-out";
    case MotorConfigStatus::pdo_timeout_too_short:
      return "the time-out of PDOs is less than two of their periods";
    case MotorConfigStatus::bad_speed:
      return "target, tolerance and stall velocity contradict each other";
    case MotorConfigStatus::ramp_too_slow:
      return "the ramp takes longer than the time to spin up";
    case MotorConfigStatus::bad_back_off:
      return "the delays between attempts are not positive, or the first is above the last";
    case MotorConfigStatus::bad_permit:
      return "the permit's time-out, debounce time, CAN identifier, byte, mask or value cannot be";
  }
  return "unknown";
}

MotorConfigStatus validate(const MotorConfig& config) {
  using Status = MotorConfigStatus;
  if (!canopen::is_node(config.node) || !canopen::is_node(config.own_node) ||
      config.node == config.own_node || config.axis > 7) {
    return Status::bad_node;
  }
  if (!are_times_good(config)) return Status::bad_period;
  if (config.heartbeat_timeout_ns < 0 ||
      (config.heartbeat_timeout_ns > 0 &&
       config.heartbeat_timeout_ns <= config.heartbeat_period_ms * ns_per_ms)) {
    return Status::bad_heartbeat;
  }
  if (!config.checks.is_complete() || !config.writes.is_complete() || !config.watchdog_writes.is_complete() ||
      !config.tpdos.is_complete() || !config.rpdos.is_complete() || !config.tpdos_to_disable.is_complete() ||
      !config.rpdos_to_disable.is_complete()) {
    return Status::table_overflow;
  }
  const auto is_bad = [](const auto& write) { return write.size < 1 || write.size > 4; };
  if (std::ranges::any_of(config.writes, is_bad) || std::ranges::any_of(config.watchdog_writes, is_bad))
    return Status::bad_write;
  if (!are_valid(config.tpdos, PdoDirection::from_node, config.node) ||
      !are_valid(config.rpdos, PdoDirection::to_node, config.node) ||
      !are_addressable(config.tpdos_to_disable) || !are_addressable(config.rpdos_to_disable)) {
    return Status::bad_pdo;
  }
  if (share_cob_id(config)) return Status::same_cob_id;

  const PdoConfig* position = pdo_with(config.tpdos, of_axis(cia402::position_index, config.axis), 32);
  const PdoConfig* velocity = pdo_with(config.tpdos, of_axis(cia402::velocity_index, config.axis), 32);
  if (position == nullptr || velocity == nullptr ||
      pdo_with(config.tpdos, of_axis(cia402::statusword_index, config.axis), 16) == nullptr) {
    return Status::missing_in_tpdos;
  }
  if (pdo_with(config.rpdos, of_axis(cia402::controlword_index, config.axis), 16) == nullptr ||
      pdo_with(config.rpdos, of_axis(cia402::target_velocity_index, config.axis), 32) == nullptr) {
    return Status::missing_in_rpdos;
  }
  const auto is_foreign = [&config](const PdoEntry& entry) {
    const bool is_known = entry == PdoEntry{of_axis(cia402::controlword_index, config.axis), 0, 16} ||
                          entry == PdoEntry{of_axis(cia402::target_velocity_index, config.axis), 0, 32} ||
                          entry == PdoEntry{of_axis(cia402::mode_index, config.axis), 0, 8};
    return !is_known;
  };
  for (const PdoConfig& pdo : config.rpdos) {
    if (std::ranges::any_of(pdo.entries, is_foreign)) return Status::foreign_in_rpdos;
  }
  if (config.pdo_timeout_ns > 0) {
    for (const PdoConfig* pdo : {position, velocity}) {
      const std::int64_t longest_ns = period_ns(*pdo, config);
      if (longest_ns == 0) return Status::pdo_never_comes;
      if (config.pdo_timeout_ns < 2 * longest_ns) return Status::pdo_timeout_too_short;
    }
  }

  if (!is_speed_good(config)) return Status::bad_speed;
  const double spin_up_s = seconds(config.spin_up_timeout_ns);
  if (config.ramp_units_per_s > 0 &&
      std::abs(static_cast<double>(config.target_velocity_units)) / config.ramp_units_per_s > spin_up_s) {
    return Status::ramp_too_slow;
  }
  const bool is_back_off_good =
      config.back_off.first_ns > 0 && config.back_off.maximum_ns >= config.back_off.first_ns;
  if (!is_back_off_good) return Status::bad_back_off;
  if (validate(config.permit) != nullptr) return Status::bad_permit;
  return Status::ok;
}

}  // namespace alces
