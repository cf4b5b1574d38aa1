// The motor disabled, for want of a permit or after too many failures, and who lets it turn again.
#include <algorithm>

#include "alces_drivers/motor/motor.h"

namespace alces {

using canopen::NmtCommand;

void Motor::reset(std::int64_t now_ns) {
  now_ns_ = std::max(now_ns_, now_ns + ahead_ns_);
  if (state_ != MotorState::failed || config_status_ != MotorConfigStatus::ok) {
    tell(Severity::info, "there is nothing to reset: the motor is not given up");
  } else if (permit_.is_asked_for()) {
    tell(Severity::warning, "a motor that asks for a permit is reset by a new permit, not by an order");
  } else {
    ++counters_.resets_by_person;
    tell(Severity::info, "reset by a person");
    attempts_ = 0;
    begin_anew();
  }
}

void Motor::on_resumed(std::int64_t now_ns) {
  now_ns_ = std::max(now_ns_, now_ns + ahead_ns_);
  if (!permit_.is_asked_for()) return;
  tell(Severity::info, "the machine was suspended: a new permit is needed");
  permit_.forget();
  obey_permit();
}

void Motor::on_edge(const GpioEdge& edge, std::int64_t stamp_ns) {
  if (config_.permit.source != PermitSource::gpio) return;
  now_ns_ = std::max(now_ns_, stamp_ns + ahead_ns_);
  permit_.on_edge(edge, stamp_ns + ahead_ns_);
  obey_permit();
}

void Motor::on_edges_lost(std::uint8_t line, std::int64_t stamp_ns) {
  if (config_.permit.source != PermitSource::gpio) return;
  now_ns_ = std::max(now_ns_, stamp_ns + ahead_ns_);
  permit_.on_edges_lost(line);
  obey_permit();
}

void Motor::on_permit(bool is_given, std::int64_t stamp_ns) {
  if (config_.permit.source != PermitSource::socket) return;
  now_ns_ = std::max(now_ns_, stamp_ns + ahead_ns_);
  permit_.on_message(is_given, stamp_ns + ahead_ns_);
  obey_permit();
}

/// After everything that the permit heard.
void Motor::obey_permit() {
  if (!permit_.is_asked_for()) return;
  const bool is_new = permit_.edges() != permits_seen_;
  permits_seen_ = permit_.edges();
  if (has_ended() || state_ == MotorState::stopping || config_status_ != MotorConfigStatus::ok) return;
  const bool is_disabled = state_ == MotorState::held || state_ == MotorState::failed;
  if (!permit_.is_given()) {
    if (!is_disabled) hold(MotorReason::permit_gone);
    return;
  }
  if (!is_new || !is_disabled) return;
  tell(Severity::info, "a permit is given");
  attempts_ = 0;
  const bool is_connected = is_cyclic_ && !are_pdos_late() && !heartbeat_.is_lost();
  if (state_ == MotorState::held && is_connected) {
    begin_enabling();
  } else {
    begin_anew();
  }
}

/// With PDOs the drive is stopped by them, and stays connected; otherwise by SDO.
void Motor::hold(MotorReason reason) {
  configurator_.cancel();
  master_loss_.pause();
  sdo_.cancel();
  is_reading_mode_ = false;
  is_reading_error_code_ = false;
  due_ns_ = no_stamp_ns;
  is_disabled_told_ = false;
  still_cycles_ = 0;
  stop_phase_since_ns_ = now_ns_;
  ++counters_.holds;
  enter(MotorState::held, reason);
  if (!is_cyclic_ || are_pdos_late()) keep_disabled_by_sdo();
}

/// Asks again and again, until the drive has said that it has no torque and stands; anew when the node or the
/// bus comes back.
void Motor::keep_disabled_by_sdo() {
  leave_cycle();
  is_configured_ = false;
  is_disabled_told_ = false;
  heartbeat_.watch(0, now_ns_);
  stop_by_sdo_.cancel();
  if (!is_link_up_) return;
  order(NmtCommand::enter_pre_operational);
  stop_by_sdo_.begin(now_ns_);
}

/// Of held, and of failed once PDOs have ended.
void Motor::step_held() {
  if (!is_cyclic_) {
    if (!is_link_up_) return;
    stop_by_sdo_.advance(now_ns_);
    if (stop_by_sdo_.is_confirmed()) tell_disabled();
    return;
  }
  if (is_stop_seen()) {
    tell_disabled();
  } else if (are_pdos_late()) {
    keep_disabled_by_sdo();
  } else if (!is_disabled_told_ && now_ns_ - stop_phase_since_ns_ >= config_.stop_timeout_ns) {
    tell(Severity::warning, to_string(MotorReason::does_not_stop));
    keep_disabled_by_sdo();
  }
}

void Motor::tell_disabled() {
  if (is_disabled_told_) return;
  is_disabled_told_ = true;
  tell(Severity::info, "the drive says that it has no torque and stands");
}

}  // namespace alces
