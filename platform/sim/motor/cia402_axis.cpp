#include "alces_platform/sim/motor/cia402_axis.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace alces::sim {
namespace {

constexpr std::int64_t profile_velocity_mode = 3;
constexpr std::uint16_t halt_bit = 0x0100;
constexpr std::uint16_t fault_reset_bit = 0x0080;
constexpr std::int64_t default_velocity_threshold = 1;  // 0x606F, where the device has none

}  // namespace

const char* to_string(Cia402State state) {
  switch (state) {
    case Cia402State::not_ready_to_switch_on:
      return "not ready to switch on";
    case Cia402State::switch_on_disabled:
      return "switch on disabled";
    case Cia402State::ready_to_switch_on:
      return "ready to switch on";
    case Cia402State::switched_on:
      return "switched on";
    case Cia402State::operation_enabled:
      return "operation enabled";
    case Cia402State::quick_stop_active:
      return "quick stop active";
    case Cia402State::fault_reaction_active:
      return "fault reaction active";
    case Cia402State::fault:
      return "fault";
  }
  return "unknown";
}

double Cia402Axis::speed_counts(double velocity_units) const {
  return velocity_units * config_.rpm_per_velocity_unit * config_.counts_per_turn / 60;
}

double Cia402Axis::rate_counts(std::uint16_t index) const {
  const double asked = static_cast<double>(objects_->value(index)) * config_.rpm_per_s_per_acceleration_unit;
  const double rpm_per_s = asked > 0 ? std::min(asked, config_.fastest_rpm_per_s) : config_.fastest_rpm_per_s;
  return rpm_per_s * config_.counts_per_turn / 60;
}

Cia402Axis::Braking Cia402Axis::braking(std::int64_t option_code) {
  switch (option_code) {
    case 0:
      return Braking::coast;
    case 1:
      return Braking::slow_ramp;
    case 2:
      return Braking::quick_ramp;
    default:
      return Braking::fastest;
  }
}

double Cia402Axis::rate_counts(Braking braking) const {
  switch (braking) {
    case Braking::slow_ramp:  // without 0x6084 one ramp does both
      return rate_counts(objects_->has_index(0x6084) ? 0x6084 : 0x6083);
    case Braking::quick_ramp:
      return rate_counts(0x6085);
    case Braking::fastest:
      return config_.fastest_rpm_per_s * config_.counts_per_turn / 60;
    case Braking::coast:
      break;
  }
  return config_.coasting_rpm_per_s * config_.counts_per_turn / 60;
}

Cia402Axis::Demand Cia402Axis::demand() const {
  const auto stop = [&](Braking braking) { return Demand{0, rate_counts(braking), rate_counts(braking)}; };
  const bool brakes = after_standstill_ || state_ == Cia402State::quick_stop_active ||
                      state_ == Cia402State::fault_reaction_active;
  if (brakes) return stop(braking_);
  if (state_ != Cia402State::operation_enabled) return stop(Braking::coast);
  if (objects_->value(0x6061) != profile_velocity_mode) return stop(Braking::slow_ramp);
  if ((controlword_ & halt_bit) != 0) {
    const std::int64_t option = objects_->find(0x605D, 0) != nullptr ? objects_->value(0x605D) : 1;
    return stop(braking(option));
  }
  const auto target = static_cast<double>(objects_->value(0x60FF));
  const auto fastest = static_cast<double>(objects_->value(0x607F));
  const double limited = fastest > 0 ? std::clamp(target, -fastest, fastest) : target;
  return {speed_counts(limited), rate_counts(0x6083), rate_counts(Braking::slow_ramp), limited != target};
}

void Cia402Axis::replan(std::int64_t now_ns) {
  objects_->set(0x6061, 0, objects_->value(0x6060));
  const Demand next = demand();
  if (next == demand_) return;
  demand_ = next;
  if (!is_stalled_) motion_.ramp_to(now_ns, demand_.speed, demand_.acceleration, demand_.deceleration);
}

