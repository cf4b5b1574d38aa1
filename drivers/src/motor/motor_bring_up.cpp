// From nothing to at speed: connect, configure, enable, ramp.
#include "alces_drivers/canopen/object_text.h"
#include "alces_drivers/canopen/sdo_abort.h"
#include "alces_drivers/motor/motor.h"

namespace alces {

using canopen::ConfigurationStep;
using canopen::Configurator;
using canopen::NmtCommand;
using canopen::PdoDirection;
using canopen::SdoStatus;

namespace {

/// A controlword is obeyed at the next SYNC, shows in the PDO after that, and is believed with the one after
/// that.
constexpr std::uint8_t cycles_until_verified = 4;

}  // namespace

/// Once: the configuration does not change. maximum_steps is room for all of them.
void Motor::build_steps() {
  const auto write = [this](const canopen::ObjectWrite& object) {
    (void)steps_.add(ConfigurationStep::write(object));
  };
  for (const canopen::ObjectCheck& check : config_.checks) (void)steps_.add(ConfigurationStep::check(check));
  for (const canopen::ObjectWrite& object : config_.writes) write(object);
  for (const canopen::ObjectWrite& object : config_.watchdog_writes) write(object);
  if (config_.writes_mode)
    write({of_axis(cia402::mode_index, config_.axis), 0, 1, cia402::profile_velocity_mode});
  for (const canopen::PdoConfig& pdo : config_.tpdos_to_disable) {
    write(canopen::write_that_disables(pdo, PdoDirection::from_node, config_.node));
  }
  for (const canopen::PdoConfig& pdo : config_.rpdos_to_disable) {
    write(canopen::write_that_disables(pdo, PdoDirection::to_node, config_.node));
  }
  for (const canopen::PdoConfig& pdo : config_.tpdos) {
    for (const auto& object : canopen::writes_for(pdo, PdoDirection::from_node, config_.node)) write(object);
  }
  for (const canopen::PdoConfig& pdo : config_.rpdos) {
    for (const auto& object : canopen::writes_for(pdo, PdoDirection::to_node, config_.node)) write(object);
  }
  if (config_.own_heartbeat_timeout_ms != 0) {
    write({canopen::heartbeat_consumer_index, 1, 4,
           std::uint32_t{config_.own_node} << 16 | config_.own_heartbeat_timeout_ms});
  }
  if (config_.heartbeat_period_ms != 0)
    write({canopen::heartbeat_producer_index, 0, 2, config_.heartbeat_period_ms});
}

void Motor::begin_anew() {
  if (!permit_.is_given()) {
    hold(MotorReason::waits_for_permit);
    return;
  }
  stop_by_sdo_.cancel();
  leave_cycle();
  configurator_.cancel();
  master_loss_.pause();
  sdo_.cancel();
  is_reading_mode_ = false;
  is_reading_error_code_ = false;
  last_emcy_code_ = 0;
  is_configured_ = false;
  is_node_heard_ = false;
  has_booted_ = false;
  process_data_.reset();
  heartbeat_.forget();
  heartbeat_.watch(0, now_ns_);
  if (!is_link_up_) {
    enter(MotorState::connecting, MotorReason::bus_down);
  } else if (config_.reset == MotorReset::none) {
    begin_configuring();
  } else {
    state_ = MotorState::connecting;  // also from connecting: the wait begins now
    state_since_ns_ = now_ns_;
    enter(MotorState::connecting, MotorReason::waits_for_boot_up);
    order(config_.reset == MotorReset::node ? NmtCommand::reset_node : NmtCommand::reset_communication);
  }
}

void Motor::begin_configuring() {
  leave_cycle();
  is_reading_mode_ = false;
  is_reading_error_code_ = false;
  is_configured_ = false;
  process_data_.reset();
  heartbeat_.watch(0, now_ns_);
  enter(MotorState::configuring, MotorReason::configures);
  order(NmtCommand::enter_pre_operational);  // also when it is there already: some nodes start by themselves
  sdo_.cancel();
  configurator_.start(steps_.span(), now_ns_);
}

void Motor::on_sdo() {
  if (is_reading_error_code_ && !sdo_.is_busy()) on_error_code_read();
  if (is_reading_mode_ && !sdo_.is_busy()) on_mode_read();
  find_out_master_loss();
  if (state_ == MotorState::stopping && stop_phase_ == StopPhase::by_sdo) {
    step_stop_by_sdo();
    return;
  }
  if ((state_ == MotorState::held || state_ == MotorState::failed) && !is_cyclic_)
    stop_by_sdo_.advance(now_ns_);
  if (state_ != MotorState::configuring) return;
  configurator_.advance(now_ns_);
  switch (configurator_.status()) {
    case Configurator::Status::idle:
    case Configurator::Status::busy:
      break;
    case Configurator::Status::done:
      begin_cycle();
      break;
    case Configurator::Status::transfer_failed:
    case Configurator::Status::value_differs:
      configuration_failed();
      break;
  }
}

void Motor::configuration_failed() {
  const ConfigurationStep step = configurator_.step();
  const SdoStatus status = sdo_.status();
  MotorReason reason = MotorReason::sdo_malformed;
  const char* detail = to_string(status);
  std::int64_t found = -1;
  if (configurator_.status() == Configurator::Status::value_differs) {
    reason = MotorReason::wrong_device;
    detail = "";
    found = configurator_.found_value();
  } else if (status == SdoStatus::aborted) {
    reason = MotorReason::sdo_aborted;
    detail = canopen::sdo_abort_text(sdo_.abort_code());
    found = sdo_.abort_code();
  } else if (status == SdoStatus::not_sent) {
    reason = MotorReason::sdo_not_sent;
  } else if (status == SdoStatus::timed_out) {
    reason = is_node_heard_ ? MotorReason::sdo_timed_out : MotorReason::node_absent;
  }
  configurator_.cancel();
  tell_hexadecimal("the object that could not be set up or checked; index and subindex",
                   std::int64_t{step.object.index} << 8 | step.object.subindex);
  tell(Severity::warning, canopen::object_text(step.object.index));
  if (found >= 0)
    tell_hexadecimal(status == SdoStatus::aborted ? "the abort code" : "the value found", found);
  fail(reason, Recovery::begin_anew, detail);
}

void Motor::begin_cycle() {
  is_configured_ = true;
  is_cyclic_ = true;
  cyclic_since_ns_ = now_ns_;
  last_cycle_ns_ = no_stamp_ns;
  commanded_velocity_units_ = 0;
  process_data_.reset();
  order(NmtCommand::start);
  if (config_.is_sync_producer) sync_.start(now_ns_);
  heartbeat_.watch(config_.heartbeat_period_ms > 0 ? config_.heartbeat_timeout_ns : 0, now_ns_);
  master_loss_.begin();
  begin_enabling();
}

/// Beside the way to operation enabled, before there is torque: a handful of transfers. What others need the
/// SDO client for goes first, and a drive that does not answer is not waited for.
void Motor::find_out_master_loss() {
  const bool has_time = is_cyclic_ && is_link_up_ && !is_reading_mode_ && !is_reading_error_code_ &&
                        (state_ == MotorState::enabling || is_driving());
  if (!has_time) return;
  master_loss_.advance(now_ns_);
  if (!master_loss_.is_done() || is_master_loss_told_) return;
  is_master_loss_told_ = true;
  const MasterLossReaction reaction = master_loss_.reaction();
  tell(is_unsafe(reaction) ? Severity::warning : Severity::info, to_string(reaction));
}

void Motor::begin_enabling() {
  is_reading_mode_ = false;
  was_fault_reset_ = false;
  reset_cycles_ = 0;
  enable_cycles_ = 0;
  seen_state_ = process_data_.state();
  seen_state_since_ns_ = now_ns_;
  enter(MotorState::enabling, MotorReason::walks_to_enabled);
}

void Motor::step_enabling() {
  using cia402::State;
  const State drive = process_data_.state();
  const bool is_late = now_ns_ - seen_state_since_ns_ >= config_.transition_timeout_ns;
  if (process_data_.position_stamp_ns() != no_stamp_ns && are_pdos_late()) {
    fail(MotorReason::pdo_lost, Recovery::begin_anew);
    return;
  }
  if (drive == State::fault) {
    if (was_fault_reset_) {
      ++counters_.drive_faults;
      fail(MotorReason::drive_fault, Recovery::enable_again);
    } else if (is_late) {
      fail(MotorReason::fault_not_cleared, Recovery::enable_again);
    } else if (reason_ != MotorReason::resets_fault) {
      enter(MotorState::enabling, MotorReason::resets_fault);
    }
    return;
  }
  if (drive == State::operation_enabled) {
    // A drive that was enabled when we met it may yet obey the controlword that we sent before we knew.
    if (enable_cycles_ < cycles_until_verified) return;
    if (!config_.verifies_mode) {
      begin_ramping();
    } else if (!is_reading_mode_ && is_late) {
      fail(MotorReason::wrong_mode, Recovery::begin_anew);
    } else if (!is_reading_mode_) {
      master_loss_.pause();
      is_reading_mode_ = sdo_.upload({of_axis(cia402::mode_display_index, config_.axis), 0}, now_ns_);
    }
    return;
  }
  if (!is_late) return;
  const std::uint16_t statusword = process_data_.feedback().statusword;
  if (drive == State::unknown && statusword == 0) {  // never one since it was met
    fail(MotorReason::no_process_data, Recovery::begin_anew);
  } else if (drive == State::unknown) {
    fail(MotorReason::transition_refused, Recovery::begin_anew, cia402::to_string(drive));
  } else if ((statusword & cia402::statusword_remote) == 0) {
    fail(MotorReason::transition_refused, Recovery::enable_again,
         "its remote bit is clear: it obeys somebody else");
  } else if ((statusword & cia402::statusword_voltage_enabled) == 0) {
    fail(MotorReason::transition_refused, Recovery::enable_again, "its power stage has no voltage");
  } else {
    fail(MotorReason::transition_refused, Recovery::enable_again, cia402::to_string(drive));
  }
}

void Motor::on_mode_read() {
  is_reading_mode_ = false;
  if (state_ != MotorState::enabling) return;
  if (sdo_.status() == SdoStatus::aborted) {
    fail(MotorReason::sdo_aborted, Recovery::begin_anew, canopen::sdo_abort_text(sdo_.abort_code()));
  } else if (sdo_.status() != SdoStatus::done) {
    fail(MotorReason::sdo_timed_out, Recovery::begin_anew, to_string(sdo_.status()));
  } else if ((sdo_.value() & 0xFF) == cia402::profile_velocity_mode) {
    if (process_data_.state() == cia402::State::operation_enabled) begin_ramping();
  }
  // Another mode: the display may lag; step_enabling() reads again until the time is over.
}

void Motor::begin_ramping() {
  speed_.restart();
  enter(MotorState::ramping, MotorReason::ramps_up);
}

/// What must hold as long as it turns; otherwise that is a failure.
bool Motor::is_drive_well() {
  using cia402::State;
  const State drive = process_data_.state();
  if (drive == State::fault || drive == State::fault_reaction_active) {
    ++counters_.drive_faults;
    fail(MotorReason::drive_fault, Recovery::enable_again);
    return false;
  }
  if (drive != State::operation_enabled) {
    fail(MotorReason::operation_left, Recovery::enable_again, cia402::to_string(drive));
    return false;
  }
  if (are_pdos_late()) {
    fail(MotorReason::pdo_lost, Recovery::begin_anew);
    return false;
  }
  return true;
}

void Motor::step_ramping() {
  if (!is_drive_well()) return;
  if (speed_.verdict() == SpeedVerdict::good && speed_.lasted_ns() >= config_.settle_time_ns &&
      speed_.lasted_ns() > 0) {
    enter(MotorState::running, MotorReason::at_speed);
  } else if (now_ns_ - state_since_ns_ >= config_.spin_up_timeout_ns) {
    ++counters_.speed_deviations;
    fail(MotorReason::speed_not_reached, Recovery::enable_again);
  }
}

void Motor::step_running() {
  if (!is_drive_well()) return;
  if (now_ns_ - state_since_ns_ >= config_.healthy_after_ns) attempts_ = 0;
  if (speed_.verdict() == SpeedVerdict::good || speed_.lasted_ns() < config_.deviation_time_ns) return;
  ++counters_.speed_deviations;
  MotorReason reason = MotorReason::too_slow;
  if (speed_.verdict() == SpeedVerdict::too_fast) reason = MotorReason::too_fast;
  if (speed_.verdict() == SpeedVerdict::stalled) reason = MotorReason::stalled;
  if (speed_.verdict() == SpeedVerdict::wrong_way) reason = MotorReason::wrong_way;
  tell(Severity::warning, "its velocity in the drive's unit", process_data_.feedback().velocity_units);
  fail(reason, Recovery::enable_again);
}

}  // namespace alces
