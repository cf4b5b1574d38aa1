// Events in, notices and NMT out. What they lead to is in motor_bring_up.cpp and motor_recovery.cpp, what the
// drive is told in each period in motor_cycle.cpp.
#include "alces_drivers/motor/motor.h"

#include <algorithm>

#include "alces_drivers/canopen/cob_id.h"

namespace alces {

using canopen::HeartbeatEvent;
using canopen::NmtCommand;

namespace {

constexpr std::int64_t emcy_notice_interval_ns = ns_per_s;
constexpr std::int64_t velocity_age_without_timeout_ns = ns_per_s;
/// Ticks in a row from the past: fewer are stray ones.
constexpr std::uint32_t ticks_until_clock_step = 3;

}  // namespace

Motor::Motor(const MotorConfig& config, CanPort& port, NoticePort& notices, DriveFeedbackSink& sink)
    : config_(config),
      config_status_(validate(config)),
      port_(port),
      notices_(notices),
      notice_limiter_(notices, config_.name),
      sink_(sink),
      sdo_(config.node, config.sdo, port),
      configurator_(sdo_),
      stop_by_sdo_({.stall_velocity_units = config.stall_velocity_units,
                    .quick_stop_limit_ns = config.stop_timeout_ns,
                    .axis = config.axis},
                   sdo_),
      master_loss_({config.own_heartbeat_timeout_ms != 0, config.watchdog_writes.size() > 0,
                    config.sets_master_loss_reaction, config.axis},
                   sdo_),
      heartbeat_(config.node),
      own_heartbeat_(config.own_node, config.own_heartbeat_period_ns),
      sync_(config.sync),
      process_data_(config),
      speed_({config.velocity_tolerance_units, config.stall_velocity_units}),
      permit_(config.permit) {
  const auto listen_to = [this](std::uint16_t cob_id) {
    (void)cob_ids_.add(cob_id);
  };  // room for all of them
  listen_to(canopen::sdo_response_cob_id(config_.node));
  listen_to(canopen::heartbeat_cob_id(config_.node));
  listen_to(canopen::emcy_cob_id(config_.node));
  if (config_.permit.source == PermitSource::can) listen_to(config_.permit.cob_id);
  if (config_.sync.period_ns > 0 && !config_.is_sync_producer) listen_to(canopen::sync_cob_id);
  for (const canopen::PdoConfig& pdo : config_.tpdos) {
    listen_to(pdo.cob_id_of(canopen::PdoDirection::from_node, config_.node));
  }
  if (config_status_ == MotorConfigStatus::ok) build_steps();
}

void Motor::start(std::int64_t now_ns) {
  now_ns_ = std::max(now_ns_, now_ns + ahead_ns_);
  if (!has_ended()) return;
  ++counters_.starts;
  attempts_ = 0;
  due_ns_ = no_stamp_ns;
  if (config_status_ != MotorConfigStatus::ok) {
    ++counters_.failures_final;
    enter(MotorState::failed, MotorReason::bad_configuration, to_string(config_status_));
    return;
  }
  is_master_loss_told_ = false;
  permit_.forget();  // a level that is there at the start is no edge
  permits_seen_ = permit_.edges();
  begin_anew();
}

void Motor::stop(std::int64_t now_ns) {
  now_ns_ = std::max(now_ns_, now_ns + ahead_ns_);
  if (state_ != MotorState::stopping) begin_stop(StopPhase::ramp_down, MotorReason::stop_wanted);
}

void Motor::quick_stop(std::int64_t now_ns) {
  now_ns_ = std::max(now_ns_, now_ns + ahead_ns_);
  const bool is_quick_already = state_ == MotorState::stopping && stop_phase_ != StopPhase::ramp_down;
  if (!is_quick_already) begin_stop(StopPhase::quick, MotorReason::quick_stop_wanted);
}

void Motor::on_frame(const CanFrame& frame, std::int64_t received_ns) {
  const std::int64_t stamp_ns = received_ns + ahead_ns_;
  now_ns_ = std::max(now_ns_, stamp_ns);
  if (config_.permit.source == PermitSource::can) {
    permit_.on_frame(frame, stamp_ns);
    obey_permit();
  }
  if (frame.is_error) {
    ++counters_.error_frames;
  } else if (!frame.is_classical_data()) {
    ++counters_.frames_not_canopen;
  } else if (frame.id == canopen::sync_cob_id && !config_.is_sync_producer) {
    on_sync_cycle(stamp_ns);
  } else if (sdo_.on_frame(frame, now_ns_)) {
    is_node_heard_ = true;
    on_sdo();
  } else if (frame.id == canopen::heartbeat_cob_id(config_.node)) {
    const std::uint64_t heartbeats_before = heartbeat_.counters().heartbeats;
    on_heartbeat(heartbeat_.on_frame(frame, stamp_ns));
    if (heartbeat_.counters().heartbeats != heartbeats_before) on_node_state();
  } else if (frame.id == canopen::emcy_cob_id(config_.node)) {
    on_emcy(frame);
  } else if (!is_configured_) {
    const bool is_ours = std::ranges::find(cob_ids_, frame.id) != cob_ids_.end();
    ++(is_ours ? counters_.pdos_before_configuration : counters_.frames_foreign);
  } else {
    switch (process_data_.on_frame(frame, stamp_ns)) {
      case ProcessData::Outcome::foreign:
        ++counters_.frames_foreign;
        break;
      case ProcessData::Outcome::dropped:
        break;
      case ProcessData::Outcome::feedback:
        hand_on_feedback();
        [[fallthrough]];
      case ProcessData::Outcome::taken:
        on_drive(stamp_ns);
        break;
    }
  }
}

void Motor::on_sync_sent(std::int64_t stamp_ns) {
  if (config_.is_sync_producer && is_cyclic_) process_data_.on_sync_sent(stamp_ns + ahead_ns_);
}

void Motor::hand_on_feedback() {
  DriveFeedback feedback = process_data_.feedback();
  shift_stamp(feedback.stamp_ns, -ahead_ns_);
  shift_stamp(feedback.sync_stamp_ns, -ahead_ns_);
  sink_.on_drive_feedback(feedback);
}

void Motor::on_link(bool is_up, std::int64_t now_ns) {
  now_ns_ = std::max(now_ns_, now_ns + ahead_ns_);
  if (is_up == is_link_up_) return;
  is_link_up_ = is_up;
  if (is_up) {
    if (has_ended()) return;
    tell(Severity::info, "the CAN bus is up");
    if (state_ == MotorState::stopping) begin_stop_phase(StopPhase::by_sdo);
    const bool is_disabled = state_ == MotorState::held || state_ == MotorState::failed;
    if (is_disabled && config_status_ == MotorConfigStatus::ok) keep_disabled_by_sdo();
    if (state_ == MotorState::connecting) begin_anew();  // at once
    return;
  }
  ++counters_.link_downs;
  pending_order_.reset();
  switch (state_) {
    case MotorState::stopped:
    case MotorState::unconfirmed:
      break;
    case MotorState::stopping:
      begin_stop_phase(StopPhase::by_sdo);  // which waits for the bus
      break;
    case MotorState::held:
    case MotorState::failed:
      leave_cycle();
      is_configured_ = false;
      stop_by_sdo_.cancel();
      break;
    default:
      begin_anew();
      break;  // which waits for the bus
  }
}

void Motor::on_tick(std::int64_t now_ns) {
  const bool is_behind = now_ns + ahead_ns_ < now_ns_ - clock_step_ns;
  ticks_behind_ = is_behind ? ticks_behind_ + 1 : 0;
  if (ticks_behind_ == ticks_until_clock_step) {
    // The clock was set back. In here time goes on: every period and time-out stays what it was.
    ticks_behind_ = 0;
    ++counters_.clock_steps;
    // A clock that jumps by decades again and again has its end here: sums do not overflow.
    ahead_ns_ = std::min(now_ns_ - now_ns, latest_stamp_ns);
  }
  now_ns_ = std::max(now_ns_, now_ns + ahead_ns_);
  permit_.on_tick(now_ns_);
  obey_permit();
  if (!is_link_up_) {
    if (state_ == MotorState::stopping) step_stopping();  // which does not wait for ever
    return;
  }
  own_heartbeat_.on_tick(now_ns_, port_);
  send_pending_order();
  if (sdo_.is_busy() || configurator_.status() == canopen::Configurator::Status::busy) {
    sdo_.on_tick(now_ns_);
    on_sdo();
  }
  on_heartbeat(heartbeat_.on_tick(now_ns_));
  step();
  if (!is_cyclic_) return;
  if (config_.sync.period_ns == 0) {
    if (last_cycle_ns_ == no_stamp_ns || now_ns_ - last_cycle_ns_ >= config_.control_period_ns)
      on_sync_cycle(now_ns_);
  } else if (sync_.on_tick(now_ns_, port_)) {
    on_sync_cycle(now_ns_);
  }
}

void Motor::step() {
  find_out_master_loss();
  if (process_data_.state() != seen_state_) {
    if (seen_state_ == cia402::State::fault && state_ == MotorState::enabling) {
      was_fault_reset_ = true;
      enter(MotorState::enabling, MotorReason::walks_to_enabled);
    }
    seen_state_ = process_data_.state();
    seen_state_since_ns_ = now_ns_;
    reset_cycles_ = 0;
    enable_cycles_ = 0;
  }
  switch (state_) {
    case MotorState::stopped:
    case MotorState::unconfirmed:
      break;
    case MotorState::connecting:
      // A node that sent no boot-up message may be there all the same: SDO will tell.
      if (is_link_up_ && now_ns_ - state_since_ns_ >= config_.boot_timeout_ns) begin_configuring();
      break;
    case MotorState::configuring:
      break;  // on_sdo()
    case MotorState::enabling:
      step_enabling();
      break;
    case MotorState::ramping:
      step_ramping();
      break;
    case MotorState::running:
      step_running();
      break;
    case MotorState::stopping:
      step_stopping();
      break;
    case MotorState::recovering:
      step_recovering();
      break;
    case MotorState::failed:
      step_failed();
      break;
    case MotorState::held:
      step_held();
      break;
  }
}

void Motor::enter(MotorState state, MotorReason reason, const char* detail) {
  if (state != state_) state_since_ns_ = now_ns_;
  state_ = state;
  reason_ = reason;
  detail_ = detail;
  Severity severity = is_failure(reason) ? Severity::warning : Severity::info;
  if (state == MotorState::failed || state == MotorState::unconfirmed) severity = Severity::error;
  tell(severity, to_string(reason));
  if (*detail != '\0') tell(severity, detail);
}

void Motor::tell(Severity severity, const char* text, std::int64_t value, bool has_value) {
  notices_.raise({.stamp_ns = now_ns_ - ahead_ns_,
                  .severity = severity,
                  .source = config_.name,
                  .text = text,
                  .value = value,
                  .has_value = has_value});
}

void Motor::tell_hexadecimal(const char* text, std::int64_t value) {
  notices_.raise({.stamp_ns = now_ns_ - ahead_ns_,
                  .severity = Severity::warning,
                  .source = config_.name,
                  .text = text,
                  .value = value,
                  .has_value = true,
                  .is_hexadecimal = true});
}

void Motor::order(NmtCommand command) {
  ++counters_.nmt_orders;
  pending_order_ = command;  // one that has not left is overtaken by this one
  send_pending_order();
}

void Motor::send_pending_order() {
  if (!pending_order_) return;
  if (port_.send(canopen::nmt_frame({*pending_order_, config_.node}))) {
    pending_order_.reset();
  } else {
    ++counters_.nmt_not_taken;
  }
}

void Motor::on_drive(std::int64_t stamp_ns) {
  const DriveFeedback& feedback = process_data_.feedback();
  if (process_data_.velocity_stamp_ns() == stamp_ns) {
    speed_.observe(config_.target_velocity_units, feedback.velocity_units, stamp_ns);
    const bool is_still = cia402::has_no_torque(process_data_.state()) && feedback.velocity_units == 0 &&
                          process_data_.statusword_stamp_ns() >= stop_phase_since_ns_;
    if (!is_still) {
      still_cycles_ = 0;
    } else if (still_cycles_ < UINT8_MAX) {
      ++still_cycles_;
    }
  }
  const bool does_warn = (feedback.statusword & cia402::statusword_warning) != 0;
  if (does_warn && !is_warning_told_)
    notice_limiter_.raise(NoticeKind::drive_warns, Severity::warning, now_ns_ - ahead_ns_, "the drive warns",
                          feedback.statusword);
  is_warning_told_ = does_warn;
  step();
}

void Motor::on_emcy(const CanFrame& frame) {
  const std::optional<canopen::Emcy> emcy = canopen::decode_emcy(frame);
  if (!emcy) {
    ++counters_.emcys_malformed;
    return;
  }
  is_node_heard_ = true;
  if (emcy->is_reset()) {
    if (last_emcy_code_ != 0) tell(Severity::info, "the drive's error is gone", last_emcy_code_);
    last_emcy_code_ = 0;
    return;
  }
  ++counters_.emcys;
  last_emcy_code_ = emcy->code;
  const bool is_same = emcy->code == told_emcy_code_ && last_emcy_told_ns_ != no_stamp_ns &&
                       now_ns_ - last_emcy_told_ns_ < emcy_notice_interval_ns;
  if (is_same) {
    ++counters_.emcys_not_told;
    return;
  }
  told_emcy_code_ = emcy->code;
  last_emcy_told_ns_ = now_ns_;
  tell(Severity::warning, canopen::emcy_text(emcy->code), emcy->code);
}

void Motor::on_heartbeat(HeartbeatEvent event) {
  switch (event) {
    case HeartbeatEvent::boot_up:
    case HeartbeatEvent::reset_detected:
      on_boot_up();
      break;
    case HeartbeatEvent::lost:
      fail(MotorReason::heartbeat_lost, Recovery::begin_anew);
      break;
    case HeartbeatEvent::found:
      tell(Severity::info, "the drive's heartbeat is back");
      break;
    case HeartbeatEvent::none:
    case HeartbeatEvent::state_changed:
      break;
  }
}

bool Motor::are_pdos_late() const {
  const std::int64_t oldest_ns =
      std::min(process_data_.position_stamp_ns(), process_data_.velocity_stamp_ns());
  return config_.pdo_timeout_ns > 0 &&
         now_ns_ - std::max(oldest_ns, cyclic_since_ns_) >= config_.pdo_timeout_ns;
}

bool Motor::is_velocity_fresh() const {
  const std::int64_t stamp_ns = process_data_.velocity_stamp_ns();
  const std::int64_t age_ns =
      config_.pdo_timeout_ns > 0 ? config_.pdo_timeout_ns : velocity_age_without_timeout_ns;
  return stamp_ns != no_stamp_ns && now_ns_ - stamp_ns < age_ns;
}

bool Motor::is_standing() const {
  return is_velocity_fresh() && speed_.is_standing(process_data_.feedback().velocity_units);
}

bool Motor::is_turning() const {
  return is_configured_ && is_velocity_fresh() &&
         !speed_.is_standing(process_data_.feedback().velocity_units);
}

bool Motor::is_driving() const {
  return state_ == MotorState::ramping || state_ == MotorState::running;
}

Motor::Counters Motor::counters() const {
  Counters counters = counters_;
  counters.heartbeats_not_taken = own_heartbeat_.not_taken_count();
  counters.sdo = sdo_.counters();
  counters.heartbeat = heartbeat_.counters();
  counters.sync = sync_.counters();
  counters.pdo = process_data_.counters();
  counters.permit = permit_.counters();
  return counters;
}

}  // namespace alces
