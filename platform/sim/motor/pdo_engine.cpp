#include "alces_platform/sim/motor/pdo_engine.h"

#include <algorithm>
#include <span>

namespace alces::sim {
namespace {

constexpr std::uint16_t receive_communication = 0x1400;
constexpr std::uint16_t receive_mapping = 0x1600;
constexpr std::uint16_t transmit_communication = 0x1800;
constexpr std::uint16_t transmit_mapping = 0x1A00;
constexpr std::int64_t off_bit = std::int64_t{1} << 31;
constexpr std::int64_t last_synchronous_type = 240;
constexpr std::int64_t first_event_type = 254;

std::uint16_t object(std::uint16_t base, std::size_t number) {
  return static_cast<std::uint16_t>(base + number);
}

}  // namespace

bool PdoEngine::is_on(std::uint16_t communication) const {
  const ObjectEntry* id = objects_->find(communication, 1);
  return id != nullptr && (id->value & off_bit) == 0;
}

SdoAbort PdoEngine::check_entry(std::uint32_t entry, bool is_transmit) const {
  const auto index = static_cast<std::uint16_t>(entry >> 16);
  const auto sub = static_cast<std::uint8_t>(entry >> 8 & 0xFF);
  const ObjectEntry* target = objects_->find(index, sub);
  if (target == nullptr) return objects_->has_index(index) ? SdoAbort::no_subindex : SdoAbort::no_object;
  const Mapping needed = is_transmit ? Mapping::tpdo : Mapping::rpdo;
  const bool may_be_mapped = target->mapping == Mapping::both || target->mapping == needed;
  return may_be_mapped && (entry & 0xFF) == 8 * size_of(target->type) ? SdoAbort::none
                                                                      : SdoAbort::cannot_be_mapped;
}

SdoAbort PdoEngine::check_count(std::uint16_t mapping, std::int64_t count, bool is_transmit) const {
  std::int64_t bits = 0;
  for (std::int64_t sub = 1; sub <= count; ++sub) {
    const ObjectEntry* entry = objects_->find(mapping, static_cast<std::uint8_t>(sub));
    if (entry == nullptr) return SdoAbort::pdo_length;
    const SdoAbort code = check_entry(static_cast<std::uint32_t>(entry->value), is_transmit);
    if (code != SdoAbort::none) return code;
    bits += entry->value & 0xFF;
  }
  return bits <= 64 ? SdoAbort::none : SdoAbort::pdo_length;
}

SdoAbort PdoEngine::check_write(std::uint16_t index, std::uint8_t sub, std::int64_t value) const {
  const std::uint16_t base = index & 0xFE00;
  if (base == receive_communication || base == transmit_communication) {
    if (sub == 1) {
      const std::int64_t changed = (objects_->value(index, 1) ^ value) & ~off_bit & ~(std::int64_t{1} << 30);
      const bool stays_on = is_on(index) && (value & off_bit) == 0;
      return changed != 0 && stays_on ? SdoAbort::invalid_value : SdoAbort::none;
    }
    if (sub == 2) {
      const bool is_reserved =
          value > last_synchronous_type &&
          value < (base == receive_communication ? first_event_type : first_event_type - 2);
      return is_reserved ? SdoAbort::invalid_value : SdoAbort::none;
    }
    return SdoAbort::none;
  }
  if (base != receive_mapping && base != transmit_mapping) return SdoAbort::none;
  const bool is_transmit = base == transmit_mapping;
  const auto communication = static_cast<std::uint16_t>(index - 0x200);
  if (is_on(communication)) return SdoAbort::unsupported_access;
  if (sub == 0) return check_count(index, value, is_transmit);
  if (objects_->value(index, 0) != 0) return SdoAbort::unsupported_access;
  return value == 0 ? SdoAbort::none : check_entry(static_cast<std::uint32_t>(value), is_transmit);
}

void PdoEngine::restart(std::int64_t now_ns) {
  for (Transmit& transmit : transmit_) transmit = {std::nullopt, now_ns, 0};
  for (std::size_t number = 0; number < pdo_count; ++number) {
    waiting_[number].reset();
    // what is there at the start is no change; event-driven PDOs tell it once all the same
    const std::uint16_t communication = object(transmit_communication, number);
    if (is_on(communication) && objects_->value(communication, 2) == 0) {
      transmit_[number].last = gather(static_cast<std::uint16_t>(number));
    }
  }
}

CanFrame PdoEngine::gather(std::uint16_t number) const {
  const std::uint16_t mapping = object(transmit_mapping, number);
  std::vector<std::uint8_t> bytes;
  for (std::int64_t sub = 1; sub <= objects_->value(mapping, 0); ++sub) {
    const auto entry = static_cast<std::uint32_t>(objects_->value(mapping, static_cast<std::uint8_t>(sub)));
    const std::int64_t value = objects_->value(static_cast<std::uint16_t>(entry >> 16),
                                               static_cast<std::uint8_t>(entry >> 8 & 0xFF));
    append_little_endian(bytes, value, (entry & 0xFF) / 8);
  }
  CanFrame frame;
  frame.id = static_cast<std::uint32_t>(objects_->value(object(transmit_communication, number), 1)) & 0x7FF;
  frame.size = static_cast<std::uint8_t>(std::min<std::size_t>(bytes.size(), 8));
  std::copy_n(bytes.begin(), frame.size, frame.data.begin());
  return frame;
}

bool PdoEngine::scatter(std::uint16_t number, const CanFrame& frame, std::vector<Value>& written) const {
  const std::uint16_t mapping = object(receive_mapping, number);
  const std::size_t before = written.size();
  std::size_t at = 0;
  for (std::int64_t sub = 1; sub <= objects_->value(mapping, 0); ++sub) {
    const auto entry = static_cast<std::uint32_t>(objects_->value(mapping, static_cast<std::uint8_t>(sub)));
    const auto index = static_cast<std::uint16_t>(entry >> 16);
    const auto entry_sub = static_cast<std::uint8_t>(entry >> 8 & 0xFF);
    const std::size_t size = (entry & 0xFF) / 8;
    if (at + size > frame.size) {
      written.resize(before);
      return false;
    }
    const ObjectEntry* target = objects_->find(index, entry_sub);
    if (target != nullptr) {
      written.push_back(
          {index, entry_sub, decode_little_endian(frame.bytes().subspan(at, size), target->type)});
    }
    at += size;
  }
  return true;
}

PdoEngine::Received PdoEngine::on_frame(const CanFrame& frame, std::vector<Value>& written) {
  for (std::size_t number = 0; number < pdo_count; ++number) {
    const std::uint16_t communication = object(receive_communication, number);
    if (!is_on(communication)) continue;
    if ((static_cast<std::uint32_t>(objects_->value(communication, 1)) & 0x7FF) != frame.id) continue;
    std::vector<Value> values;
    if (!scatter(static_cast<std::uint16_t>(number), frame, values)) return Received::too_short;
    if (objects_->value(communication, 2) <= last_synchronous_type) {
      waiting_[number] = frame;
    } else {
      written.insert(written.end(), values.begin(), values.end());
    }
    return Received::taken;
  }
  return Received::not_a_pdo;
}

void PdoEngine::take_at_sync(std::vector<Value>& written) {
  for (std::size_t number = 0; number < pdo_count; ++number) {
    if (!waiting_[number]) continue;
    const bool fits = scatter(static_cast<std::uint16_t>(number), *waiting_[number], written);
    static_cast<void>(fits);  // checked when it came; a mapping that changed since then drops it
    waiting_[number].reset();
  }
}

void PdoEngine::send_at_sync(std::int64_t now_ns, std::vector<CanFrame>& frames) {
  for (std::size_t number = 0; number < pdo_count; ++number) {
    const std::uint16_t communication = object(transmit_communication, number);
    const std::int64_t type = objects_->value(communication, 2);
    if (!is_on(communication) || type > last_synchronous_type) continue;
    Transmit& transmit = transmit_[number];
    const CanFrame frame = gather(static_cast<std::uint16_t>(number));
    if (type == 0) {
      if (!sends_acyclic_ || frame == transmit.last) continue;
    } else if (++transmit.syncs < type) {
      continue;
    }
    transmit = {frame, now_ns, 0};
    frames.push_back(frame);
  }
}

bool PdoEngine::has_events() const {
  for (std::size_t number = 0; number < pdo_count; ++number) {
    const std::uint16_t communication = object(transmit_communication, number);
    if (is_on(communication) && objects_->value(communication, 2) >= first_event_type) return true;
  }
  return false;
}

void PdoEngine::send_events(std::int64_t now_ns, std::vector<CanFrame>& frames) {
  for (std::size_t number = 0; number < pdo_count; ++number) {
    const std::uint16_t communication = object(transmit_communication, number);
    if (!is_on(communication) || objects_->value(communication, 2) < first_event_type) continue;
    Transmit& transmit = transmit_[number];
    const CanFrame frame = gather(static_cast<std::uint16_t>(number));
    const std::int64_t since_ns = now_ns - transmit.last_ns;
    const std::int64_t inhibit_ns = objects_->value(communication, 3) * 100'000;  // 100 us
    const std::int64_t timer_ns = objects_->value(communication, 5) * 1'000'000;  // 1 ms
    const bool is_changed = frame != transmit.last;
    const bool timer_is_due = timer_ns > 0 && since_ns >= timer_ns;
    if (!(is_changed || timer_is_due) || (transmit.last && since_ns < inhibit_ns)) continue;
    transmit = {frame, now_ns, 0};
    frames.push_back(frame);
  }
}

}  // namespace alces::sim
