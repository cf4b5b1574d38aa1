// Process data objects: which objects travel in which frame, how a node is told so, and how the frames are
// read and written. CiA 301 version 4.2, 7.2.2 and 7.5.2.35 to 7.5.2.38.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "alces_drivers/can_frame.h"
#include "alces_drivers/canopen/object.h"
#include "alces_drivers/static_vector.h"

namespace alces::canopen {

enum class PdoDirection : std::uint8_t {
  from_node,  ///< TPDO: objects 0x1800.., 0x1A00..
  to_node,    ///< RPDO: objects 0x1400.., 0x1600..
};

struct PdoEntry {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint8_t bits = 0;

  [[nodiscard]] std::uint32_t mapping() const {
    return std::uint32_t{index} << 16 | std::uint32_t{subindex} << 8 | bits;
  }
  friend bool operator==(const PdoEntry&, const PdoEntry&) = default;
};

/// Bits 31 and 30 of the COB-ID entry of a PDO.
inline constexpr std::uint32_t pdo_is_disabled = 0x80000000;
inline constexpr std::uint32_t pdo_forbids_remote_frames = 0x40000000;

/// Transmission types: 0 on the SYNC after a change, 1 to 240 on every so many SYNCs, 254 and 255 when it
/// likes.
[[nodiscard]] constexpr bool is_cyclic_on_sync(std::uint8_t transmission_type) {
  return transmission_type >= 1 && transmission_type <= 240;
}

struct PdoConfig {
  static constexpr std::size_t maximum_entries = 8;
  static constexpr std::size_t maximum_writes = maximum_entries + 7;

  std::uint16_t number = 1;            ///< 1 to 512: the object is 0x1400/0x1800 + number - 1
  std::uint16_t cob_id = 0;            ///< 0: of the predefined set, for the numbers 1 to 4
  bool forbids_remote_frames = false;  ///< sets bit 30: nodes without remote frames insist on it in TPDOs
  std::uint8_t transmission_type = 1;
  bool keeps_mapping = false;  ///< the node has it fixed: `entries` say what it is, and are not written
  bool keeps_transmission_type = false;  ///< likewise
  std::uint16_t inhibit_time_100us = 0;  ///< 0: not written
  std::uint16_t event_timer_ms = 0;      ///< 0: not written
  StaticVector<PdoEntry, maximum_entries> entries;

  [[nodiscard]] std::uint16_t cob_id_of(PdoDirection direction, std::uint8_t node) const;
  [[nodiscard]] std::uint32_t bits() const;  ///< of all entries
  [[nodiscard]] std::uint8_t bytes() const { return static_cast<std::uint8_t>((bits() + 7) / 8); }
};

/// False: no number or COB-ID that a PDO can have, no entry, an entry of 0 or more than 32 bits, or more than
/// 64 bits.
[[nodiscard]] bool is_valid(const PdoConfig& pdo, PdoDirection direction, std::uint8_t node);

using PdoWrites = StaticVector<ObjectWrite, PdoConfig::maximum_writes>;

/// The writes that set a PDO up, in the order CiA 301 prescribes: disable, no entries, the entries, their
/// number, transmission type (and times), enable.
[[nodiscard]] PdoWrites writes_for(const PdoConfig& pdo, PdoDirection direction, std::uint8_t node);

/// A write that switches the PDO off, for those that a node has by default and nobody wants.
[[nodiscard]] ObjectWrite write_that_disables(const PdoConfig& pdo, PdoDirection direction,
                                              std::uint8_t node);

struct PdoField {
  std::uint8_t first_bit = 0;
  std::uint8_t bits = 0;
};
/// Where an object lies in the PDO; nothing: it is not mapped there.
[[nodiscard]] std::optional<PdoField> field_of(const PdoConfig& pdo, ObjectAddress object);

/// The field's bits; 0 beyond the frame's end.
[[nodiscard]] std::uint32_t read_field(const CanFrame& frame, PdoField field);
/// The same, as a two's complement number.
[[nodiscard]] std::int32_t read_signed_field(const CanFrame& frame, PdoField field);
void write_field(CanFrame& frame, PdoField field, std::uint32_t value);

}  // namespace alces::canopen
