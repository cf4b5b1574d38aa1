#include "canopen_objects.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <iterator>
#include <vector>

#include "alces_drivers/canopen/emcy.h"
#include "alces_drivers/canopen/sdo_abort.h"

namespace alces::offline {
namespace {

constexpr std::uint16_t boolean = 1;
constexpr std::uint16_t i8 = 2;
constexpr std::uint16_t i16 = 3;
constexpr std::uint16_t i32 = 4;
constexpr std::uint16_t u8 = 5;
constexpr std::uint16_t u16 = 6;
constexpr std::uint16_t u32 = 7;
constexpr std::uint16_t real32 = 8;
constexpr std::uint16_t visible_string = 9;
constexpr std::uint16_t domain = 15;
constexpr std::uint16_t real64 = 0x11;

/// An object of CiA 301 or 402: a range of indices and of sub-indices that share a meaning.
struct Known {
  std::uint16_t first;
  std::uint16_t last;
  int sub;  ///< -1: every one from 1 on
  std::uint16_t type;
  const char* name;
};

constexpr Known known[] = {
    {0x1000, 0x1000, 0, u32, "device type"},
    {0x1001, 0x1001, 0, u8, "error register"},
    {0x1002, 0x1002, 0, u32, "manufacturer status register"},
    {0x1003, 0x1003, 0, u8, "number of errors"},
    {0x1003, 0x1003, -1, u32, "error history"},
    {0x1005, 0x1005, 0, u32, "COB-ID SYNC"},
    {0x1006, 0x1006, 0, u32, "communication cycle period"},
    {0x1007, 0x1007, 0, u32, "synchronous window length"},
    {0x1008, 0x1008, 0, visible_string, "device name"},
    {0x1009, 0x1009, 0, visible_string, "hardware version"},
    {0x100A, 0x100A, 0, visible_string, "software version"},
    {0x100C, 0x100C, 0, u16, "guard time"},
    {0x100D, 0x100D, 0, u8, "life time factor"},
    {0x1010, 0x1010, -1, u32, "store parameters"},
    {0x1011, 0x1011, -1, u32, "restore default parameters"},
    {0x1012, 0x1012, 0, u32, "COB-ID TIME"},
    {0x1014, 0x1014, 0, u32, "COB-ID EMCY"},
    {0x1015, 0x1015, 0, u16, "inhibit time EMCY"},
    {0x1016, 0x1016, -1, u32, "consumer heartbeat time"},
    {0x1017, 0x1017, 0, u16, "producer heartbeat time"},
    {0x1018, 0x1018, 1, u32, "vendor id"},
    {0x1018, 0x1018, 2, u32, "product code"},
    {0x1018, 0x1018, 3, u32, "revision number"},
    {0x1018, 0x1018, 4, u32, "serial number"},
    {0x1019, 0x1019, 0, u8, "synchronous counter overflow"},
    {0x1029, 0x1029, -1, u8, "error behaviour"},
    {0x1200, 0x127F, 1, u32, "SDO server COB-ID client to server"},
    {0x1200, 0x127F, 2, u32, "SDO server COB-ID server to client"},
    {0x1400, 0x15FF, 1, u32, "COB-ID"},
    {0x1400, 0x15FF, 2, u8, "transmission type"},
    {0x1400, 0x15FF, 3, u16, "inhibit time"},
    {0x1400, 0x15FF, 5, u16, "event timer"},
    {0x1600, 0x17FF, 0, u8, "number of mapped objects"},
    {0x1600, 0x17FF, -1, u32, "mapped object"},
    {0x1800, 0x19FF, 1, u32, "COB-ID"},
    {0x1800, 0x19FF, 2, u8, "transmission type"},
    {0x1800, 0x19FF, 3, u16, "inhibit time"},
    {0x1800, 0x19FF, 5, u16, "event timer"},
    {0x1800, 0x19FF, 6, u8, "SYNC start value"},
    {0x1A00, 0x1BFF, 0, u8, "number of mapped objects"},
    {0x1A00, 0x1BFF, -1, u32, "mapped object"},
    {0x6007, 0x6007, 0, i16, "abort connection option code"},
    {0x603F, 0x603F, 0, u16, "error code"},
    {0x6040, 0x6040, 0, u16, "controlword"},
    {0x6041, 0x6041, 0, u16, "statusword"},
    {0x605A, 0x605A, 0, i16, "quick stop option code"},
    {0x605B, 0x605B, 0, i16, "shutdown option code"},
    {0x605C, 0x605C, 0, i16, "disable operation option code"},
    {0x605D, 0x605D, 0, i16, "halt option code"},
    {0x605E, 0x605E, 0, i16, "fault reaction option code"},
    {0x6060, 0x6060, 0, i8, "mode of operation"},
    {0x6061, 0x6061, 0, i8, "mode of operation display"},
    {0x6062, 0x6062, 0, i32, "position demand value"},
    {0x6063, 0x6063, 0, i32, "position actual internal value"},
    {0x6064, 0x6064, 0, i32, "position actual value"},
    {0x6065, 0x6065, 0, u32, "following error window"},
    {0x6066, 0x6066, 0, u16, "following error time out"},
    {0x6067, 0x6067, 0, u32, "position window"},
    {0x6068, 0x6068, 0, u16, "position window time"},
    {0x6069, 0x6069, 0, i32, "velocity sensor actual value"},
    {0x606B, 0x606B, 0, i32, "velocity demand value"},
    {0x606C, 0x606C, 0, i32, "velocity actual value"},
    {0x606D, 0x606D, 0, u16, "velocity window"},
    {0x606E, 0x606E, 0, u16, "velocity window time"},
    {0x606F, 0x606F, 0, u16, "velocity threshold"},
    {0x6070, 0x6070, 0, u16, "velocity threshold time"},
    {0x6071, 0x6071, 0, i16, "target torque"},
    {0x6072, 0x6072, 0, u16, "max torque"},
    {0x6073, 0x6073, 0, u16, "max current"},
    {0x6074, 0x6074, 0, i16, "torque demand"},
    {0x6075, 0x6075, 0, u32, "motor rated current"},
    {0x6076, 0x6076, 0, u32, "motor rated torque"},
    {0x6077, 0x6077, 0, i16, "torque actual value"},
    {0x6078, 0x6078, 0, i16, "current actual value"},
    {0x6079, 0x6079, 0, u32, "DC link circuit voltage"},
    {0x607A, 0x607A, 0, i32, "target position"},
    {0x607C, 0x607C, 0, i32, "home offset"},
    {0x607D, 0x607D, 1, i32, "min position limit"},
    {0x607D, 0x607D, 2, i32, "max position limit"},
    {0x607E, 0x607E, 0, u8, "polarity"},
    {0x607F, 0x607F, 0, u32, "max profile velocity"},
    {0x6080, 0x6080, 0, u32, "max motor speed"},
    {0x6081, 0x6081, 0, u32, "profile velocity"},
    {0x6082, 0x6082, 0, u32, "end velocity"},
    {0x6083, 0x6083, 0, u32, "profile acceleration"},
    {0x6084, 0x6084, 0, u32, "profile deceleration"},
    {0x6085, 0x6085, 0, u32, "quick stop deceleration"},
    {0x6086, 0x6086, 0, i16, "motion profile type"},
    {0x608F, 0x608F, 1, u32, "encoder increments"},
    {0x608F, 0x608F, 2, u32, "motor revolutions of the encoder resolution"},
    {0x6091, 0x6091, 1, u32, "motor shaft revolutions of the gear ratio"},
    {0x6091, 0x6091, 2, u32, "driving shaft revolutions of the gear ratio"},
    {0x6098, 0x6098, 0, i8, "homing method"},
    {0x60B0, 0x60B0, 0, i32, "position offset"},
    {0x60B1, 0x60B1, 0, i32, "velocity offset"},
    {0x60B2, 0x60B2, 0, i16, "torque offset"},
    {0x60F4, 0x60F4, 0, i32, "following error actual value"},
    {0x60FD, 0x60FD, 0, u32, "digital inputs"},
    {0x60FE, 0x60FE, 1, u32, "physical outputs"},
    {0x60FF, 0x60FF, 0, i32, "target velocity"},
    {0x6402, 0x6402, 0, u16, "motor type"},
    {0x6502, 0x6502, 0, u32, "supported drive modes"},
};

const Known* find_known(std::uint16_t index, std::uint8_t sub) {
  const auto* found = std::ranges::find_if(known, [&](const Known& object) {
    return index >= object.first && index <= object.last &&
           (object.sub == sub || (object.sub < 0 && sub > 0));
  });
  return found == std::end(known) ? nullptr : found;
}

bool is_between(std::uint16_t index, std::uint16_t first, std::uint16_t last) {
  return index >= first && index <= last;
}
bool is_communication(std::uint16_t index) {
  return is_between(index, 0x1400, 0x15FF) || is_between(index, 0x1800, 0x19FF);
}
bool is_mapping(std::uint16_t index) {
  return is_between(index, 0x1600, 0x17FF) || is_between(index, 0x1A00, 0x1BFF);
}

/// "RPDO1" of 0x1400 and 0x1600, "TPDO2" of 0x1801 and 0x1A01.
std::string pdo_of(std::uint16_t index) {
  const bool is_transmit = index >= 0x1800;
  return fmt::format("{}PDO{}", is_transmit ? 'T' : 'R', (index & 0x1FF) + 1);
}

const char* mode_name(std::int64_t mode) {
  switch (mode) {
    case 0:
      return "no mode";
    case 1:
      return "profile position";
    case 2:
      return "velocity";
    case 3:
      return "profile velocity";
    case 4:
      return "profile torque";
    case 6:
      return "homing";
    case 7:
      return "interpolated position";
    case 8:
      return "cyclic synchronous position";
    case 9:
      return "cyclic synchronous velocity";
    case 10:
      return "cyclic synchronous torque";
    default:
      return mode < 0 ? "manufacturer's mode" : "reserved mode";
  }
}

std::string joined(const std::vector<std::string>& parts) {
  std::string result;
  for (const std::string& part : parts) result += (result.empty() ? "" : ", ") + part;
  return result;
}

std::string supported_modes(std::uint32_t bits) {
  std::vector<std::string> modes;
  for (int bit = 0; bit < 10; ++bit) {
    if ((bits >> bit & 1) != 0) modes.emplace_back(mode_name(bit + 1));
  }
  return fmt::format("0x{:08X} ({})", bits, modes.empty() ? "none" : joined(modes));
}

std::string cob_id(std::uint32_t value, bool is_pdo) {
  const std::uint32_t id = value & ((value & 0x20000000) != 0 ? 0x1FFFFFFFU : 0x7FFU);
  std::string words = fmt::format("0x{:03X}, {}", id, (value & 0x80000000) != 0 ? "off" : "on");
  if (is_pdo && (value & 0x40000000) != 0) words += ", no remote requests";
  return words;
}

std::string transmission_type(std::int64_t type, bool is_transmit) {
  if (type > 240 && type < (is_transmit ? 252 : 254)) return fmt::format("{} (reserved)", type);
  if (!is_transmit)
    return fmt::format("{} ({})", type, type <= 240 ? "taken at the next SYNC" : "taken at once");
  if (type == 0) return "0 (at SYNC, when changed)";
  if (type == 1) return "1 (at every SYNC)";
  if (type <= 240) return fmt::format("{} (once in {} SYNCs)", type, type);
  if (type == 252) return "252 (sampled at SYNC, sent on remote request)";
  if (type == 253) return "253 (on remote request)";
  return fmt::format("{} ({}'s events)", type, type == 254 ? "the manufacturer" : "the device profile");
}

std::string signature(std::uint32_t value) {
  if (value == 0x65766173) return "\"save\"";
  if (value == 0x64616F6C) return "\"load\"";
  return fmt::format("0x{:08X}", value);
}

std::string quoted(ObjectBytes bytes) {
  std::string text = "\"";
  for (const std::uint8_t byte : bytes) {
    if (byte >= 0x20 && byte < 0x7F && byte != '"' && byte != '\\') {
      text += static_cast<char>(byte);
    } else {
      text += fmt::format("\\x{:02X}", byte);
    }
  }
  return text + '"';
}

std::string raw(ObjectBytes bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += fmt::format("{}{:02X}", text.empty() ? "" : " ", byte);
  return text.empty() ? "no bytes" : text;
}

bool is_signed(std::uint16_t type) {
  return (type >= i8 && type <= i32) || type == 0x10 || (type >= 0x12 && type <= 0x15);
}

}  // namespace

std::int64_t object_number(ObjectBytes bytes, std::uint16_t data_type) {
  std::uint64_t bits = 0;
  const std::size_t size = std::min<std::size_t>(bytes.size(), 8);
  for (std::size_t i = 0; i < size; ++i) bits |= std::uint64_t{bytes[i]} << (8 * i);
  if (is_signed(data_type) && size > 0 && size < 8 && (bytes[size - 1] & 0x80) != 0)
    bits |= ~std::uint64_t{0} << (8 * size);
  return static_cast<std::int64_t>(bits);
}

const char* drive_state_text(unsigned statusword) {
  switch (statusword & 0x4F) {
    case 0x00:
      return "not ready to switch on";
    case 0x40:
      return "switch on disabled";
    case 0x0F:
      return "fault reaction active";
    case 0x08:
      return "fault";
    default:
      break;
  }
  switch (statusword & 0x6F) {
    case 0x21:
      return "ready to switch on";
    case 0x23:
      return "switched on";
    case 0x27:
      return "operation enabled";
    case 0x07:
      return "quick stop active";
    default:
      return "no state of CiA 402";
  }
}

bool is_drive_fault(unsigned statusword) {
  return (statusword & 0x4F) == 0x08 || (statusword & 0x4F) == 0x0F;
}

std::string statusword_text(unsigned statusword, std::optional<int> mode) {
  constexpr int profile_position = 1;
  constexpr int profile_velocity = 3;
  constexpr int homing = 6;
  std::vector<std::string> flags;
  const auto flag = [&](unsigned bit, const char* name) {
    if ((statusword >> bit & 1) != 0) flags.emplace_back(name);
  };
  flag(4, "voltage enabled");
  flag(7, "warning");
  flag(8, "bit 8");
  flag(9, "remote");
  flag(10, "target reached");
  flag(11, "internal limit active");
  flag(12, mode == profile_velocity   ? "speed is 0"
           : mode == profile_position ? "set-point acknowledged"
           : mode == homing           ? "homing attained"
                                      : "bit 12");
  flag(13, mode == profile_velocity   ? "slippage too large"
           : mode == profile_position ? "following error"
           : mode == homing           ? "homing error"
                                      : "bit 13");
  flag(14, "bit 14");
  flag(15, "bit 15");
  return fmt::format("0x{:04X} ({}{}{})", statusword, drive_state_text(statusword), flags.empty() ? "" : "; ",
                     joined(flags));
}

std::string controlword_text(unsigned controlword) {
  const char* command = "";
  if ((controlword & 0x80) != 0) {
    command = "fault reset";
  } else if ((controlword & 0x02) == 0) {
    command = "disable voltage";
  } else if ((controlword & 0x04) == 0) {
    command = "quick stop";
  } else if ((controlword & 0x01) == 0) {
    command = "shutdown";
  } else {
    command = (controlword & 0x08) != 0 ? "enable operation" : "switch on";
  }
  std::vector<std::string> flags;
  for (const unsigned bit : {4U, 5U, 6U}) {
    if ((controlword >> bit & 1) != 0) flags.push_back(fmt::format("mode's bit {}", bit));
  }
  if ((controlword & 0x100) != 0) flags.emplace_back("halt");
  for (const unsigned bit : {9U, 10U, 11U, 12U, 13U, 14U, 15U}) {
    if ((controlword >> bit & 1) != 0) flags.push_back(fmt::format("bit {}", bit));
  }
  return fmt::format("0x{:04X} ({}{}{})", controlword, command, flags.empty() ? "" : "; ", joined(flags));
}

std::string error_register_text(unsigned error_register) {
  std::vector<std::string> bits;
  for (unsigned bit = 0; bit < 8; ++bit) {
    if ((error_register >> bit & 1) != 0)
      bits.emplace_back(canopen::error_register_text(static_cast<std::uint8_t>(bit)));
  }
  return fmt::format("0x{:02X} ({})", error_register, bits.empty() ? "no error" : joined(bits));
}

std::string CanopenObjects::name(std::uint16_t index, std::uint8_t sub) const {
  std::string of_pdo;
  if (is_communication(index) || is_mapping(index)) of_pdo = pdo_of(index) + " ";
  const Known* object = find_known(index, sub);
  if (object != nullptr) {
    const bool counts = object->sub < 0;
    return of_pdo + object->name + (counts ? fmt::format(" {}", sub) : "");
  }
  if (file_ != nullptr) {
    const std::string_view whole = file_->name(index);
    const ObjectDescription* own = file_->find(index, sub);
    const bool has_own = own != nullptr && !own->name.empty();
    if (has_own && own->name != whole && !whole.empty()) return fmt::format("{}: {}", whole, own->name);
    if (has_own) return own->name;
    if (!whole.empty()) return std::string(whole);
  }
  if (sub == 0 && find_known(index, 1) != nullptr) return of_pdo + "number of entries";
  return of_pdo.empty() ? "unknown object" : of_pdo + "parameter";
}

std::string CanopenObjects::title(std::uint16_t index, std::uint8_t sub) const {
  const bool has_subs = sub != 0 || is_communication(index) || is_mapping(index) ||
                        find_known(index, 1) != nullptr ||
                        (file_ != nullptr && file_->find(index, 1) != nullptr);
  return has_subs ? fmt::format("0x{:04X}:{} {}", index, sub, name(index, sub))
                  : fmt::format("0x{:04X} {}", index, name(index, sub));
}

std::uint16_t CanopenObjects::data_type(std::uint16_t index, std::uint8_t sub) const {
  if (file_ != nullptr) {
    const ObjectDescription* object = file_->find(index, sub);
    if (object != nullptr && object->data_type != 0) return object->data_type;
  }
  const Known* object = find_known(index, sub);
  if (object != nullptr) return object->type;
  return sub == 0 && find_known(index, 1) != nullptr ? u8 : std::uint16_t{0};
}

std::string CanopenObjects::words(std::uint16_t index, std::uint8_t sub, ObjectBytes bytes,
                                  std::optional<int> mode) const {
  const std::uint16_t type = data_type(index, sub);
  if (type == visible_string) return quoted(bytes);
  if (bytes.empty() || bytes.size() > 8) return raw(bytes);
  const std::int64_t number = object_number(bytes, type);
  const auto bits = static_cast<std::uint32_t>(number);
  switch (index) {
    case 0x1000:
      return fmt::format("0x{:08X} (device profile {})", bits, bits & 0xFFFF);
    case 0x1001:
      return error_register_text(bits & 0xFF);
    case 0x1003:
      if (sub == 0) break;
      return fmt::format("0x{:04X} ({})", bits & 0xFFFF,
                         canopen::emcy_text(static_cast<std::uint16_t>(bits & 0xFFFF)));
    case 0x1005:
      return fmt::format("0x{:03X}{}", bits & 0x7FF, (bits & 0x40000000) != 0 ? ", produces SYNC" : "");
    case 0x1010:
    case 0x1011:
      if (sub == 0) break;
      return signature(bits);
    case 0x1014:
      return cob_id(bits, false);
    case 0x1016:
      if (sub == 0) break;
      return bits == 0 ? "0 (off)" : fmt::format("node {} every {} ms", bits >> 16 & 0x7F, bits & 0xFFFF);
    case 0x1017:
      return bits == 0 ? "0 ms (off)" : fmt::format("{} ms", bits);
    case 0x603F:
      return fmt::format("0x{:04X} ({})", bits & 0xFFFF,
                         canopen::emcy_text(static_cast<std::uint16_t>(bits & 0xFFFF)));
    case 0x6040:
      return controlword_text(bits & 0xFFFF);
    case 0x6041:
      return statusword_text(bits & 0xFFFF, mode);
    case 0x6060:
    case 0x6061:
      return fmt::format("{} ({})", number, mode_name(number));
    case 0x6502:
      return supported_modes(bits);
    default:
      break;
  }
  if (is_communication(index) && sub == 1) return cob_id(bits, true);
  if (is_communication(index) && sub == 2) return transmission_type(number, index >= 0x1800);
  if (is_communication(index) && sub == 3) return fmt::format("{:g} ms", static_cast<double>(number) / 10);
  if (is_communication(index) && sub == 5) return number == 0 ? "0 ms (off)" : fmt::format("{} ms", number);
  if (is_mapping(index) && sub > 0) {
    if (bits == 0) return "nothing";
    return fmt::format(
        "{}, {} bits",
        title(static_cast<std::uint16_t>(bits >> 16), static_cast<std::uint8_t>(bits >> 8 & 0xFF)),
        bits & 0xFF);
  }
  if (type == boolean) return number != 0 ? "true" : "false";
  if (type == real32 && bytes.size() == 4) return fmt::format("{}", std::bit_cast<float>(bits));
  if (type == real64 && bytes.size() == 8) return fmt::format("{}", std::bit_cast<double>(number));
  if (type >= visible_string && type <= domain) return raw(bytes);
  if (is_signed(type) || (number >= 0 && number <= 9)) return fmt::format("{}", number);
  return fmt::format("{} (0x{:0{}X})", static_cast<std::uint64_t>(number), static_cast<std::uint64_t>(number),
                     2 * bytes.size());
}

}  // namespace alces::offline
