#include "alces_drivers/canopen/nmt.h"

#include "alces_drivers/canopen/cob_id.h"

namespace alces::canopen {

const char* to_string(NmtCommand command) {
  switch (command) {
    case NmtCommand::start:
      return "start";
    case NmtCommand::stop:
      return "stop";
    case NmtCommand::enter_pre_operational:
      return "enter pre-operational";
    case NmtCommand::reset_node:
      return "reset node";
    case NmtCommand::reset_communication:
      return "reset communication";
  }
  return "unknown command";
}

const char* to_string(NmtState state) {
  switch (state) {
    case NmtState::boot_up:
      return "boot-up";
    case NmtState::stopped:
      return "stopped";
    case NmtState::operational:
      return "operational";
    case NmtState::pre_operational:
      return "pre-operational";
    case NmtState::unknown:
      return "unknown";
  }
  return "unknown";
}

CanFrame nmt_frame(NmtOrder order) {
  CanFrame frame{.id = nmt_cob_id, .size = 2};
  frame.data[0] = static_cast<std::uint8_t>(order.command);
  frame.data[1] = order.node;
  return frame;
}

std::optional<NmtOrder> decode_nmt(const CanFrame& frame) {
  if (!frame.is_classical_data() || frame.id != nmt_cob_id || frame.size != 2) return std::nullopt;
  const NmtOrder order{static_cast<NmtCommand>(frame.data[0]), frame.data[1]};
  switch (order.command) {
    case NmtCommand::start:
    case NmtCommand::stop:
    case NmtCommand::enter_pre_operational:
    case NmtCommand::reset_node:
    case NmtCommand::reset_communication:
      break;
    default:
      return std::nullopt;
  }
  if (order.node > last_node) return std::nullopt;
  return order;
}

CanFrame heartbeat_frame(std::uint8_t node, NmtState state) {
  CanFrame frame{.id = heartbeat_cob_id(node), .size = 1};
  frame.data[0] = static_cast<std::uint8_t>(state);
  return frame;
}

std::optional<NmtState> decode_heartbeat(const CanFrame& frame) {
  if (!frame.is_classical_data() || frame.size != 1) return std::nullopt;
  if (origin_of(frame.id).service != Service::heartbeat) return std::nullopt;
  const auto state = static_cast<NmtState>(frame.data[0] & 0x7F);  // bit 7: reserved, the guard's toggle bit
  switch (state) {
    case NmtState::boot_up:
    case NmtState::stopped:
    case NmtState::operational:
    case NmtState::pre_operational:
      return state;
    default:
      return std::nullopt;
  }
}

}  // namespace alces::canopen