void Cia402Axis::set_stalled(bool is_stalled, std::int64_t now_ns) {
  if (is_stalled == is_stalled_) return;
  is_stalled_ = is_stalled;
  if (is_stalled) {
    motion_.jump_to(now_ns, 0);
  } else {
    motion_.ramp_to(now_ns, demand_.speed, demand_.acceleration, demand_.deceleration);
  }
}

void Cia402Axis::enter(Cia402State state, std::int64_t now_ns) {
  state_ = state;
  after_standstill_.reset();
  replan(now_ns);
}

void Cia402Axis::brake(Braking braking, std::optional<Cia402State> after, std::int64_t now_ns) {
  braking_ = braking;
  after_standstill_ = after;
  replan(now_ns);
}

void Cia402Axis::power_off(std::int64_t now_ns) {
  controlword_ = 0;
  is_clearable_ = true;
  enter(Cia402State::not_ready_to_switch_on, now_ns);
}

void Cia402Axis::become_ready(std::int64_t now_ns) {
  if (state_ != Cia402State::not_ready_to_switch_on) return;
  if (!config_.keeps_position) zero_counts_ = std::floor(shaft_counts_at(now_ns));
  enter(Cia402State::switch_on_disabled, now_ns);
}

void Cia402Axis::quick_stop(std::int64_t now_ns) {
  const std::int64_t option = objects_->value(0x605A);
  if (option == 0) return enter(Cia402State::switch_on_disabled, now_ns);
  state_ = Cia402State::quick_stop_active;
  const bool stays = option >= 5 && option <= 8;
  brake(braking(stays ? option - 4 : option),
        stays ? std::nullopt : std::optional(Cia402State::switch_on_disabled), now_ns);
}

void Cia402Axis::disable(std::uint16_t option_index, Cia402State after, std::int64_t now_ns) {
  if (objects_->value(option_index) == 0) return enter(after, now_ns);
  brake(braking(objects_->value(option_index)), after, now_ns);
}

Cia402Axis::CommandResult Cia402Axis::command(std::uint16_t controlword, std::int64_t now_ns) {
  using enum Cia402State;
  const bool is_reset_edge = (controlword & ~controlword_ & fault_reset_bit) != 0;
  controlword_ = controlword;
  if (state_ == fault && is_reset_edge) {
    if (!is_clearable_) return CommandResult::fault_reset_refused;
    enter(switch_on_disabled, now_ns);
    return CommandResult::fault_reset;
  }
  const bool is_command = (controlword & fault_reset_bit) == 0 && state_ != fault &&
                          state_ != fault_reaction_active && state_ != not_ready_to_switch_on;
  if (!is_command) {
    replan(now_ns);  // halt
    return CommandResult::done;
  }
  const bool disable_voltage = (controlword & 0x2) == 0;
  const bool quick_stop_asked = (controlword & 0x6) == 0x2;
  const bool shutdown = (controlword & 0x7) == 0x6;
  const bool switch_on = (controlword & 0xF) == 0x7;
  const bool enable_operation = (controlword & 0xF) == 0xF;
  switch (state_) {
    case switch_on_disabled:
      if (shutdown) enter(ready_to_switch_on, now_ns);  // 2
      break;
    case ready_to_switch_on:
      if (disable_voltage || quick_stop_asked) enter(switch_on_disabled, now_ns);  // 7
      if (switch_on) enter(switched_on, now_ns);                                   // 3
      if (enable_operation) enter(operation_enabled, now_ns);                      // 3 and 4
      break;
    case switched_on:
      if (disable_voltage || quick_stop_asked) enter(switch_on_disabled, now_ns);  // 10
      if (shutdown) enter(ready_to_switch_on, now_ns);                             // 6
      if (enable_operation) enter(operation_enabled, now_ns);                      // 4
      break;
    case operation_enabled:
      if (disable_voltage) enter(switch_on_disabled, now_ns);     // 9
      if (quick_stop_asked) quick_stop(now_ns);                   // 11
      if (shutdown) disable(0x605B, ready_to_switch_on, now_ns);  // 8
      if (switch_on) disable(0x605C, switched_on, now_ns);        // 5
      if (enable_operation) enter(operation_enabled, now_ns);     // the way out of a ramp to standstill
      break;
    case quick_stop_active:
      if (disable_voltage) enter(switch_on_disabled, now_ns);  // 12
      if (enable_operation && !after_standstill_)
        enter(operation_enabled, now_ns);  // 16: options 5 to 8 only
      break;
    case not_ready_to_switch_on:
    case fault_reaction_active:
    case fault:
      break;
  }
  advance(now_ns);
  return CommandResult::done;
}

