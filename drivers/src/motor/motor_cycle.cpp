// What the drive is told in each period: controlword and target velocity.
#include <algorithm>
#include <cmath>

#include "alces_drivers/motor/motor.h"

namespace alces {
namespace {

/// Beats of controlword 0 before the rising edge of a fault reset: one of them may be lost.
constexpr std::uint8_t cycles_before_reset = 3;
constexpr std::uint16_t beats_until_echo_is_missed = 200;

}  // namespace

void Motor::on_sync_cycle(std::int64_t now_ns) {
  if (config_.sync.period_ns > 0) process_data_.on_sync(now_ns);
  if (!is_cyclic_ || pending_order_) return;
  watch_echoes();
  ramp(now_ns);
  last_cycle_ns_ = now_ns;
  const std::uint16_t controlword = next_controlword();
  const auto velocity_units = static_cast<std::int32_t>(std::lround(commanded_velocity_units_));
  for (std::size_t number = 0; number < process_data_.rpdo_count(); ++number) {
    const bool is_taken = port_.send(process_data_.rpdo(number, controlword, velocity_units));
    ++(is_taken ? counters_.rpdos_sent : counters_.rpdos_not_taken);
  }
}

void Motor::watch_echoes() {
  const bool are_wanted = config_.sync.period_ns > 0 && config_.is_sync_producer && !is_echo_told_;
  if (!are_wanted || ++beats_without_echo_ < beats_until_echo_is_missed) return;
  is_echo_told_ = true;
  if (!process_data_.has_echoes())
    tell(Severity::info, "the interface does not echo SYNC: its time is when it was queued");
}

void Motor::ramp(std::int64_t now_ns) {
  const double target_units = is_driving() ? config_.target_velocity_units : 0.0;
  const bool may_ramp = is_driving() || state_ == MotorState::stopping;
  if (config_.ramp_units_per_s == 0 || !may_ramp || last_cycle_ns_ == no_stamp_ns) {
    commanded_velocity_units_ = target_units;
    return;
  }
  const double step_units =
      config_.ramp_units_per_s * seconds(std::max<std::int64_t>(now_ns - last_cycle_ns_, 0));
  commanded_velocity_units_ += std::clamp(target_units - commanded_velocity_units_, -step_units, step_units);
}

std::uint16_t Motor::next_controlword() {
  using cia402::State;
  namespace controlword = cia402::controlword;
  const State drive = process_data_.state();
  switch (state_) {
    case MotorState::enabling:
      if (drive == State::fault) {
        if (reset_cycles_ < cycles_before_reset) {
          ++reset_cycles_;
          return controlword::disable_voltage;
        }
        if (reset_cycles_ == cycles_before_reset) {
          ++reset_cycles_;
          ++counters_.fault_resets;
        }
        return controlword::fault_reset;
      }
      if (drive == State::operation_enabled && enable_cycles_ < UINT8_MAX) ++enable_cycles_;
      return cia402::controlword_towards(State::operation_enabled, drive);
    case MotorState::ramping:
    case MotorState::running:
      return controlword::enable_operation;
    case MotorState::stopping:
      if (stop_phase_ == StopPhase::ramp_down) return controlword::enable_operation;
      if (stop_phase_ == StopPhase::quick) return quick_stop_controlword();
      return drive == State::operation_enabled || drive == State::switched_on ? controlword::shutdown
                                                                              : controlword::disable_voltage;
    default:
      return quick_stop_controlword();
  }
}

std::uint16_t Motor::quick_stop_controlword() const {
  namespace controlword = cia402::controlword;
  switch (process_data_.state()) {
    case cia402::State::unknown:  // from every state it leads to one without torque
    case cia402::State::operation_enabled:
      return controlword::quick_stop;
    // Drives with quick-stop option 5 to 8 stay there.
    case cia402::State::quick_stop_active:
      return is_standing() ? controlword::disable_voltage : controlword::quick_stop;
    default:
      return controlword::disable_voltage;
  }
}

}  // namespace alces
