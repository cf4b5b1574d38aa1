// Who speaks to whom on a CANopen bus: all communication object identifiers (COB-IDs) of the predefined
// connection set. CiA 301 version 4.2, 7.3.5, tables 62 to 64.
#pragma once

#include <cstdint>

namespace alces::canopen {

inline constexpr std::uint8_t first_node = 1;
inline constexpr std::uint8_t last_node = 127;
inline constexpr std::uint8_t all_nodes = 0;  ///< in an NMT command

inline constexpr std::uint16_t nmt_cob_id = 0x000;
inline constexpr std::uint16_t sync_cob_id = 0x080;
inline constexpr std::uint16_t time_stamp_cob_id = 0x100;

[[nodiscard]] constexpr bool is_node(std::uint32_t node) {
  return node >= first_node && node <= last_node;
}

[[nodiscard]] constexpr std::uint16_t emcy_cob_id(std::uint8_t node) {
  return static_cast<std::uint16_t>(0x080 + node);
}
/// From the node, in its objects 0x1800...; `number` 1 to 4.
[[nodiscard]] constexpr std::uint16_t tpdo_cob_id(std::uint16_t number, std::uint8_t node) {
  return static_cast<std::uint16_t>(0x080 + 0x100 * number + node);
}
/// To the node, in its objects 0x1400...; `number` 1 to 4.
[[nodiscard]] constexpr std::uint16_t rpdo_cob_id(std::uint16_t number, std::uint8_t node) {
  return static_cast<std::uint16_t>(0x100 + 0x100 * number + node);
}
/// From the SDO server, which is the node.
[[nodiscard]] constexpr std::uint16_t sdo_response_cob_id(std::uint8_t node) {
  return static_cast<std::uint16_t>(0x580 + node);
}
/// To the SDO server.
[[nodiscard]] constexpr std::uint16_t sdo_request_cob_id(std::uint8_t node) {
  return static_cast<std::uint16_t>(0x600 + node);
}
/// Heartbeat, boot-up and (not used here) node guarding.
[[nodiscard]] constexpr std::uint16_t heartbeat_cob_id(std::uint8_t node) {
  return static_cast<std::uint16_t>(0x700 + node);
}

enum class Service : std::uint8_t {
  nmt,
  sync,
  time_stamp,
  emcy,
  tpdo,
  rpdo,
  sdo_response,
  sdo_request,
  heartbeat,
  other,  ///< not of the predefined set: LSS, or a PDO with an identifier of its own
};
[[nodiscard]] const char* to_string(Service service);

struct Origin {
  Service service = Service::other;
  std::uint8_t node = 0;  ///< 0: no single one
  std::uint8_t pdo = 0;   ///< 1 to 4 of a PDO
};

/// What an 11-bit identifier means in the predefined connection set.
[[nodiscard]] Origin origin_of(std::uint32_t cob_id);

}  // namespace alces::canopen
