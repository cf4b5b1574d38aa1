#include "alces_drivers/canopen/configurator.h"

#include "alces_drivers/canopen/pdo.h"

namespace alces::canopen {
namespace {

bool is_rpdo_cob_id(const ConfigurationStep& step) {
  return step.kind == ConfigurationStep::Kind::write && step.object.subindex == 1 &&
         step.object.index >= rpdo_communication_index && step.object.index < rpdo_mapping_index;
}

}  // namespace

void Configurator::start(std::span<const ConfigurationStep> steps, std::int64_t now_ns) {
  cancel();
  steps_ = steps;
  step_ = 0;
  is_begun_ = false;
  flipped_bits_ = 0;
  status_ = Status::busy;
  begin_step(now_ns);
}

void Configurator::cancel() {
  if (status_ == Status::busy) sdo_.cancel();
  status_ = Status::idle;
}

void Configurator::begin_step(std::int64_t now_ns) {
  if (step_ == steps_.size()) {
    status_ = Status::done;
    return;
  }
  const ConfigurationStep& step = steps_[step_];
  // False while somebody else's transfer is under way: advance() tries again.
  is_begun_ =
      step.kind == ConfigurationStep::Kind::write
          ? sdo_.download({step.object.index, step.object.subindex, step.size, step.value ^ flipped_bits_},
                          now_ns)
          : sdo_.upload(step.object, now_ns);
}

void Configurator::advance(std::int64_t now_ns) {
  if (status_ != Status::busy) return;
  if (!is_begun_) {
    begin_step(now_ns);
    return;
  }
  if (sdo_.is_busy()) return;
  if (sdo_.status() == SdoStatus::aborted && is_rpdo_cob_id(steps_[step_]) && flipped_bits_ == 0) {
    flipped_bits_ = pdo_forbids_remote_frames;
    begin_step(now_ns);
    return;
  }
  if (sdo_.status() != SdoStatus::done) {
    status_ = Status::transfer_failed;
    return;
  }
  const ConfigurationStep& step = steps_[step_];
  if (step.kind == ConfigurationStep::Kind::check) {
    found_value_ = sdo_.value();
    if ((found_value_ & step.mask) != (step.value & step.mask)) {
      status_ = Status::value_differs;
      return;
    }
  }
  ++step_;
  is_begun_ = false;
  flipped_bits_ = 0;
  begin_step(now_ns);
}

}  // namespace alces::canopen
