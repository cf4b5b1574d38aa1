#include "alces_drivers/canopen/pdo.h"

#include <algorithm>

#include "alces_drivers/canopen/cob_id.h"

namespace alces::canopen {
namespace {

std::uint16_t communication_index(const PdoConfig& pdo, PdoDirection direction) {
  const bool is_from_node = direction == PdoDirection::from_node;
  return static_cast<std::uint16_t>((is_from_node ? tpdo_communication_index : rpdo_communication_index) +
                                    pdo.number - 1);
}

std::uint16_t mapping_index(const PdoConfig& pdo, PdoDirection direction) {
  const bool is_from_node = direction == PdoDirection::from_node;
  return static_cast<std::uint16_t>((is_from_node ? tpdo_mapping_index : rpdo_mapping_index) + pdo.number -
                                    1);
}

std::uint32_t cob_id_entry(const PdoConfig& pdo, PdoDirection direction, std::uint8_t node) {
  return pdo.cob_id_of(direction, node) | (pdo.forbids_remote_frames ? pdo_forbids_remote_frames : 0);
}

}  // namespace

std::uint16_t PdoConfig::cob_id_of(PdoDirection direction, std::uint8_t node) const {
  if (cob_id != 0) return cob_id;
  return direction == PdoDirection::from_node ? tpdo_cob_id(number, node) : rpdo_cob_id(number, node);
}

std::uint32_t PdoConfig::bits() const {
  std::uint32_t sum = 0;
  for (const PdoEntry& entry : entries) sum += entry.bits;
  return sum;
}

bool is_valid(const PdoConfig& pdo, PdoDirection direction, std::uint8_t node) {
  if (pdo.number < 1 || pdo.number > 512 || (pdo.cob_id == 0 && pdo.number > 4)) return false;
  const std::uint16_t cob_id = pdo.cob_id_of(direction, node);
  // CiA 301, table 40: identifiers of the other services are not for PDOs.
  if (cob_id <= 0x180 || cob_id > 0x6DF || (cob_id >= 0x581 && cob_id <= 0x67F)) return false;
  const auto is_good = [](const PdoEntry& entry) { return entry.bits > 0 && entry.bits <= 32; };
  return !pdo.entries.is_empty() && pdo.entries.is_complete() && std::ranges::all_of(pdo.entries, is_good) &&
         pdo.bits() <= 64;
}

PdoWrites writes_for(const PdoConfig& pdo, PdoDirection direction, std::uint8_t node) {
  const std::uint16_t communication = communication_index(pdo, direction);
  const std::uint16_t mapping = mapping_index(pdo, direction);
  PdoWrites writes;
  const auto add = [&writes](const ObjectWrite& write) {
    (void)writes.add(write);
  };  // maximum_writes is enough
  add(write_that_disables(pdo, direction, node));
  if (!pdo.keeps_mapping) {
    add({mapping, 0, 1, 0});
    std::uint8_t subindex = 0;
    for (const PdoEntry& entry : pdo.entries) add({mapping, ++subindex, 4, entry.mapping()});
    add({mapping, 0, 1, subindex});
  }
  if (!pdo.keeps_transmission_type) add({communication, 2, 1, pdo.transmission_type});
  if (pdo.inhibit_time_100us != 0) add({communication, 3, 2, pdo.inhibit_time_100us});
  if (pdo.event_timer_ms != 0) add({communication, 5, 2, pdo.event_timer_ms});
  add({communication, 1, 4, cob_id_entry(pdo, direction, node)});
  return writes;
}

ObjectWrite write_that_disables(const PdoConfig& pdo, PdoDirection direction, std::uint8_t node) {
  return {communication_index(pdo, direction), 1, 4, cob_id_entry(pdo, direction, node) | pdo_is_disabled};
}

std::optional<PdoField> field_of(const PdoConfig& pdo, ObjectAddress object) {
  std::uint8_t first_bit = 0;
  for (const PdoEntry& entry : pdo.entries) {
    if (entry.index == object.index && entry.subindex == object.subindex)
      return PdoField{first_bit, entry.bits};
    first_bit = static_cast<std::uint8_t>(first_bit + entry.bits);
  }
  return std::nullopt;
}

std::uint32_t read_field(const CanFrame& frame, PdoField field) {
  std::uint32_t value = 0;
  for (std::uint32_t bit = 0; bit < field.bits; ++bit) {
    const std::uint32_t position = field.first_bit + bit;
    if (position / 8 >= frame.size) break;
    value |= ((std::uint32_t{frame.data[position / 8]} >> (position % 8)) & 1U) << bit;
  }
  return value;
}

std::int32_t read_signed_field(const CanFrame& frame, PdoField field) {
  std::uint32_t value = read_field(frame, field);
  if (field.bits > 0 && field.bits < 32 && (value >> (field.bits - 1) & 1U) != 0) {
    value |= ~std::uint32_t{0} << field.bits;
  }
  return static_cast<std::int32_t>(value);
}

void write_field(CanFrame& frame, PdoField field, std::uint32_t value) {
  for (std::uint32_t bit = 0; bit < field.bits; ++bit) {
    const std::uint32_t position = field.first_bit + bit;
    if (position / 8 >= frame.size) break;
    const auto mask = static_cast<std::uint8_t>(1U << (position % 8));
    std::uint8_t& byte = frame.data[position / 8];
    byte = static_cast<std::uint8_t>((value >> bit & 1U) != 0 ? byte | mask : byte & ~mask);
  }
}

}  // namespace alces::canopen
