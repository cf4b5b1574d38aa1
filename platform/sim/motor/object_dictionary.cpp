#include "alces_platform/sim/motor/object_dictionary.h"

#include <utility>

namespace alces::sim {
namespace {

constexpr std::uint32_t key_of(std::uint16_t index, std::uint8_t sub) {
  return static_cast<std::uint32_t>(index) << 8 | sub;
}

bool is_signed(DataType type) {
  return type == DataType::integer8 || type == DataType::integer16 || type == DataType::integer32;
}

}  // namespace

std::size_t size_of(DataType type) {
  switch (type) {
    case DataType::boolean:
    case DataType::integer8:
    case DataType::unsigned8:
      return 1;
    case DataType::integer16:
    case DataType::unsigned16:
      return 2;
    case DataType::integer32:
    case DataType::unsigned32:
      return 4;
    case DataType::visible_string:
      return 0;
  }
  return 0;
}

void append_little_endian(std::vector<std::uint8_t>& bytes, std::int64_t value, std::size_t size) {
  const auto bits = static_cast<std::uint64_t>(value);
  for (std::size_t i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(bits >> (8 * i)));
}

std::int64_t decode_little_endian(std::span<const std::uint8_t> bytes, DataType type) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < bytes.size() && i < 8; ++i) bits |= std::uint64_t{bytes[i]} << (8 * i);
  if (is_signed(type) && !bytes.empty() && bytes.size() < 8 && (bytes[bytes.size() - 1] & 0x80) != 0) {
    bits |= ~std::uint64_t{0} << (8 * bytes.size());
  }
  return static_cast<std::int64_t>(bits);
}

void ObjectDictionary::add(std::uint16_t index, std::uint8_t sub, ObjectEntry entry) {
  entry.value = entry.default_value;
  entries_[key_of(index, sub)] = std::move(entry);
}

void ObjectDictionary::remove(std::uint16_t index) {
  entries_.erase(entries_.lower_bound(key_of(index, 0)), entries_.upper_bound(key_of(index, 0xFF)));
}

bool ObjectDictionary::has_index(std::uint16_t index) const {
  const auto entry = entries_.lower_bound(key_of(index, 0));
  return entry != entries_.end() && entry->first >> 8 == index;
}

const ObjectEntry* ObjectDictionary::find(std::uint16_t index, std::uint8_t sub) const {
  const auto entry = entries_.find(key_of(index, sub));
  return entry == entries_.end() ? nullptr : &entry->second;
}

std::int64_t ObjectDictionary::value(std::uint16_t index, std::uint8_t sub) const {
  const ObjectEntry* entry = find(index, sub);
  return entry == nullptr ? 0 : entry->value;
}

bool ObjectDictionary::set(std::uint16_t index, std::uint8_t sub, std::int64_t value) {
  const auto entry = entries_.find(key_of(index, sub));
  if (entry == entries_.end()) return false;
  entry->second.value = value;
  return true;
}

SdoAbort ObjectDictionary::missing(std::uint16_t index) const {
  return has_index(index) ? SdoAbort::no_subindex : SdoAbort::no_object;
}

SdoAbort ObjectDictionary::read(std::uint16_t index, std::uint8_t sub,
                                std::vector<std::uint8_t>& bytes) const {
  const ObjectEntry* entry = find(index, sub);
  if (entry == nullptr) return missing(index);
  if (entry->access == Access::write_only) return SdoAbort::write_only;
  bytes.clear();
  if (entry->type == DataType::visible_string) {
    bytes.assign(entry->text.begin(), entry->text.end());
  } else {
    append_little_endian(bytes, entry->value, size_of(entry->type));
  }
  return SdoAbort::none;
}

SdoAbort ObjectDictionary::check_write(std::uint16_t index, std::uint8_t sub,
                                       std::span<const std::uint8_t> bytes, std::int64_t& value) const {
  const ObjectEntry* entry = find(index, sub);
  if (entry == nullptr) return missing(index);
  if (entry->access == Access::constant || entry->access == Access::read_only) return SdoAbort::read_only;
  if (bytes.size() != size_of(entry->type)) return SdoAbort::length;
  value = decode_little_endian(bytes, entry->type);
  if (value > entry->maximum) return SdoAbort::too_high;
  if (value < entry->minimum) return SdoAbort::too_low;
  return SdoAbort::none;
}

void ObjectDictionary::restore_defaults(std::uint16_t first, std::uint16_t last) {
  const auto end = entries_.upper_bound(key_of(last, 0xFF));
  for (auto entry = entries_.lower_bound(key_of(first, 0)); entry != end; ++entry) {
    entry->second.value = entry->second.default_value;
  }
}

ObjectDictionary::Values ObjectDictionary::writable_values() const {
  Values values;
  for (const auto& [key, entry] : entries_) {
    if (entry.access == Access::read_write) values[key] = entry.value;
  }
  return values;
}

void ObjectDictionary::assign(const Values& values, std::uint16_t first, std::uint16_t last) {
  for (const auto& [key, value] : values) {
    const auto index = static_cast<std::uint16_t>(key >> 8);
    if (index >= first && index <= last) set(index, static_cast<std::uint8_t>(key & 0xFF), value);
  }
}

}  // namespace alces::sim
