#include "alces_drivers/motor/process_data.h"

#include <algorithm>

namespace alces {
namespace {

using canopen::PdoDirection;
using canopen::PdoField;

PdoField field_or_none(const canopen::PdoConfig& pdo, std::uint16_t index) {
  return canopen::field_of(pdo, {index, 0}).value_or(PdoField{});
}

}  // namespace

ProcessData::ProcessData(const MotorConfig& config) : echo_patience_ns_(4 * config.sync.period_ns) {
  const bool has_sync = config.sync.period_ns > 0;
  for (const canopen::PdoConfig& pdo : config.tpdos) {
    Tpdo tpdo;
    tpdo.cob_id = pdo.cob_id_of(PdoDirection::from_node, config.node);
    tpdo.bytes = pdo.bytes();
    if (has_sync && canopen::is_cyclic_on_sync(pdo.transmission_type))
      tpdo.cycles_between = pdo.transmission_type;
    tpdo.statusword = field_or_none(pdo, of_axis(cia402::statusword_index, config.axis));
    tpdo.position = field_or_none(pdo, of_axis(cia402::position_index, config.axis));
    tpdo.velocity = field_or_none(pdo, of_axis(cia402::velocity_index, config.axis));
    (void)tpdos_.add(tpdo);  // as many as in the configuration
  }
  for (const canopen::PdoConfig& pdo : config.rpdos) {
    Rpdo rpdo;
    rpdo.cob_id = pdo.cob_id_of(PdoDirection::to_node, config.node);
    rpdo.bytes = pdo.bytes();
    rpdo.controlword = field_or_none(pdo, of_axis(cia402::controlword_index, config.axis));
    rpdo.target_velocity = field_or_none(pdo, of_axis(cia402::target_velocity_index, config.axis));
    rpdo.mode = field_or_none(pdo, of_axis(cia402::mode_index, config.axis));
    (void)rpdos_.add(rpdo);
  }
}

void ProcessData::reset() {
  feedback_ = DriveFeedback{};
  position_stamp_ns_ = no_stamp_ns;
  velocity_stamp_ns_ = no_stamp_ns;
  statusword_stamp_ns_ = no_stamp_ns;
  sync_stamp_ns_ = no_stamp_ns;
  echo_stamp_ns_ = no_stamp_ns;
  state_ = cia402::State::unknown;
  candidate_ = cia402::State::unknown;
  for (std::size_t number = 0; number < tpdos_.size(); ++number) {
    Tpdo& tpdo = tpdos_[number];
    tpdo.cycles_since_last = 0;
    tpdo.came_in_this_cycle = false;
    // last_stamp_ns stays: the stamps of successive feedback rise across a reset too.
  }
}

ProcessData::Outcome ProcessData::on_frame(const CanFrame& frame, std::int64_t stamp_ns) {
  const auto* found = std::ranges::find(tpdos_, frame.id, &Tpdo::cob_id);
  if (found == tpdos_.end()) return Outcome::foreign;
  Tpdo& tpdo = tpdos_[static_cast<std::size_t>(found - tpdos_.begin())];
  ++counters_.received;
  if (!frame.is_classical_data() || frame.size < tpdo.bytes) {
    ++counters_.malformed;
    return Outcome::dropped;
  }
  if (tpdo.last_stamp_ns != no_stamp_ns && stamp_ns <= tpdo.last_stamp_ns) {
    ++counters_.stale;
    return Outcome::dropped;
  }
  bool is_extra = false;
  if (tpdo.cycles_between != 0 && tpdo.came_in_this_cycle) {
    if (frame == tpdo.last) {
      ++counters_.repeated;
      return Outcome::dropped;
    }
    ++counters_.extra;
    is_extra = true;
  }
  tpdo.last_stamp_ns = stamp_ns;
  tpdo.last = frame;
  tpdo.came_in_this_cycle = true;
  tpdo.cycles_since_last = 0;

  if (tpdo.statusword.bits != 0) {
    take_statusword(static_cast<std::uint16_t>(canopen::read_field(frame, tpdo.statusword)),
                    tpdo.cycles_between != 0);
    statusword_stamp_ns_ = stamp_ns;
  }
  if (tpdo.velocity.bits != 0) {
    feedback_.velocity_units = canopen::read_signed_field(frame, tpdo.velocity);
    velocity_stamp_ns_ = stamp_ns;
  }
  if (tpdo.position.bits == 0) return Outcome::taken;
  feedback_.position_counts = canopen::read_signed_field(frame, tpdo.position);
  feedback_.stamp_ns = stamp_ns;
  feedback_.sync_stamp_ns = sync_stamp_ns_;
  feedback_.is_extra = is_extra;
  position_stamp_ns_ = stamp_ns;
  return Outcome::feedback;
}

void ProcessData::take_statusword(std::uint16_t statusword, bool is_cyclic) {
  feedback_.statusword = statusword;
  const cia402::State state = cia402::state_of(statusword);
  if (state != state_ && is_cyclic && state_ != cia402::State::unknown && candidate_ != state) {
    candidate_ = state;
    return;
  }
  if (state == state_ && candidate_ != state_) ++counters_.states_ignored;
  state_ = state;
  candidate_ = state;
}

void ProcessData::on_sync_sent(std::int64_t stamp_ns) {
  if (echo_stamp_ns_ != no_stamp_ns && stamp_ns <= echo_stamp_ns_) return;
  echo_stamp_ns_ = stamp_ns;
  sync_stamp_ns_ = stamp_ns;
}

void ProcessData::on_sync(std::int64_t stamp_ns) {
  const bool do_echoes_come = echo_stamp_ns_ != no_stamp_ns && stamp_ns - echo_stamp_ns_ <= echo_patience_ns_;
  if (!do_echoes_come) sync_stamp_ns_ = stamp_ns;
  for (std::size_t number = 0; number < tpdos_.size(); ++number) {
    Tpdo& tpdo = tpdos_[number];
    if (tpdo.cycles_between == 0) continue;
    const bool is_overdue = tpdo.cycles_since_last >= tpdo.cycles_between;
    if (is_overdue && position_stamp_ns_ != no_stamp_ns) ++counters_.missed;
    tpdo.cycles_since_last = is_overdue ? 1 : tpdo.cycles_since_last + 1;
    tpdo.came_in_this_cycle = false;
  }
}

CanFrame ProcessData::rpdo(std::size_t number, std::uint16_t controlword,
                           std::int32_t target_velocity_units) const {
  const Rpdo& rpdo = rpdos_[number];
  CanFrame frame{.id = rpdo.cob_id, .size = rpdo.bytes};
  canopen::write_field(frame, rpdo.controlword, controlword);
  canopen::write_field(frame, rpdo.target_velocity, static_cast<std::uint32_t>(target_velocity_units));
  canopen::write_field(frame, rpdo.mode, cia402::profile_velocity_mode);
  return frame;
}

}  // namespace alces
