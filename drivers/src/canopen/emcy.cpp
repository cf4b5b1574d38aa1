#include "alces_drivers/canopen/emcy.h"

#include <algorithm>

#include "alces_drivers/canopen/bytes.h"
#include "alces_drivers/canopen/cob_id.h"

namespace alces::canopen {
namespace {

struct CodeText {
  std::uint16_t code;
  const char* text;
};

/// In ascending order. A code ending in 0 stands for the codes up to its next one as far as its zeros reach.
constexpr CodeText codes[] = {
    {0x0000, "error reset or no error"},
    {0x1000, "generic error"},
    {0x2000, "current"},
    {0x2100, "current, device input side"},
    {0x2110, "short circuit or earth leakage at the input"},
    {0x2120, "earth leakage at the input"},
    {0x2130, "short circuit at the input"},
    {0x2200, "current inside the device"},
    {0x2220, "continuous over-current inside the device"},
    {0x2230, "short circuit or earth leakage inside the device"},
    {0x2300, "current, device output side"},
    {0x2310, "continuous over-current at the output"},
    {0x2320, "short circuit or earth leakage at the output"},
    {0x2330, "earth leakage at the output"},
    {0x2340, "short circuit at the output"},
    {0x3000, "voltage"},
    {0x3100, "mains voltage"},
    {0x3110, "mains over-voltage"},
    {0x3120, "mains under-voltage"},
    {0x3130, "mains phase failure"},
    {0x3200, "voltage inside the device"},
    {0x3210, "DC link over-voltage"},
    {0x3220, "DC link under-voltage"},
    {0x3300, "output voltage"},
    {0x4000, "temperature"},
    {0x4100, "ambient temperature"},
    {0x4200, "device temperature"},
    {0x4210, "device too hot"},
    {0x4220, "device too cold"},
    {0x4300, "drive temperature"},
    {0x4310, "drive too hot"},
    {0x4320, "drive too cold"},
    {0x4400, "supply temperature"},
    {0x5000, "device hardware"},
    {0x5100, "low supply voltage"},
    {0x5200, "control hardware"},
    {0x5300, "operating unit"},
    {0x5400, "power section"},
    {0x5441, "contact 1: safe torque off"},
    {0x5500, "data storage"},
    {0x5530, "non-volatile memory"},
    {0x6000, "device software"},
    {0x6010, "software reset by the watchdog"},
    {0x6100, "internal software"},
    {0x6200, "user software"},
    {0x6300, "data set"},
    {0x6310, "loss of parameters"},
    {0x6320, "error in a parameter"},
    {0x7000, "additional modules"},
    {0x7100, "power module"},
    {0x7110, "brake chopper"},
    {0x7120, "motor"},
    {0x7121, "motor blocked"},
    {0x7122, "motor error or commutation malfunction"},
    {0x7300, "sensor"},
    {0x7305, "incremental sensor 1"},
    {0x7306, "incremental sensor 2"},
    {0x7310, "speed sensor"},
    {0x7320, "position sensor"},
    {0x7500, "communication module"},
    {0x8000, "monitoring"},
    {0x8100, "communication"},
    {0x8110, "CAN overrun, objects lost"},
    {0x8120, "CAN error-passive"},
    {0x8130, "life guard or heartbeat error"},
    {0x8140, "recovered from bus-off"},
    {0x8150, "CAN identifier collision"},
    {0x8200, "protocol error"},
    {0x8210, "PDO not processed because of its length"},
    {0x8220, "PDO too long"},
    {0x8230, "multiplexed PDO not processed, its object is not available"},
    {0x8240, "unexpected SYNC data length"},
    {0x8250, "RPDO time-out"},
    {0x8300, "torque control"},
    {0x8311, "excess torque"},
    {0x8331, "torque fault"},
    {0x8400, "velocity controller"},
    {0x8500, "position controller"},
    {0x8600, "positioning controller"},
    {0x8611, "following error"},
    {0x8612, "reference limit"},
    {0x8700, "sync controller"},
    {0x8800, "winding controller"},
    {0x8900, "process data monitoring"},
    {0x8A00, "control monitoring"},
    {0x9000, "external error"},
    {0xF000, "additional functions"},
    {0xFF00, "device specific"},
};

const char* find(std::uint16_t code) {
  const auto* found = std::ranges::lower_bound(codes, code, {}, &CodeText::code);
  return found != std::end(codes) && found->code == code ? found->text : nullptr;
}

}  // namespace

std::optional<Emcy> decode_emcy(const CanFrame& frame) {
  if (!frame.is_classical_data() || frame.size != 8) return std::nullopt;
  const Origin origin = origin_of(frame.id);
  if (origin.service != Service::emcy) return std::nullopt;
  Emcy emcy{.node = origin.node,
            .code = static_cast<std::uint16_t>(load(frame.bytes(), 2)),
            .error_register = frame.data[2]};
  std::copy_n(frame.data.begin() + 3, emcy.manufacturer.size(), emcy.manufacturer.begin());
  return emcy;
}

CanFrame emcy_frame(const Emcy& emcy) {
  CanFrame frame{.id = emcy_cob_id(emcy.node), .size = 8};
  store(emcy.code, frame.data, 2);
  frame.data[2] = emcy.error_register;
  std::ranges::copy(emcy.manufacturer, frame.data.begin() + 3);
  return frame;
}

const char* emcy_text(std::uint16_t code) {
  for (const std::uint32_t mask : {0xFFFFU, 0xFFF0U, 0xFF00U, 0xF000U}) {
    const char* found = find(static_cast<std::uint16_t>(code & mask));
    if (found != nullptr) return found;
  }
  return "an error class that CiA 301 does not know";
}

const char* error_register_text(std::uint8_t bit) {
  switch (bit) {
    case 0:
      return "generic error";
    case 1:
      return "current";
    case 2:
      return "voltage";
    case 3:
      return "temperature";
    case 4:
      return "communication";
    case 5:
      return "device profile";
    case 6:
      return "reserved";
    case 7:
      return "manufacturer";
    default:
      return "no such bit";
  }
}

}  // namespace alces::canopen
