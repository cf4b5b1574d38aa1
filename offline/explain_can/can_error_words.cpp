#include "can_error_words.h"

#include <fmt/core.h>

#include <span>
#include <vector>

namespace alces::offline {
namespace {

struct Bit {
  unsigned mask;
  const char* text;
};

// Classes, in the identifier.
constexpr unsigned transmit_timeout = 0x001;
constexpr unsigned lost_arbitration = 0x002;
constexpr unsigned controller = 0x004;
constexpr unsigned protocol = 0x008;
constexpr unsigned transceiver = 0x010;
constexpr unsigned no_acknowledge = 0x020;
constexpr unsigned bus_off = 0x040;
constexpr unsigned bus_error = 0x080;
constexpr unsigned restarted = 0x100;
constexpr unsigned counters = 0x200;
constexpr unsigned every_class = 0x3FF;

constexpr Bit controller_bits[] = {
    {0x01, "receive buffer overflow"},
    {0x02, "transmit buffer overflow"},
    {0x04, "error warning level reached by receive errors"},
    {0x08, "error warning level reached by transmit errors"},
    {0x10, "error-passive by receive errors"},
    {0x20, "error-passive by transmit errors"},
    {0x40, "error-active again"},
};
constexpr Bit protocol_bits[] = {
    {0x01, "single bit error"},
    {0x02, "frame format error"},
    {0x04, "bit stuffing error"},
    {0x08, "dominant bit could not be sent"},
    {0x10, "recessive bit could not be sent"},
    {0x20, "bus overload"},
    {0x40, "active error announcement"},
    {0x80, "while transmitting"},
};

std::string list(unsigned value, std::span<const Bit> bits) {
  std::string text;
  for (const Bit& bit : bits) {
    if ((value & bit.mask) != 0) text += (text.empty() ? "" : ", ") + std::string(bit.text);
  }
  return text.empty() ? "unspecified" : text;
}

const char* place(unsigned location) {
  switch (location) {
    case 0x03:
      return "start of frame";
    case 0x02:
    case 0x06:
    case 0x07:
    case 0x0F:
    case 0x0E:
      return "identifier";
    case 0x04:
      return "SRR bit";
    case 0x05:
      return "IDE bit";
    case 0x0C:
      return "RTR bit";
    case 0x0D:
    case 0x09:
      return "reserved bit";
    case 0x0B:
      return "data length";
    case 0x0A:
      return "data";
    case 0x08:
      return "CRC";
    case 0x18:
      return "CRC delimiter";
    case 0x19:
      return "acknowledge slot";
    case 0x1B:
      return "acknowledge delimiter";
    case 0x1A:
      return "end of frame";
    case 0x12:
      return "intermission";
    default:
      return "unspecified place";
  }
}

}  // namespace

std::string can_error_words(const CanFrame& frame) {
  std::vector<std::string> parts;
  const unsigned id = frame.id;
  if ((id & transmit_timeout) != 0) parts.emplace_back("transmission timed out");
  if ((id & lost_arbitration) != 0) {
    parts.push_back(frame.data[0] == 0 ? "lost arbitration"
                                       : fmt::format("lost arbitration in bit {}", frame.data[0]));
  }
  if ((id & controller) != 0) parts.push_back("controller: " + list(frame.data[1], controller_bits));
  if ((id & protocol) != 0) {
    parts.push_back(
        fmt::format("protocol violation: {} ({})", list(frame.data[2], protocol_bits), place(frame.data[3])));
  }
  if ((id & transceiver) != 0) parts.push_back(fmt::format("transceiver status 0x{:02X}", frame.data[4]));
  if ((id & no_acknowledge) != 0)
    parts.emplace_back("no acknowledgement: nobody else is on the bus, or the cable is broken");
  if ((id & bus_off) != 0) parts.emplace_back("bus off: the controller has left the bus");
  if ((id & bus_error) != 0) parts.emplace_back("bus error");
  if ((id & restarted) != 0) parts.emplace_back("controller restarted");
  if ((id & counters) != 0 ||
      ((id & (controller | bus_error)) != 0 && (frame.data[6] | frame.data[7]) != 0)) {
    parts.push_back(
        fmt::format("{} transmit errors, {} receive errors counted", frame.data[6], frame.data[7]));
  }
  if ((id & ~every_class) != 0) parts.push_back(fmt::format("unknown class 0x{:X}", id & ~every_class));
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : "; ") + part;
  return text.empty() ? "no class told" : text;
}

}  // namespace alces::offline
