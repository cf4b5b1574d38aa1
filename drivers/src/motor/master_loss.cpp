#include "alces_drivers/motor/master_loss.h"

#include "alces_drivers/motor/cia402.h"
#include "alces_drivers/motor/motor_config.h"

namespace alces {

using canopen::SdoStatus;

namespace {

constexpr std::uint16_t option_fault = 1;
constexpr std::uint16_t option_quick_stop = 3;

MasterLossReaction reaction_of(std::uint16_t option_code) {
  switch (option_code) {
    case 1:
      return MasterLossReaction::fault;
    case 2:
      return MasterLossReaction::disable_voltage;
    case 3:
      return MasterLossReaction::quick_stop;
    default:  // 0, and makers' own, of which nothing is known here
      return MasterLossReaction::none;
  }
}

}  // namespace

const char* to_string(MasterLossReaction reaction) {
  switch (reaction) {
    case MasterLossReaction::unknown:
      return "it is not known whether the drive stops by itself when nobody commands it: cut its torque by "
             "hardware (STO)";
    case MasterLossReaction::none:
      return "the drive does not stop by itself when nobody commands it, the head turns on: cut its torque "
             "by "
             "hardware (STO)";
    case MasterLossReaction::fault:
      return "when nobody commands it the drive goes into fault by its fault reaction (0x605E)";
    case MasterLossReaction::disable_voltage:
      return "when nobody commands it the drive takes the torque away, and the head runs out";
    case MasterLossReaction::quick_stop:
      return "when nobody commands it the drive stops by quick stop";
    case MasterLossReaction::by_maker:
      return "when nobody commands it the maker's watchdog of the drive has to stop it, as it is configured";
  }
  return "unknown";
}

void MasterLoss::begin() {
  is_begun_ = false;
  reaction_ = MasterLossReaction::unknown;
  step_ = Step::read_consumer;
  wanted_option_ = option_quick_stop;
  if (config_.has_makers_watchdog) {
    finish(MasterLossReaction::by_maker);
  } else if (!config_.is_watched) {
    finish(MasterLossReaction::none);
  }
}

void MasterLoss::pause() {
  if (is_begun_) sdo_.cancel();
  is_begun_ = false;
}

void MasterLoss::finish(MasterLossReaction reaction) {
  reaction_ = reaction;
  step_ = Step::done;
}

void MasterLoss::advance(std::int64_t now_ns) {
  if (is_begun_) {
    if (sdo_.is_busy()) return;
    is_begun_ = false;
    take_response();
  }
  switch (step_) {
    case Step::read_consumer:
      is_begun_ = sdo_.upload({canopen::heartbeat_consumer_index, 1}, now_ns);
      break;
    case Step::read_option:
      is_begun_ = sdo_.upload({of_axis(cia402::abort_connection_option_index, config_.axis), 0}, now_ns);
      break;
    case Step::write_option:
      is_begun_ = sdo_.download(
          {of_axis(cia402::abort_connection_option_index, config_.axis), 0, 2, wanted_option_}, now_ns);
      break;
    case Step::done:
      break;
  }
}

void MasterLoss::take_response() {
  const SdoStatus status = sdo_.status();
  const bool is_done = status == SdoStatus::done;
  if (!is_done && status != SdoStatus::aborted) {
    finish(MasterLossReaction::unknown);
    return;
  }
  switch (step_) {
    case Step::read_consumer:
      if (is_done && (sdo_.value() & 0xFFFF) != 0) {
        step_ = Step::read_option;
      } else {
        finish(MasterLossReaction::none);  // it does not watch us
      }
      return;
    case Step::read_option: {
      if (!is_done) {
        finish(MasterLossReaction::none);
        return;
      }
      const auto option = static_cast<std::uint16_t>(sdo_.value());
      reaction_ = reaction_of(option);
      step_ = option == option_quick_stop || !config_.sets_reaction ? Step::done : Step::write_option;
      return;
    }
    case Step::write_option:
      if (is_done) {
        finish(reaction_of(wanted_option_));
      } else if (wanted_option_ > option_fault) {
        --wanted_option_;  // quick stop, disable voltage, fault: the best that it takes
      } else {
        finish(reaction_);
      }
      return;
    case Step::done:
      return;
  }
}

}  // namespace alces
