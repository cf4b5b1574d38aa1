#include "alces_drivers/canopen/master.h"

#include <algorithm>

namespace alces::canopen {

Master::Master(const MasterConfig& config, CanPort& port)
    : config_(config),
      port_(port),
      sync_(config.sync),
      heartbeat_(config.own_node, config.own_heartbeat_period_ns) {}

bool Master::add(NodeDriver& driver, std::span<const std::uint16_t> cob_ids) {
  const bool has_room =
      drivers_.size() < maximum_drivers && cob_ids.size() <= maximum_subscriptions - subscriptions_.size();
  if (!has_room || std::ranges::any_of(cob_ids, [](std::uint16_t id) { return id > 0x7FF; })) return false;
  const auto number = static_cast<std::uint16_t>(drivers_.size());
  (void)drivers_.add(&driver);
  for (const std::uint16_t cob_id : cob_ids) {
    (void)subscriptions_.add({cob_id, number});
    wanted_[cob_id / 64U] |= std::uint64_t{1} << (cob_id % 64U);
  }
  return true;
}

bool Master::hand_on(const CanFrame& frame, std::int64_t stamp_ns) {
  if ((wanted_[frame.id / 64] >> (frame.id % 64) & 1U) == 0) return false;
  for (const Subscription& subscription : subscriptions_) {
    if (subscription.cob_id == frame.id) drivers_[subscription.driver]->on_frame(frame, stamp_ns);
  }
  return true;
}

void Master::on_frame(const CanFrame& frame, std::int64_t stamp_ns) {
  ++counters_.frames;
  if (frame.is_error) {
    ++counters_.error_frames;
  } else if (!frame.is_classical_data() || frame.id > 0x7FF) {
    ++counters_.frames_not_canopen;
  } else if (hand_on(frame, stamp_ns)) {
    ++counters_.frames_routed;
  } else {
    ++counters_.frames_unclaimed;
  }
}

void Master::on_link(bool is_up, std::int64_t now_ns) {
  is_link_up_ = is_up;
  if (!is_up) sync_.stop();
  for (NodeDriver* driver : drivers_) driver->on_link(is_up, now_ns);
}

void Master::on_tick(std::int64_t now_ns) {
  if (is_link_up_) {
    heartbeat_.on_tick(now_ns, port_);
    if (config_.sync.period_ns > 0 && !sync_.is_running()) sync_.start(now_ns);
    if (sync_.on_tick(now_ns, port_)) (void)hand_on(sync_.frame(), now_ns);
  }
  for (NodeDriver* driver : drivers_) driver->on_tick(now_ns);
}

bool Master::order(NmtOrder order) {
  if (port_.send(nmt_frame(order))) return true;
  ++counters_.nmt_not_taken;
  return false;
}

Master::Counters Master::counters() const {
  Counters counters = counters_;
  counters.heartbeats_not_taken = heartbeat_.not_taken_count();
  counters.sync = sync_.counters();
  return counters;
}

}  // namespace alces::canopen
