#include "alces_platform/sim/motor/simulated_cia402_drive.h"

namespace alces::sim {
namespace {

/// The manufacturer's part of an EMCY, as recorded from a TMCM-1636.
constexpr std::array<std::uint8_t, 5> tmcm1636_emcy_bytes = {0x00, 0xFF, 0x00, 0x00, 0x00};
constexpr std::uint16_t life_guard_error = 0x8130;

/// 0x1001: generic, and the bit of the code's class.
std::uint8_t error_register_of(std::uint16_t code) {
  switch (code >> 12) {
    case 0x2:
      return 0x03;  // current
    case 0x3:
      return 0x05;  // voltage
    case 0x4:
      return 0x09;  // temperature
    case 0x8:
      return (code & 0xFF00) <= 0x8200 ? 0x11 : 0x21;  // communication, device profile
    case 0xF:
      return 0x81;  // manufacturer
    default:
      return 0x01;
  }
}

SimulatedCia402Drive::Config adapted(SimulatedCia402Drive::Config config) {
  if (config.model == SimulatedCia402Drive::Model::tmcm1636) config.slave.sends_acyclic_pdos = false;
  return config;
}

ObjectDictionary objects_of(const SimulatedCia402Drive::Config& config) {
  switch (config.model) {
    case SimulatedCia402Drive::Model::tmcm1636:
      return tmcm1636_objects(config.slave.node);
    case SimulatedCia402Drive::Model::epos4:
      return epos4_objects(config.slave.node);
    case SimulatedCia402Drive::Model::ipos:
      break;
  }
  return ipos_objects(config.slave.node);
}

}  // namespace

SimulatedCia402Drive::SimulatedCia402Drive(const Config& config)
    : config_(adapted(config)),
      objects_(objects_of(config)),
      axis_(config_.axis, objects_),
      slave_(config_.slave, objects_, *this) {}

double SimulatedCia402Drive::head_turns_at(std::int64_t at_ns) const {
  return axis_.shaft_counts_at(at_ns) / (config_.axis.counts_per_turn * config_.motor_turns_per_head_turn);
}

double SimulatedCia402Drive::head_turns_per_s_at(std::int64_t at_ns) const {
  return axis_.shaft_counts_per_s_at(at_ns) /
         (config_.axis.counts_per_turn * config_.motor_turns_per_head_turn);
}

SdoAbort SimulatedCia402Drive::check_write(std::uint16_t index, std::uint8_t /*sub*/, std::int64_t value) {
  if (index != 0x6060 || value == 0) return SdoAbort::none;
  const std::int64_t supported = objects_.value(0x6502);
  const bool is_supported = value >= 1 && value <= 32 && (supported >> (value - 1) & 1) != 0;
  return is_supported ? SdoAbort::none : SdoAbort::invalid_value;
}

void SimulatedCia402Drive::on_written(std::uint16_t index, std::uint8_t /*sub*/, std::int64_t value,
                                      std::int64_t now_ns) {
  if (index != 0x6040) {
    if (index >= 0x6000) axis_.replan(now_ns);
    return;
  }
  switch (axis_.command(static_cast<std::uint16_t>(value), now_ns)) {
    case Cia402Axis::CommandResult::done:
      return;
    case Cia402Axis::CommandResult::fault_reset:
      fault_code_ = 0;
      objects_.set(0x603F, 0, 0);
      return slave_.send_emergency(0, 0, {});
    case Cia402Axis::CommandResult::fault_reset_refused:
      return report_fault();
  }
}

void SimulatedCia402Drive::on_reset(std::int64_t now_ns) {
  fault_code_ = 0;
  axis_.power_off(now_ns);
}

void SimulatedCia402Drive::on_booted(std::int64_t now_ns) {
  axis_.become_ready(now_ns);
  axis_.replan(now_ns);
}

void SimulatedCia402Drive::on_heartbeat_lost(std::int64_t now_ns) {
  constexpr std::int64_t fault_signal = 1;
  constexpr std::int64_t disable_voltage = 2;
  constexpr std::int64_t quick_stop = 3;
  switch (objects_.value(0x6007)) {  // abort connection option code; 0 where the device has none
    case fault_signal:
      return raise_fault(life_guard_error, now_ns);
    case disable_voltage:
      static_cast<void>(axis_.command(0x0000, now_ns));
      return;
    case quick_stop:
      static_cast<void>(axis_.command(0x0002, now_ns));
      return;
    default:
      return;
  }
}

void SimulatedCia402Drive::report_fault() {
  const bool is_tmcm = config_.model == Model::tmcm1636;
  objects_.set(0x603F, 0, fault_code_);
  slave_.send_emergency(fault_code_, error_register_of(fault_code_),
                        is_tmcm ? tmcm1636_emcy_bytes : std::array<std::uint8_t, 5>{});
}

void SimulatedCia402Drive::raise_fault(std::uint16_t code, std::int64_t now_ns, Clearing clearing) {
  slave_.advance(now_ns);
  if (!slave_.is_powered() || axis_.state() == Cia402State::not_ready_to_switch_on) return;
  fault_code_ = code;
  axis_.raise_fault(now_ns, clearing == Clearing::by_reset);
  report_fault();
}

void SimulatedCia402Drive::set_stalled(bool is_stalled, std::int64_t now_ns) {
  slave_.advance(now_ns);
  axis_.set_stalled(is_stalled, now_ns);
}

void SimulatedCia402Drive::send_emergency(std::uint16_t code, std::int64_t now_ns) {
  slave_.advance(now_ns);
  slave_.send_emergency(code, error_register_of(code), {});
}

}  // namespace alces::sim
