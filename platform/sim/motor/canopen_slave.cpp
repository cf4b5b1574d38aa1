#include "alces_platform/sim/motor/canopen_slave.h"

#include <algorithm>

namespace alces::sim {
namespace {

constexpr std::int64_t ns_per_ms = 1'000'000;
constexpr std::uint16_t first_communication_object = 0x1000;
constexpr std::uint16_t last_communication_object = 0x1FFF;
constexpr std::uint16_t last_object = 0xFFFF;
constexpr std::int64_t save_signature = 0x65766173;  // "save"
constexpr std::int64_t load_signature = 0x64616F6C;  // "load"
constexpr std::uint16_t heartbeat_error = 0x8130;
constexpr std::uint16_t pdo_length_error = 0x8210;
constexpr std::uint8_t communication_error_bits = 0x11;

bool is_state_of_the_moment(std::uint16_t index) {
  return index == 0x1003 || index == 0x1010 || index == 0x1011 || index == 0x6040 || index == 0x607A ||
         index == 0x60FF;
}

}  // namespace

CanopenSlave::CanopenSlave(const CanopenSlaveConfig& config, ObjectDictionary& objects,
                           CanopenApplication& application)
    : config_(config), objects_(&objects), application_(&application), pdos_(objects), sdo_(*this) {
  pdos_.send_acyclic(config.sends_acyclic_pdos);
}

void CanopenSlave::power_on(std::int64_t now_ns) {
  advance(now_ns);
  is_powered_ = true;
  reset_node(now_ns);
}

void CanopenSlave::power_off(std::int64_t now_ns) {
  advance(now_ns);
  is_powered_ = false;
  application_->on_reset(now_ns_);
  initialise(0);
  boot_due_ns_ = never_ns;
}

void CanopenSlave::reset_node(std::int64_t now_ns) {
  advance(now_ns);
  if (!is_powered_) return;
  application_->on_reset(now_ns_);
  boots_application_ = true;
  initialise(config_.boot_ns);
}

void CanopenSlave::initialise(std::int64_t duration_ns) {
  nmt_state_ = NmtState::initialising;
  boot_due_ns_ = now_ns_ + duration_ns;
  heartbeat_due_ns_ = consumer_due_ns_ = cycle_due_ns_ = never_ns;
  outbox_.clear();
  sdo_.reset();
}

void CanopenSlave::restore(std::uint16_t first, std::uint16_t last) {
  objects_->restore_defaults(first, last);
  if (!loads_defaults_) objects_->assign(saved_, first, last);
}

void CanopenSlave::boot() {
  boot_due_ns_ = never_ns;
  if (boots_application_) {
    restore(0, last_object);
    if (loads_defaults_) saved_.clear();
    loads_defaults_ = false;
  } else {
    const std::int64_t error_register = objects_->value(0x1001);  // the error did not go away
    restore(first_communication_object, last_communication_object);
    objects_->set(0x1001, 0, error_register);
  }
  guarding_toggle_ = false;
  enter(NmtState::pre_operational);
  send_byte(0x700U + config_.node, 0);
  if (heartbeat_period_ns() > 0) heartbeat_due_ns_ = now_ns_ + heartbeat_period_ns();
  if (boots_application_) application_->on_booted(now_ns_);
  boots_application_ = false;
}

void CanopenSlave::enter(NmtState state) {
  nmt_state_ = state;
  cycle_due_ns_ = never_ns;
  if (state != NmtState::operational) return;
  application_->refresh(now_ns_);
  pdos_.restart(now_ns_);
  if (pdos_.has_events()) cycle_due_ns_ = now_ns_;
}

void CanopenSlave::on_nmt(std::uint8_t command) {
  switch (command) {
    case 0x01:
      if (nmt_state_ != NmtState::operational) enter(NmtState::operational);
      return;
    case 0x02:
      return enter(NmtState::stopped);
    case 0x80:
      return enter(NmtState::pre_operational);
    case 0x81:
      return reset_node(now_ns_);
    case 0x82:
      return initialise(config_.communication_reset_ns);
    default:
      ++counters_.frames_ignored;
  }
}

void CanopenSlave::on_frame(const CanFrame& frame, std::int64_t now_ns) {
  advance(now_ns);
  if (!is_powered_ || is_absent_ || nmt_state_ == NmtState::initialising) return;
  const std::uint32_t node = config_.node;
  if (frame.is_remote && !frame.is_extended && frame.id == 0x700 + node) return on_guarding();
  if (!frame.is_classical_data()) {
    ++counters_.frames_ignored;
    return;
  }
  const bool hears_pdos = nmt_state_ == NmtState::operational;
  if (frame.id == 0) {
    if (frame.size == 2 && (frame.data[1] == 0 || frame.data[1] == node)) return on_nmt(frame.data[0]);
  } else if (frame.id == (static_cast<std::uint32_t>(objects_->value(0x1005)) & 0x7FF)) {
    if (hears_pdos) return on_sync();
  } else if (frame.id == 0x600 + node) {
    if (frame.size == 8 && nmt_state_ != NmtState::stopped) return on_sdo(frame);
  } else if (frame.id > 0x700 && frame.id < 0x780) {
    return on_foreign_heartbeat(static_cast<std::uint8_t>(frame.id - 0x700));
  } else if (hears_pdos) {
    std::vector<PdoEngine::Value> values;
    switch (pdos_.on_frame(frame, values)) {
      case PdoEngine::Received::taken:
        ++counters_.rpdos;
        return apply(values);
      case PdoEngine::Received::too_short:
        ++counters_.rpdos_too_short;
        return send_emergency(pdo_length_error, communication_error_bits, {});
      case PdoEngine::Received::not_a_pdo:
        break;
    }
  }
  ++counters_.frames_ignored;
}

void CanopenSlave::on_sync() {
  ++counters_.syncs;
  std::vector<PdoEngine::Value> values;
  pdos_.take_at_sync(values);
  apply(values);
  application_->refresh(now_ns_);
  std::vector<CanFrame> frames;
  pdos_.send_at_sync(now_ns_, frames);
  send_pdos(frames, config_.pdo_latency_ns);
}

void CanopenSlave::apply(const std::vector<PdoEngine::Value>& values) {
  for (const PdoEngine::Value& value : values) {
    if (write_value(value.index, value.sub, value.value) != SdoAbort::none) ++counters_.rpdo_values_refused;
  }
}

void CanopenSlave::on_sdo(const CanFrame& frame) {
  ++counters_.sdo_requests;
  if (sdo_is_silent_) return;
  SdoServer::Bytes request{};
  std::copy_n(frame.data.begin(), request.size(), request.begin());
  const std::optional<SdoServer::Bytes> answer = sdo_.on_request(request);
  if (!answer) return;
  CanFrame out{.id = 0x580U + config_.node, .size = 8};
  std::ranges::copy(*answer, out.data.begin());
  send(out, config_.sdo_latency_ns);
}

void CanopenSlave::on_guarding() {
  if (heartbeat_period_ns() > 0 || heartbeat_is_silent_) return;
  send_byte(0x700U + config_.node,
            static_cast<std::uint8_t>(heartbeat_byte() | (guarding_toggle_ ? 0x80 : 0)));
  guarding_toggle_ = !guarding_toggle_;
}

void CanopenSlave::on_foreign_heartbeat(std::uint8_t node) {
  const std::int64_t consumer = objects_->value(0x1016, 1);
  if ((consumer >> 16 & 0x7F) != node || (consumer & 0xFFFF) == 0) {
    ++counters_.frames_ignored;
    return;
  }
  consumer_due_ns_ = now_ns_ + (consumer & 0xFFFF) * ns_per_ms;
}

void CanopenSlave::heartbeat_lost() {
  consumer_due_ns_ = never_ns;
  send_emergency(heartbeat_error, communication_error_bits, {});
  constexpr std::int64_t goes_on = 1;
  constexpr std::int64_t stops = 2;
  const std::int64_t behaviour = objects_->value(0x1029, 1);
  application_->on_heartbeat_lost(now_ns_);
  if (behaviour == stops) {
    enter(NmtState::stopped);
  } else if (behaviour != goes_on && nmt_state_ == NmtState::operational) {
    enter(NmtState::pre_operational);
  }
}

std::optional<SdoAbort> CanopenSlave::forced_abort(std::uint16_t index, std::uint8_t sub) {
  if (abort_of_all_ != 0) return static_cast<SdoAbort>(abort_of_all_);
  for (ForcedAbort& forced : forced_aborts_) {
    if (forced.index != index || forced.sub != sub || forced.times == 0) continue;
    --forced.times;
    return static_cast<SdoAbort>(forced.code);
  }
  return std::nullopt;
}

SdoAbort CanopenSlave::read_object(std::uint16_t index, std::uint8_t sub, std::vector<std::uint8_t>& bytes) {
  if (const auto forced = forced_abort(index, sub)) return *forced;
  application_->refresh(now_ns_);
  return objects_->read(index, sub, bytes);
}

SdoAbort CanopenSlave::write_object(std::uint16_t index, std::uint8_t sub,
                                    std::span<const std::uint8_t> bytes) {
  if (const auto forced = forced_abort(index, sub)) return *forced;
  std::int64_t value = 0;
  const SdoAbort code = objects_->check_write(index, sub, bytes, value);
  return code == SdoAbort::none ? write_value(index, sub, value) : code;
}

SdoAbort CanopenSlave::write_value(std::uint16_t index, std::uint8_t sub, std::int64_t value) {
  if (index == 0x1010 || index == 0x1011) return save_or_load(index, value);
  if (index == 0x1003 && value != 0) return SdoAbort::invalid_value;
  SdoAbort code = pdos_.check_write(index, sub, value);
  if (code == SdoAbort::none) code = application_->check_write(index, sub, value);
  if (code != SdoAbort::none) return code;
  objects_->set(index, sub, value);
  if (index == 0x1017) {
    heartbeat_due_ns_ = heartbeat_period_ns() > 0 ? now_ns_ + heartbeat_period_ns() : never_ns;
  } else if (index == 0x1016) {
    consumer_due_ns_ = never_ns;  // until the first heartbeat
  } else if (index >= 0x1800 && index < 0x1C00 && nmt_state_ == NmtState::operational) {
    cycle_due_ns_ = pdos_.has_events() ? now_ns_ + config_.cycle_ns : never_ns;
  }
  application_->on_written(index, sub, value, now_ns_);
  return SdoAbort::none;
}

SdoAbort CanopenSlave::save_or_load(std::uint16_t index, std::int64_t signature) {
  if (index == 0x1010 && signature == save_signature) {
    saved_ = objects_->writable_values();
    std::erase_if(saved_, [](const auto& item) {
      return is_state_of_the_moment(static_cast<std::uint16_t>(item.first >> 8));
    });
    loads_defaults_ = false;
    return SdoAbort::none;
  }
  if (index == 0x1011 && signature == load_signature) {
    loads_defaults_ = true;  // from the next reset on
    return SdoAbort::none;
  }
  return SdoAbort::cannot_be_stored;
}

void CanopenSlave::send_emergency(std::uint16_t code, std::uint8_t error_register,
                                  const std::array<std::uint8_t, 5>& manufacturer) {
  objects_->set(0x1001, 0, error_register);
  if (code != 0 && objects_->has_index(0x1003)) {
    std::uint8_t capacity = 0;
    while (capacity < 0xFE && objects_->find(0x1003, static_cast<std::uint8_t>(capacity + 1)) != nullptr)
      ++capacity;
    for (std::uint8_t sub = capacity; sub > 1; --sub) {
      objects_->set(0x1003, sub, objects_->value(0x1003, static_cast<std::uint8_t>(sub - 1)));
    }
    objects_->set(0x1003, 1, code);
    objects_->set(0x1003, 0, std::min<std::int64_t>(objects_->value(0x1003) + 1, capacity));
  }
  if (nmt_state_ != NmtState::pre_operational && nmt_state_ != NmtState::operational) return;
  const std::int64_t id = objects_->value(0x1014);
  if ((id & std::int64_t{1} << 31) != 0) return;
  CanFrame frame{.id = static_cast<std::uint32_t>(id) & 0x7FF, .size = 8};
  frame.data[0] = static_cast<std::uint8_t>(code & 0xFF);
  frame.data[1] = static_cast<std::uint8_t>(code >> 8);
  frame.data[2] = error_register;
  std::ranges::copy(manufacturer, frame.data.begin() + 3);
  send(frame, config_.pdo_latency_ns);
}

std::int64_t CanopenSlave::heartbeat_period_ns() const {
  return objects_->value(0x1017) * ns_per_ms;
}

std::uint8_t CanopenSlave::heartbeat_byte() const {
  switch (nmt_state_) {
    case NmtState::initialising:
      return 0x00;
    case NmtState::stopped:
      return 0x04;
    case NmtState::operational:
      return 0x05;
    case NmtState::pre_operational:
      break;
  }
  return 0x7F;
}

void CanopenSlave::send(const CanFrame& frame, std::int64_t latency_ns) {
  outbox_.push_back({now_ns_ + latency_ns, order_++, frame});
}

void CanopenSlave::send_byte(std::uint32_t id, std::uint8_t byte) {
  CanFrame frame{.id = id, .size = 1};
  frame.data[0] = byte;
  send(frame, 0);
}

void CanopenSlave::send_pdos(const std::vector<CanFrame>& frames, std::int64_t latency_ns) {
  if (pdo_is_silent_) return;
  for (const CanFrame& frame : frames) send(frame, latency_ns);
}

std::int64_t CanopenSlave::next_internal_ns() const {
  return std::min(
      {boot_due_ns_, heartbeat_due_ns_, consumer_due_ns_, cycle_due_ns_, application_->next_change_ns()});
}

std::int64_t CanopenSlave::next_event_ns() const {
  std::int64_t next_ns = next_internal_ns();
  for (const Due& due : outbox_) next_ns = std::min(next_ns, due.at_ns);
  return next_ns;
}

void CanopenSlave::advance(std::int64_t now_ns) {
  for (std::int64_t next_ns = next_internal_ns(); next_ns <= now_ns; next_ns = next_internal_ns()) {
    now_ns_ = std::max(now_ns_, next_ns);
    application_->advance(now_ns_);
    if (boot_due_ns_ <= now_ns_) boot();
    if (heartbeat_due_ns_ <= now_ns_) {
      if (!heartbeat_is_silent_) send_byte(0x700U + config_.node, heartbeat_byte());
      heartbeat_due_ns_ = heartbeat_period_ns() > 0 ? heartbeat_due_ns_ + heartbeat_period_ns() : never_ns;
    }
    if (consumer_due_ns_ <= now_ns_) heartbeat_lost();
    if (cycle_due_ns_ <= now_ns_) {
      application_->refresh(now_ns_);
      std::vector<CanFrame> frames;
      pdos_.send_events(now_ns_, frames);
      send_pdos(frames, 0);
      cycle_due_ns_ = now_ns_ + config_.cycle_ns;
    }
  }
  now_ns_ = std::max(now_ns_, now_ns);
}

bool CanopenSlave::poll(std::int64_t now_ns, CanFrame& out) {
  advance(now_ns);
  while (true) {
    const auto first = std::ranges::min_element(outbox_, [](const Due& a, const Due& b) {
      return a.at_ns != b.at_ns ? a.at_ns < b.at_ns : a.order < b.order;
    });
    if (first == outbox_.end() || first->at_ns > now_ns_) return false;
    out = first->frame;
    outbox_.erase(first);
    if (is_absent_) continue;
    ++counters_.frames_sent;
    return true;
  }
}

CanopenSlave::Counters CanopenSlave::counters() const {
  Counters counters = counters_;
  counters.sdo_aborts = sdo_.abort_count();
  return counters;
}

}  // namespace alces::sim
