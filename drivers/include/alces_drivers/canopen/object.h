// Entries of a node's object dictionary: where, how large, and what is to be written there.
#pragma once

#include <cstdint>

namespace alces::canopen {

struct ObjectAddress {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;

  friend bool operator==(const ObjectAddress&, const ObjectAddress&) = default;
};

/// A value of 1 to 4 bytes for an object. Signed values as their two's complement.
struct ObjectWrite {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint8_t size = 0;  ///< bytes; the node refuses what does not fit its type
  std::uint32_t value = 0;

  [[nodiscard]] ObjectAddress address() const { return {index, subindex}; }
  friend bool operator==(const ObjectWrite&, const ObjectWrite&) = default;
};

/// What must be read from an object, in the bits of the mask.
struct ObjectCheck {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint32_t mask = 0xFFFFFFFF;
  std::uint32_t value = 0;

  [[nodiscard]] ObjectAddress address() const { return {index, subindex}; }
  friend bool operator==(const ObjectCheck&, const ObjectCheck&) = default;
};

/// Objects of CiA 301 that a master needs.
inline constexpr std::uint16_t device_type_index = 0x1000;
inline constexpr std::uint16_t error_register_index = 0x1001;
inline constexpr std::uint16_t device_name_index = 0x1008;
inline constexpr std::uint16_t heartbeat_consumer_index = 0x1016;  ///< sub 1: node << 16 | milliseconds
inline constexpr std::uint16_t heartbeat_producer_index = 0x1017;  ///< milliseconds
inline constexpr std::uint16_t identity_index = 0x1018;  ///< vendor, product code, revision, serial number
inline constexpr std::uint16_t sync_counter_index = 0x1019;
inline constexpr std::uint16_t rpdo_communication_index = 0x1400;
inline constexpr std::uint16_t rpdo_mapping_index = 0x1600;
inline constexpr std::uint16_t tpdo_communication_index = 0x1800;
inline constexpr std::uint16_t tpdo_mapping_index = 0x1A00;

}  // namespace alces::canopen
