#include "alces_drivers/motor/stop_by_sdo.h"

#include "alces_drivers/motor/motor_config.h"

namespace alces {

using canopen::SdoStatus;

void StopBySdo::begin(std::int64_t now_ns) {
  sdo_.cancel();
  is_active_ = true;
  is_begun_ = false;
  step_ = Step::command;
  quick_stop_since_ns_ = no_stamp_ns;
  due_ns_ = now_ns;
  state_ = cia402::State::unknown;
  is_statusword_fresh_ = false;
  has_velocity_ = false;
  velocity_units_ = 0;
  confirmations_ = 0;
}

void StopBySdo::cancel() {
  if (is_active_ && is_begun_) sdo_.cancel();
  is_active_ = false;
  is_begun_ = false;
}

void StopBySdo::advance(std::int64_t now_ns) {
  if (!is_active_ || is_confirmed()) return;
  if (is_begun_) {
    if (sdo_.is_busy()) return;
    is_begun_ = false;
    take_response(now_ns);
    if (is_confirmed()) {
      is_active_ = false;
      return;
    }
  }
  if (now_ns >= due_ns_) begin_step(now_ns);
}

void StopBySdo::take_response(std::int64_t now_ns) {
  const bool is_done = sdo_.status() == SdoStatus::done;
  switch (step_) {
    case Step::command:
      // From when it was taken: a drive that was not heard for long has had no time to stop yet.
      if (is_done && quick_stop_since_ns_ == no_stamp_ns) quick_stop_since_ns_ = now_ns;
      step_ = Step::read_statusword;
      return;
    case Step::read_statusword:
      is_statusword_fresh_ = is_done;
      if (is_done) state_ = cia402::state_of(static_cast<std::uint16_t>(sdo_.value()));
      step_ = Step::read_velocity;
      return;
    case Step::read_velocity:
      if (is_done) velocity_units_ = static_cast<std::int32_t>(sdo_.value());
      has_velocity_ = is_done;
      const bool is_still =
          is_done && is_statusword_fresh_ && cia402::has_no_torque(state_) && velocity_units_ == 0;
      confirmations_ = is_still ? static_cast<std::uint8_t>(confirmations_ + 1) : std::uint8_t{0};
      step_ = Step::command;
      due_ns_ = now_ns + config_.pause_ns;
      return;
  }
}

void StopBySdo::begin_step(std::int64_t now_ns) {
  std::uint16_t controlword = 0;
  if (step_ == Step::command && !needs_command(controlword, now_ns)) step_ = Step::read_statusword;
  switch (step_) {
    case Step::command:
      is_begun_ =
          sdo_.download({of_axis(cia402::controlword_index, config_.axis), 0, 2, controlword}, now_ns);
      break;
    case Step::read_statusword:
      is_begun_ = sdo_.upload({of_axis(cia402::statusword_index, config_.axis), 0}, now_ns);
      break;
    case Step::read_velocity:
      is_begun_ = sdo_.upload({of_axis(cia402::velocity_index, config_.axis), 0}, now_ns);
      break;
  }
}

bool StopBySdo::needs_command(std::uint16_t& controlword, std::int64_t now_ns) const {
  using cia402::State;
  const bool is_late =
      quick_stop_since_ns_ != no_stamp_ns && now_ns - quick_stop_since_ns_ >= config_.quick_stop_limit_ns;
  const bool is_standing = has_velocity_ && velocity_units_ <= config_.stall_velocity_units &&
                           velocity_units_ >= -config_.stall_velocity_units;
  switch (state_) {
    case State::unknown:
    case State::operation_enabled:
      controlword = is_late ? cia402::controlword::disable_voltage : cia402::controlword::quick_stop;
      return true;
    case State::quick_stop_active:  // a drive with quick-stop option 5 to 8 stays there
      controlword = cia402::controlword::disable_voltage;
      return is_standing || is_late;
    case State::switched_on:
    case State::ready_to_switch_on:
      controlword = cia402::controlword::disable_voltage;
      return true;
    case State::not_ready_to_switch_on:
    case State::switch_on_disabled:
    case State::fault_reaction_active:
    case State::fault:
      break;
  }
  return false;
}

}  // namespace alces
