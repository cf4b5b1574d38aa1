#include "alces_drivers/canopen/sync.h"

#include "alces_drivers/canopen/cob_id.h"

namespace alces::canopen {

void SyncProducer::start(std::int64_t now_ns) {
  counter_ = 0;
  due_ns_ = config_.period_ns > 0 ? now_ns : no_stamp_ns;
}

bool SyncProducer::on_tick(std::int64_t now_ns, CanPort& port) {
  if (!is_running() || now_ns < due_ns_) return false;
  const std::int64_t cycles = 1 + (now_ns - due_ns_) / config_.period_ns;
  due_ns_ += cycles * config_.period_ns;
  counters_.skipped += static_cast<std::uint64_t>(cycles - 1);
  frame_ = CanFrame{.id = sync_cob_id};
  std::uint8_t counter = 0;
  if (config_.counter_overflow != 0) {
    counter =
        counter_ >= config_.counter_overflow ? std::uint8_t{1} : static_cast<std::uint8_t>(counter_ + 1);
    frame_.size = 1;
    frame_.data[0] = counter;
  }
  if (!port.send(frame_)) {
    ++counters_.not_taken;
    return false;
  }
  counter_ = counter;
  ++counters_.sent;
  return true;
}

}  // namespace alces::canopen
