// What goes wrong and how it ends: failures, nodes that start anew, stopping.
#include "alces_drivers/canopen/emcy.h"
#include "alces_drivers/motor/motor.h"

namespace alces {

using canopen::NmtCommand;
using canopen::NmtState;

namespace {

/// Failures of a node that was not there to be spoken with: its boot-up message is news.
bool is_unreachable(MotorReason reason) {
  return reason == MotorReason::node_absent || reason == MotorReason::sdo_timed_out ||
         reason == MotorReason::sdo_not_sent || reason == MotorReason::heartbeat_lost ||
         reason == MotorReason::pdo_lost || reason == MotorReason::no_process_data;
}

}  // namespace

void Motor::fail(MotorReason reason, Recovery recovery, const char* detail) {
  if (state_ == MotorState::stopping) {
    // A drive in fault has stopped; one that is not heard cannot be told.
    finish_stop(reason);
    return;
  }
  const bool is_under_way =
      state_ != MotorState::stopped && state_ != MotorState::recovering && state_ != MotorState::failed;
  if (!is_under_way) return;

  ++counters_.failures;
  ++attempts_;
  recovery_ = recovery;
  configurator_.cancel();
  sdo_.cancel();
  is_reading_mode_ = false;
  if (*detail == '\0' && reason == MotorReason::drive_fault && last_emcy_code_ != 0) {
    detail = canopen::emcy_text(last_emcy_code_);
  }
  if (attempts_ > config_.attempt_limit) {
    attempts_ = config_.attempt_limit + 1;
    ++counters_.failures_final;
    due_ns_ = config_.failed_retry_ns > 0 ? now_ns_ + config_.failed_retry_ns : no_stamp_ns;
    enter(MotorState::failed, reason, detail);
    tell(Severity::error, "failures in a row; the motor is given up", attempts_);
  } else {
    due_ns_ = now_ns_ + config_.back_off.delay_ns(attempts_);
    enter(MotorState::recovering, reason, detail);
  }
  const bool is_fault = reason == MotorReason::drive_fault || reason == MotorReason::fault_not_cleared;
  if (is_fault) is_reading_error_code_ = sdo_.upload({cia402::error_code_index, 0}, now_ns_);
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
  sdo_.cancel();
  const bool is_reachable = is_cyclic_ && !heartbeat_.is_lost() && !are_pdos_late();
  if (recovery_ == Recovery::enable_again && is_reachable) {
    begin_enabling();
  } else {
    begin_anew();
  }
}

void Motor::step_failed() {
  if (is_cyclic_) {
    using cia402::State;
    const State drive = process_data_.state();
    const bool has_torque = drive == State::operation_enabled || drive == State::quick_stop_active ||
                            drive == State::fault_reaction_active || drive == State::unknown;
    const bool is_late = now_ns_ - state_since_ns_ >= config_.stop_timeout_ns;
    if ((!has_torque && !is_reading_error_code_) || is_late) {
      order(NmtCommand::enter_pre_operational);
      leave_cycle();
      is_configured_ = false;
    }
  }
  if (due_ns_ != no_stamp_ns && now_ns_ >= due_ns_) begin_anew();
}

void Motor::on_boot_up() {
  is_node_heard_ = true;
  switch (state_) {
    case MotorState::stopped:
      return;
    case MotorState::stopping:
      ++counters_.node_resets;
      finish_stop(MotorReason::node_reset);
      return;
    case MotorState::connecting:
    case MotorState::recovering:
      has_booted_ = true;
      begin_configuring();
      return;
    case MotorState::failed: {
      leave_cycle();
      is_configured_ = false;
      if (reason_ == MotorReason::bad_configuration) return;
      // Somebody may have switched it off and on, as one does with a drive in fault: that shortens the rest,
      // but one that starts anew again and again by itself is not to keep us busy for ever.
      const std::int64_t rested_ns = state_since_ns_ + config_.back_off.maximum_ns;
      if (!is_unreachable(reason_) && now_ns_ < rested_ns) {
        if (due_ns_ == no_stamp_ns || due_ns_ > rested_ns)
          tell(Severity::info, "the drive started anew: it is tried again soon");
        due_ns_ = rested_ns;
        return;
      }
      has_booted_ = true;
      begin_configuring();
      return;
    }
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
        fail(MotorReason::node_not_operational, Recovery::begin_anew, text(heartbeat_.state()));
      break;
    default:
      break;
  }
}

void Motor::begin_stop(StopPhase phase, MotorReason reason) {
  if (state_ == MotorState::stopped) return;
  configurator_.cancel();
  sdo_.cancel();
  is_reading_mode_ = false;
  is_reading_error_code_ = false;
  if (!is_cyclic_) {
    finish_stop(reason);
    return;
  }
  enter(MotorState::stopping, reason);
  begin_stop_phase(phase);
  step_stopping();  // before the next controlword: a drive that is not enabled is not to be
}

void Motor::begin_stop_phase(StopPhase phase) {
  stop_phase_ = phase;
  stop_phase_since_ns_ = now_ns_;
}

void Motor::step_stopping() {
  using cia402::State;
  const State drive = process_data_.state();
  const bool has_torque = drive == State::operation_enabled || drive == State::quick_stop_active ||
                          drive == State::fault_reaction_active || drive == State::unknown;
  const std::int64_t elapsed_ns = now_ns_ - stop_phase_since_ns_;
  switch (stop_phase_) {
    case StopPhase::ramp_down:
      if (!has_torque || (commanded_velocity_units_ == 0 && is_standing())) {
        begin_stop_phase(StopPhase::disable);
      } else if (elapsed_ns >= config_.stop_timeout_ns) {
        tell(Severity::warning, text(MotorReason::does_not_stop));
        begin_stop_phase(StopPhase::quick);
      }
      break;
    case StopPhase::quick:
      if (!has_torque) {
        begin_stop_phase(StopPhase::disable);
      } else if (elapsed_ns >= config_.stop_timeout_ns) {
        tell(Severity::warning, text(MotorReason::does_not_stop));
        begin_stop_phase(StopPhase::disable);
      }
      break;
    case StopPhase::disable:
      if (drive == State::switch_on_disabled || drive == State::not_ready_to_switch_on ||
          drive == State::fault) {
        finish_stop(reason_);
      } else if (elapsed_ns >= config_.transition_timeout_ns) {
        finish_stop(MotorReason::does_not_stop);
      }
      break;
  }
}

void Motor::finish_stop(MotorReason reason) {
  leave_cycle();
  configurator_.cancel();
  sdo_.cancel();
  is_configured_ = false;
  heartbeat_.watch(0, now_ns_);
  if (is_link_up_) order(NmtCommand::enter_pre_operational);
  enter(MotorState::stopped, reason);
}

void Motor::leave_cycle() {
  is_cyclic_ = false;
  sync_.stop();
}

}  // namespace alces