void Cia402Axis::raise_fault(std::int64_t now_ns, bool is_clearable) {
  is_clearable_ = is_clearable;
  if (state_ == Cia402State::fault || state_ == Cia402State::fault_reaction_active) return;
  const bool has_current =
      state_ == Cia402State::operation_enabled || state_ == Cia402State::quick_stop_active;
  const std::int64_t option = objects_->find(0x605E, 0) != nullptr ? objects_->value(0x605E) : 2;
  if (!has_current || option == 0) return enter(Cia402State::fault, now_ns);
  state_ = Cia402State::fault_reaction_active;
  brake(braking(option), Cia402State::fault, now_ns);
  advance(now_ns);
}

std::int64_t Cia402Axis::next_event_ns() const {
  return after_standstill_ ? motion_.end_ns() : std::numeric_limits<std::int64_t>::max();
}

void Cia402Axis::advance(std::int64_t now_ns) {
  if (after_standstill_ && motion_.end_ns() <= now_ns) enter(*after_standstill_, now_ns);
}

std::uint16_t Cia402Axis::statusword(std::int64_t now_ns) const {
  constexpr std::uint16_t voltage_enabled = 1U << 4;
  constexpr std::uint16_t remote = 1U << 9;
  constexpr std::uint16_t target_reached = 1U << 10;
  constexpr std::uint16_t internal_limit = 1U << 11;
  constexpr std::uint16_t speed_is_zero = 1U << 12;
  constexpr std::uint16_t of_state[] = {0x00, 0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08};
  unsigned word = of_state[static_cast<std::size_t>(state_)] | voltage_enabled | remote;
  if (motion_.end_ns() <= now_ns && motion_.final_speed() == demand_.speed) word |= target_reached;
  if (demand_.is_limited) word |= internal_limit;
  if (objects_->value(0x6061) == profile_velocity_mode) {
    const ObjectEntry* threshold = objects_->find(0x606F, 0);
    const std::int64_t least = threshold != nullptr ? threshold->value : default_velocity_threshold;
    if (std::abs(shaft_counts_per_s_at(now_ns)) <
        speed_counts(static_cast<double>(std::max<std::int64_t>(least, 1)))) {
      word |= speed_is_zero;
    }
  }
  return static_cast<std::uint16_t>(word);
}

void Cia402Axis::refresh(std::int64_t now_ns) {
  const double units_per_count = 1 / speed_counts(1);
  const auto counts = static_cast<std::int64_t>(std::floor(shaft_counts_at(now_ns) - zero_counts_));
  const auto position =
      static_cast<std::int32_t>(static_cast<std::uint32_t>(counts + config_.position_at_power_on));  // wraps
  const std::int64_t velocity = std::llround(shaft_counts_per_s_at(now_ns) * units_per_count);
  objects_->set(0x6041, 0, statusword(now_ns));
  objects_->set(0x6062, 0, position);
  objects_->set(0x6063, 0, position);
  objects_->set(0x6064, 0, position);
  objects_->set(0x606B, 0, is_stalled_ ? std::llround(demand_.speed * units_per_count) : velocity);
  objects_->set(0x606C, 0, velocity);
}

}  // namespace alces::sim
