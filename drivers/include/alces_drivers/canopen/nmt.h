// Network management: what a master orders and what a node says of itself. CiA 301 version 4.2, 7.2.8.
#pragma once

#include <cstdint>
#include <optional>

#include "alces_drivers/can_frame.h"

namespace alces::canopen {

enum class NmtCommand : std::uint8_t {
  start = 0x01,  ///< to operational: PDOs flow
  stop = 0x02,   ///< to stopped: no PDO, no SDO
  enter_pre_operational = 0x80,
  reset_node = 0x81,           ///< the application too; a boot-up message follows
  reset_communication = 0x82,  ///< the objects 0x1000 to 0x1FFF; a boot-up message follows
};
[[nodiscard]] const char* to_string(NmtCommand command);

enum class NmtState : std::uint8_t {
  boot_up = 0x00,
  stopped = 0x04,
  operational = 0x05,
  pre_operational = 0x7F,
  unknown = 0xFF,  ///< nothing heard of it yet, or a byte that CiA 301 does not know
};
[[nodiscard]] const char* to_string(NmtState state);

struct NmtOrder {
  NmtCommand command = NmtCommand::start;
  std::uint8_t node = 0;  ///< 0: all
};

[[nodiscard]] CanFrame nmt_frame(NmtOrder order);
/// Nothing: not an NMT frame of two bytes with a command that is known.
[[nodiscard]] std::optional<NmtOrder> decode_nmt(const CanFrame& frame);

[[nodiscard]] CanFrame heartbeat_frame(std::uint8_t node, NmtState state);
/// The state in a heartbeat's only byte; nothing: not one byte, or an unknown state.
[[nodiscard]] std::optional<NmtState> decode_heartbeat(const CanFrame& frame);

}  // namespace alces::canopen
