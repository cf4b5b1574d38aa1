// What goes wrong and how it ends: failures, nodes that start anew, stopping.
#include "alces_drivers/canopen/emcy.h"
#include "alces_drivers/motor/motor.h"

namespace alces {

using canopen::NmtCommand;
using canopen::NmtState;

namespace {

/// PDOs in a row that must say "no torque, speed 0".
constexpr std::uint8_t cycles_until_stopped = 3;

}  // namespace

void Motor::fail(MotorReason reason, Recovery recovery, const char* detail) {
  if (state_ == MotorState::stopping) {
    begin_stop_phase(StopPhase::by_sdo);  // PDOs do not bring it to an end any more
    return;
  }
  if (state_ == MotorState::held) {
    keep_disabled_by_sdo();
    return;
  }
  const bool is_under_way = !has_ended() && state_ != MotorState::recovering && state_ != MotorState::failed;
  if (!is_under_way) return;

  ++counters_.failures;
  ++attempts_;
  recovery_ = recovery;
  configurator_.cancel();
  master_loss_.pause();
  sdo_.cancel();
  is_reading_mode_ = false;
  if (*detail == '\0' && reason == MotorReason::drive_fault && last_emcy_code_ != 0) {
    detail = canopen::emcy_text(last_emcy_code_);
  }
  if (attempts_ > config_.attempt_limit) {
    attempts_ = config_.attempt_limit + 1;
    ++counters_.failures_final;
    due_ns_ = no_stamp_ns;  // a person has to look
    is_disabled_told_ = false;
    enter(MotorState::failed, reason, detail);
    tell(Severity::error,
         permit_.is_asked_for()
             ? "failures in a row; the motor is given up until a new permit is given"
             : "failures in a row; the motor is given up until a person resets it: alcesd --reset-motor",
         attempts_);
    if (!is_cyclic_) keep_disabled_by_sdo();
  } else {
    due_ns_ = now_ns_ + config_.back_off.delay_ns(attempts_);
    enter(MotorState::recovering, reason, detail);
  }
  const bool is_fault = reason == MotorReason::drive_fault || reason == MotorReason::fault_not_cleared;
  if (is_fault)
    is_reading_error_code_ = sdo_.upload({of_axis(cia402::error_code_index, config_.axis), 0}, now_ns_);
}

void Motor::on_error_code_read() {
  is_reading_error_code_ = false;
  if (sdo_.status() != canopen::SdoStatus::done) return;
  const auto code = static_cast<std::uint16_t>(sdo_.value());
  const bool is_still_told = state_ == MotorState::recovering || state_ == MotorState::failed;
  if (code == 0 || !is_still_told) return;
  detail_ = canopen::emcy_text(code);
  tell(Severity::warning, detail_, code);
}

void Motor::step_recovering() {
  if (now_ns_ < due_ns_) return;
  is_reading_error_code_ = false;
  master_loss_.pause();
  sdo_.cancel();
  const bool is_reachable = is_cyclic_ && !heartbeat_.is_lost() && !are_pdos_late();
  if (recovery_ == Recovery::enable_again && is_reachable) {
    begin_enabling();
  } else {
    begin_anew();
  }
}

void Motor::step_failed() {
  if (!is_cyclic_) {
    if (!is_reading_error_code_ && config_status_ == MotorConfigStatus::ok) step_held();
    return;
  }
  const bool is_late = now_ns_ - state_since_ns_ >= config_.stop_timeout_ns;
  if (is_late || are_pdos_late()) {
    is_reading_error_code_ = false;
    keep_disabled_by_sdo();
  } else if (cia402::has_no_torque(process_data_.state()) && !is_reading_error_code_) {
    keep_disabled_by_sdo();  // asked once more, and the node is left pre-operational
  }
}

void Motor::on_boot_up() {
  is_node_heard_ = true;
  switch (state_) {
    case MotorState::stopped:
    case MotorState::unconfirmed:
      return;
    case MotorState::stopping:  // a drive that has just started: does the shaft stand?
      ++counters_.node_resets;
      begin_stop_phase(StopPhase::by_sdo);
      return;
    case MotorState::connecting:
    case MotorState::recovering:
      has_booted_ = true;
      begin_configuring();
      return;
    case MotorState::held:
    case MotorState::failed:  // whoever switched it off and on has not said that the head may turn
      leave_cycle();
      is_configured_ = false;
      if (config_status_ != MotorConfigStatus::ok) return;
      ++counters_.node_resets;
      if (state_ == MotorState::failed)
        tell(Severity::info, "the drive started anew; the motor stays given up");
      keep_disabled_by_sdo();
      return;
    case MotorState::configuring:
      if (!has_booted_) {  // it came late; we had begun without it
        has_booted_ = true;
        begin_configuring();
        return;
      }
      break;
    case MotorState::enabling:
    case MotorState::ramping:
    case MotorState::running:
      break;
  }
  ++counters_.node_resets;
  leave_cycle();
  is_configured_ = false;
  fail(MotorReason::node_reset, Recovery::begin_anew);
  if (state_ == MotorState::recovering) begin_configuring();  // it is there and waits: no delay
}

/// After each heartbeat that is no boot-up message.
void Motor::on_node_state() {
  is_node_heard_ = true;
  const bool is_operational = heartbeat_.state() == NmtState::operational;
  switch (state_) {
    case MotorState::connecting:
      if (!is_operational && is_link_up_) begin_configuring();  // its boot-up message was lost
      break;
    case MotorState::enabling:
      if (!is_operational) order(NmtCommand::start);  // the first may have been lost
      break;
    case MotorState::ramping:
    case MotorState::running:
      if (!is_operational)
        fail(MotorReason::node_not_operational, Recovery::begin_anew, to_string(heartbeat_.state()));
      break;
    default:
      break;
  }
}

void Motor::begin_stop(StopPhase phase, MotorReason reason) {
  if (has_ended()) return;
  configurator_.cancel();
  master_loss_.pause();
  sdo_.cancel();
  is_reading_mode_ = false;
  is_reading_error_code_ = false;
  if (phase == StopPhase::ramp_down && !is_driving()) phase = StopPhase::quick;  // nothing to ramp down from
  enter(MotorState::stopping, reason);
  if (config_status_ != MotorConfigStatus::ok) {
    finish_stop(false);  // whom to ask is not known
    return;
  }
  stop_phase_ = phase;
  begin_stop_phase(is_cyclic_ && !are_pdos_late() ? phase : StopPhase::by_sdo);
  step_stopping();  // before the next controlword: a drive that is not enabled is not to be
}

void Motor::begin_stop_phase(StopPhase phase) {
  const bool was_by_sdo = stop_phase_ == StopPhase::by_sdo;
  stop_phase_ = phase;
  still_cycles_ = 0;
  if (phase != StopPhase::by_sdo) {
    stop_phase_since_ns_ = now_ns_;
    return;
  }
  // The node is to hear SDOs, and nobody else's PDOs.
  leave_cycle();
  is_configured_ = false;
  heartbeat_.watch(0, now_ns_);
  if (is_link_up_) order(NmtCommand::enter_pre_operational);
  stop_by_sdo_.begin(now_ns_);
  if (was_by_sdo) return;  // begun anew, because the bus or the node was; the time is not
  stop_phase_since_ns_ = now_ns_;
  ++counters_.stops_by_sdo;
}

/// PDOs say so, more than one in a row: one alone may be an old one.
bool Motor::is_stop_seen() const {
  return still_cycles_ >= cycles_until_stopped && cia402::has_no_torque(process_data_.state());
}

void Motor::step_stopping() {
  using cia402::State;
  if (stop_phase_ == StopPhase::by_sdo) {
    step_stop_by_sdo();
    return;
  }
  if (are_pdos_late()) {
    begin_stop_phase(StopPhase::by_sdo);
    return;
  }
  const State drive = process_data_.state();
  const bool has_torque = drive == State::operation_enabled || drive == State::quick_stop_active ||
                          drive == State::fault_reaction_active || drive == State::unknown;
  const std::int64_t elapsed_ns = now_ns_ - stop_phase_since_ns_;
  switch (stop_phase_) {
    case StopPhase::ramp_down:
      if (!has_torque || (commanded_velocity_units_ == 0 && is_standing())) {
        begin_stop_phase(StopPhase::disable);
      } else if (elapsed_ns >= config_.stop_timeout_ns) {
        tell(Severity::warning, to_string(MotorReason::does_not_stop));
        begin_stop_phase(StopPhase::quick);
      }
      break;
    case StopPhase::quick:
      if (!has_torque) {
        begin_stop_phase(StopPhase::disable);
      } else if (elapsed_ns >= config_.stop_timeout_ns) {
        tell(Severity::warning, to_string(MotorReason::does_not_stop));
        begin_stop_phase(StopPhase::disable);
      }
      break;
    case StopPhase::disable:
      if (is_stop_seen()) {
        finish_stop(true);
      } else if (elapsed_ns >= config_.transition_timeout_ns) {
        begin_stop_phase(StopPhase::by_sdo);
      }
      break;
    case StopPhase::by_sdo:
      break;
  }
}

void Motor::step_stop_by_sdo() {
  if (is_link_up_) stop_by_sdo_.advance(now_ns_);
  if (stop_by_sdo_.is_confirmed()) {
    finish_stop(true);
  } else if (now_ns_ - stop_phase_since_ns_ >= config_.stop_timeout_ns + config_.stop_confirm_timeout_ns) {
    finish_stop(false);
  }
}

void Motor::finish_stop(bool is_confirmed) {
  leave_cycle();
  configurator_.cancel();
  stop_by_sdo_.cancel();
  sdo_.cancel();
  is_configured_ = false;
  heartbeat_.watch(0, now_ns_);
  if (is_confirmed) {
    order(NmtCommand::enter_pre_operational);
    enter(MotorState::stopped, reason_);
    return;
  }
  ++counters_.stops_unconfirmed;
  if (is_link_up_ && config_status_ == MotorConfigStatus::ok) order(NmtCommand::enter_pre_operational);
  const bool has_responded = stop_by_sdo_.state() != cia402::State::unknown;
  const char* said = "it does not answer";
  if (!is_link_up_) said = "the CAN bus is down";
  if (has_responded) said = cia402::to_string(stop_by_sdo_.state());
  enter(MotorState::unconfirmed, MotorReason::stop_not_confirmed, said);
  if (has_responded && stop_by_sdo_.has_velocity())
    tell(Severity::error, "its velocity in the drive's unit", stop_by_sdo_.velocity_units());
}

void Motor::leave_cycle() {
  is_cyclic_ = false;
  sync_.stop();
}

}  // namespace alces
