#include "alces_drivers/canopen/cob_id.h"

namespace alces::canopen {

const char* to_string(Service service) {
  switch (service) {
    case Service::nmt:
      return "NMT command";
    case Service::sync:
      return "SYNC";
    case Service::time_stamp:
      return "time stamp";
    case Service::emcy:
      return "EMCY";
    case Service::tpdo:
      return "TPDO";
    case Service::rpdo:
      return "RPDO";
    case Service::sdo_response:
      return "SDO answer";
    case Service::sdo_request:
      return "SDO request";
    case Service::heartbeat:
      return "heartbeat";
    case Service::other:
      return "other";
  }
  return "unknown";
}

Origin origin_of(std::uint32_t cob_id) {
  if (cob_id == nmt_cob_id) return {Service::nmt, 0, 0};
  if (cob_id == sync_cob_id) return {Service::sync, 0, 0};
  if (cob_id == time_stamp_cob_id) return {Service::time_stamp, 0, 0};
  const auto node = static_cast<std::uint8_t>(cob_id & 0x7F);
  if (cob_id > 0x7FF || !is_node(node)) return {};
  const std::uint32_t function = cob_id >> 7;
  switch (function) {
    case 0x1:
      return {Service::emcy, node, 0};
    case 0x3:
    case 0x5:
    case 0x7:
    case 0x9:
      return {Service::tpdo, node, static_cast<std::uint8_t>((function - 1) / 2)};
    case 0x4:
    case 0x6:
    case 0x8:
    case 0xA:
      return {Service::rpdo, node, static_cast<std::uint8_t>((function - 2) / 2)};
    case 0xB:
      return {Service::sdo_response, node, 0};
    case 0xC:
      return {Service::sdo_request, node, 0};
    case 0xE:
      return {Service::heartbeat, node, 0};
    default:
      return {};
  }
}

}  // namespace alces::canopen
