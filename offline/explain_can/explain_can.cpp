#include "explain_can.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "alces_drivers/canopen/emcy.h"
#include "alces_drivers/canopen/sdo_abort.h"
#include "can_error_words.h"
#include "canopen_objects.h"
#include "explain_sdo.h"

namespace alces::offline {
namespace {

using Values = std::map<std::uint32_t, std::int64_t>;

constexpr std::uint16_t receive_communication = 0x1400;
constexpr std::uint16_t transmit_communication = 0x1800;
constexpr std::uint16_t mapping_offset = 0x200;  // 0x1600 belongs to 0x1400, 0x1A00 to 0x1800
constexpr std::uint16_t pdo_limit = 512;
constexpr std::int64_t off_bit = std::int64_t{1} << 31;
constexpr std::int64_t save_signature = 0x65766173;

std::uint32_t key_of(std::uint16_t index, std::uint8_t sub) {
  return static_cast<std::uint32_t>(index) << 8 | sub;
}

/// Function codes of the predefined connection set: 0x180 TPDO1, 0x200 RPDO1, 0x280 TPDO2, ...
std::optional<std::uint16_t> predefined_pdo(std::uint32_t id) {
  const std::uint32_t code = id >> 7;
  constexpr std::uint32_t first = 3;  // 0x180
  constexpr std::uint32_t last = 10;  // 0x500
  if (code < first || code > last || (id & 0x7F) == 0) return std::nullopt;
  const bool is_transmit = code % 2 == 1;
  const auto number = static_cast<std::uint16_t>((code - first) / 2);
  return static_cast<std::uint16_t>((is_transmit ? transmit_communication : receive_communication) + number);
}

bool is_transmit_pdo(std::uint16_t communication) {
  return communication >= transmit_communication;
}

const char* nmt_state_text(unsigned state) {
  switch (state) {
    case 0x00:
      return "boot-up";
    case 0x04:
      return "stopped";
    case 0x05:
      return "operational";
    case 0x7F:
      return "pre-operational";
    default:
      return nullptr;
  }
}

std::string hex_bytes(ObjectBytes bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += fmt::format("{}{:02X}", text.empty() ? "" : " ", byte);
  return text;
}

const char* layer_setting_text(unsigned command) {
  switch (command) {
    case 0x04:
      return "switch state global";
    case 0x11:
      return "configure node number";
    case 0x13:
      return "configure bit timing";
    case 0x15:
      return "activate bit timing";
    case 0x17:
      return "store configuration";
    case 0x40:
    case 0x41:
    case 0x42:
    case 0x43:
    case 0x44:
      return "switch state selective";
    case 0x46:
    case 0x47:
    case 0x48:
    case 0x49:
    case 0x4A:
    case 0x4B:
    case 0x4C:
    case 0x4F:
    case 0x50:
    case 0x51:
      return "identify";
    case 0x5A:
    case 0x5B:
    case 0x5C:
    case 0x5D:
    case 0x5E:
      return "inquire";
    default:
      return "unknown command";
  }
}

/// Days since 1984-01-01, as CiA 301 counts them.
std::string date_text(unsigned days) {
  unsigned year = 1984;
  const auto is_leap = [](unsigned y) { return y % 4 == 0 && (y % 100 != 0 || y % 400 == 0); };
  while (days >= (is_leap(year) ? 366U : 365U)) days -= is_leap(year++) ? 366U : 365U;
  const unsigned lengths[12] = {31, is_leap(year) ? 29U : 28U, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  unsigned month = 0;
  while (days >= lengths[month]) days -= lengths[month++];
  return fmt::format("{}-{:02}-{:02}", year, month + 1, days + 1);
}

}  // namespace

const char* to_string(CanFrameMeaning meaning) {
  constexpr std::array<const char*, can_frame_meaning_count> texts = {
      "NMT",     "SYNC",      "TIME", "EMCY",   "TPDO",      "RPDO",        "SDO request", "SDO answer",
      "boot-up", "heartbeat", "LSS",  "remote", "bus error", "not CANopen", "unknown"};
  return texts[static_cast<std::size_t>(meaning)];
}

struct CanExplainer::Node {
  Node(std::uint8_t number_of_node, const ObjectDictionaryFile* file_or_null)
      : number(number_of_node), file(file_or_null), objects(file_or_null), sdo(objects) {}
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  [[nodiscard]] std::optional<std::int64_t> value(std::uint16_t index, std::uint8_t sub) const {
    const auto value = learned.find(key_of(index, sub));
    if (value != learned.end()) return value->second;
    return file == nullptr ? std::nullopt : file->value(index, sub, number);
  }
  [[nodiscard]] std::optional<int> mode() const {
    const auto mode = learned.find(key_of(0x6061, 0));
    if (mode == learned.end()) return std::nullopt;
    return static_cast<int>(mode->second);
  }
  /// Its communication begins anew; a drive's own values stay unless the whole node was reset.
  void restart(bool is_whole_node) {
    std::erase_if(learned, [&](const auto& item) { return is_whole_node || item.first >> 8 < 0x2000; });
    for (const auto& item : saved) learned.insert_or_assign(item.first, item.second);
    sdo.reset();
    pdo_ids_are_known = false;
  }
  /// The PDO that is on and has this identifier, as its communication object.
  [[nodiscard]] std::optional<std::uint16_t> pdo_with(std::uint32_t id) {
    if (!pdo_ids_are_known) find_pdo_ids();
    const auto pdo = pdo_ids.find(id);
    if (pdo == pdo_ids.end()) return std::nullopt;
    return pdo->second;
  }
  void find_pdo_ids() {
    pdo_ids_are_known = true;
    pdo_ids.clear();
    for (const std::uint16_t base : {transmit_communication, receive_communication}) {
      for (std::uint16_t pdo = 0; pdo < pdo_limit; ++pdo) {
        const auto communication = static_cast<std::uint16_t>(base + pdo);
        const auto id = value(communication, 1);
        if (id && (*id & off_bit) == 0)
          pdo_ids.try_emplace(static_cast<std::uint32_t>(*id & 0x7FF), communication);
      }
    }
  }

  std::uint8_t number;
  const ObjectDictionaryFile* file;
  CanopenObjects objects;
  SdoConversation sdo;
  Values learned;  ///< read or written in the trace
  Values saved;
  std::map<std::uint32_t, std::uint16_t> pdo_ids;  ///< made anew when an object it depends on changes
  bool pdo_ids_are_known = false;
  std::optional<unsigned> nmt_state;
  bool was_seen = false;
  bool expects_boot_up = false;
  bool is_faulty = false;
};

CanExplainer::CanExplainer(std::shared_ptr<const ObjectDictionaryFile> file, std::optional<std::uint8_t> node)
    : file_(std::move(file)), file_node_(node) {
  if (file_ != nullptr && !file_node_) file_node_ = file_->node();
}
CanExplainer::~CanExplainer() = default;
CanExplainer::CanExplainer(CanExplainer&&) noexcept = default;
CanExplainer& CanExplainer::operator=(CanExplainer&&) noexcept = default;

CanExplainer::Node& CanExplainer::node(std::uint8_t number) {
  std::unique_ptr<Node>& node = nodes_[number];
  const bool is_described = file_ != nullptr && (!file_node_ || *file_node_ == number);
  if (node == nullptr) node = std::make_unique<Node>(number, is_described ? file_.get() : nullptr);
  return *node;
}

CanExplanation CanExplainer::explain(const CanFrame& frame) {
  using enum CanFrameMeaning;
  if (frame.is_error) return {bus_error, 0, true, "bus error: " + can_error_words(frame)};
  if (frame.is_fd)
    return {not_canopen, 0, false,
            fmt::format("CAN FD frame of {} bytes, identifier 0x{:X}", frame.size, frame.id)};
  if (frame.is_extended)
    return {not_canopen, 0, false, fmt::format("29-bit identifier 0x{:08X}, {} bytes", frame.id, frame.size)};
  if (frame.is_remote) return explain_remote(frame);
  if (frame.id == 0x000) return explain_nmt(frame);
  if (frame.id == 0x080) {
    if (frame.size == 0) return {sync, 0, false, "SYNC"};
    if (frame.size == 1) return {sync, 0, false, fmt::format("SYNC, counter {}", frame.data[0])};
    return {sync, 0, true, fmt::format("SYNC of {} bytes: 0 or 1 is allowed", frame.size)};
  }
  if (frame.id == 0x100) return explain_time(frame);
  if (const auto pdo = explain_pdo(frame)) return *pdo;
  if (frame.id > 0x080 && frame.id < 0x100) return explain_emergency(frame);
  if (frame.id > 0x580 && frame.id < 0x680 && frame.id != 0x600) return explain_sdo(frame);
  if (frame.id > 0x700 && frame.id < 0x780) return explain_heartbeat(frame);
  if ((frame.id == 0x7E4 || frame.id == 0x7E5) && frame.size > 0) {
    return {layer_setting, 0, false,
            fmt::format("LSS {}: {}", frame.id == 0x7E5 ? "request" : "answer",
                        layer_setting_text(frame.data[0]))};
  }
  return {unknown, 0, false,
          fmt::format("identifier 0x{:03X} is none of CANopen's: {}", frame.id, hex_bytes(frame.bytes()))};
}

CanExplanation CanExplainer::explain_nmt(const CanFrame& frame) {
  CanExplanation explanation{CanFrameMeaning::nmt, 0, false, ""};
  if (frame.size != 2 || frame.data[1] > 127) {
    explanation.is_abnormal = true;
    explanation.text = fmt::format("NMT frame that is no command: {}", hex_bytes(frame.bytes()));
    return explanation;
  }
  const std::uint8_t number = frame.data[1];
  explanation.node = number;
  const char* command = nullptr;
  std::optional<unsigned> state;
  switch (frame.data[0]) {
    case 0x01:
      command = "start";
      state = 0x05;
      break;
    case 0x02:
      command = "stop";
      state = 0x04;
      break;
    case 0x80:
      command = "enter pre-operational";
      state = 0x7F;
      break;
    case 0x81:
      command = "reset node";
      break;
    case 0x82:
      command = "reset communication";
      break;
    default:
      explanation.is_abnormal = true;
      explanation.text = fmt::format("NMT: unknown command 0x{:02X} to node {}", frame.data[0], number);
      return explanation;
  }
  explanation.text = number == 0 ? fmt::format("NMT to all nodes: {}", command)
                                 : fmt::format("NMT to node {}: {}", number, command);
  const auto apply = [&](Node& commanded) {
    commanded.nmt_state = state;
    if (state) return;
    commanded.expects_boot_up = true;
    commanded.restart(frame.data[0] == 0x81);
  };
  if (number != 0) {
    apply(node(number));
  } else {
    for (const auto& item : nodes_) apply(*item.second);
  }
  return explanation;
}

CanExplanation CanExplainer::explain_time(const CanFrame& frame) const {
  if (frame.size != 6) {
    return {CanFrameMeaning::time, 0, true, fmt::format("TIME of {} bytes, 6 are needed", frame.size)};
  }
  const auto milliseconds = static_cast<std::uint32_t>(object_number(frame.bytes().first(4), 0)) & 0x0FFFFFFF;
  const auto days = static_cast<unsigned>(object_number(frame.bytes().subspan(4, 2), 0));
  const std::uint32_t seconds = milliseconds / 1000;
  return {CanFrameMeaning::time, 0, false,
          fmt::format("TIME: {} {:02}:{:02}:{:02}.{:03}", date_text(days), seconds / 3600, seconds / 60 % 60,
                      seconds % 60, milliseconds % 1000)};
}

CanExplanation CanExplainer::explain_emergency(const CanFrame& frame) {
  const auto number = static_cast<std::uint8_t>(frame.id - 0x080);
  Node& sender = node(number);
  sender.was_seen = true;
  CanExplanation explanation{CanFrameMeaning::emergency, number, true, ""};
  if (frame.size != 8) {
    explanation.text = fmt::format("EMCY of node {} with {} bytes, 8 are needed", number, frame.size);
    return explanation;
  }
  const auto code = static_cast<std::uint16_t>(frame.data[0] | frame.data[1] << 8);
  explanation.is_abnormal = code != 0;
  const bool has_own_bytes = std::any_of(frame.data.begin() + 3, frame.data.begin() + 8,
                                         [](std::uint8_t byte) { return byte != 0; });
  explanation.text =
      fmt::format("EMCY of node {}: 0x{:04X}, {}; error register {}{}", number, code,
                  canopen::emcy_text(code), error_register_text(frame.data[2]),
                  has_own_bytes ? "; manufacturer's bytes " + hex_bytes(frame.bytes().subspan(3)) : "");
  return explanation;
}

CanExplanation CanExplainer::explain_sdo(const CanFrame& frame) {
  const bool is_request = frame.id >= 0x600;
  const auto number = static_cast<std::uint8_t>(frame.id & 0x7F);
  Node& server = node(number);
  if (!is_request) server.was_seen = true;
  SdoWords words = is_request ? server.sdo.on_request(frame.bytes())
                              : server.sdo.on_response(frame.bytes(), server.mode());
  CanExplanation explanation{is_request ? CanFrameMeaning::sdo_request : CanFrameMeaning::sdo_response,
                             number, words.is_abnormal,
                             fmt::format("SDO {} node {}: {}", is_request ? "to" : "of", number, words.text)};
  if (words.done) {
    const SdoTransfer& done = *words.done;
    const std::uint16_t type = server.objects.data_type(done.index, done.sub);
    const bool is_save =
        done.is_write && done.index == 0x1010 && object_number(done.bytes, type) == save_signature;
    if (is_save) {
      server.saved = server.learned;
      std::erase_if(server.saved, [](const auto& item) {
        return item.first == key_of(0x6041, 0) || item.first == key_of(0x6061, 0);
      });
    } else if (done.index != 0x1010 && done.index != 0x1011 && done.bytes.size() <= 8) {
      learn(server, done.index, done.sub, object_number(done.bytes, type), explanation);
    }
  }
  return explanation;
}

void CanExplainer::learn(Node& node, std::uint16_t index, std::uint8_t sub, std::int64_t value,
                         CanExplanation& explanation) {
  node.learned[key_of(index, sub)] = value;
  const std::uint16_t base = index & 0xFE00;
  if (base == receive_communication || base == transmit_communication) node.pdo_ids_are_known = false;
  if (index != 0x6041) return;
  const bool is_faulty = is_drive_fault(static_cast<unsigned>(value & 0xFFFF));
  if (is_faulty && !node.is_faulty) explanation.is_abnormal = true;
  node.is_faulty = is_faulty;
}

CanExplanation CanExplainer::explain_heartbeat(const CanFrame& frame) {
  const auto number = static_cast<std::uint8_t>(frame.id - 0x700);
  Node& sender = node(number);
  CanExplanation explanation{CanFrameMeaning::heartbeat, number, false, ""};
  const unsigned state = frame.data[0] & 0x7F;
  const char* state_text = nmt_state_text(state);
  if (frame.size != 1 || state_text == nullptr) {
    explanation.is_abnormal = true;
    explanation.text =
        fmt::format("heartbeat of node {} that tells no state: {}", number, hex_bytes(frame.bytes()));
    return explanation;
  }
  const std::optional<unsigned> before = std::exchange(sender.nmt_state, state == 0 ? 0x7FU : state);
  if (frame.data[0] == 0) {
    explanation.meaning = CanFrameMeaning::boot_up;
    explanation.text = fmt::format("boot-up of node {}", number);
    const bool by_itself = sender.was_seen && !sender.expects_boot_up;
    if (by_itself) {
      explanation.is_abnormal = true;
      explanation.text += ": it restarted without being told to";
      sender.restart(true);
    }
    sender.expects_boot_up = false;
    sender.was_seen = true;
    return explanation;
  }
  sender.was_seen = true;
  explanation.text = fmt::format("heartbeat of node {}: {}", number, state_text);
  if ((frame.data[0] & 0x80) != 0) explanation.text += " (toggle bit set: answer to node guarding)";
  if (before && *before != state && nmt_state_text(*before) != nullptr) {
    explanation.is_abnormal = true;
    explanation.text += fmt::format(", though it should be {}", nmt_state_text(*before));
  }
  return explanation;
}

CanExplanation CanExplainer::explain_remote(const CanFrame& frame) {
  CanExplanation explanation{CanFrameMeaning::remote, static_cast<std::uint8_t>(frame.id & 0x7F), false, ""};
  const auto pdo = predefined_pdo(frame.id);
  if (frame.id > 0x700 && frame.id < 0x780) {
    explanation.text = fmt::format("node guarding: asks node {} for its state", explanation.node);
  } else if (pdo && is_transmit_pdo(*pdo)) {
    explanation.text =
        fmt::format("asks node {} for TPDO{}", explanation.node, *pdo - transmit_communication + 1);
  } else {
    explanation.node = 0;
    explanation.text = fmt::format("remote request for identifier 0x{:03X}, {} bytes", frame.id, frame.size);
  }
  return explanation;
}

std::optional<CanExplanation> CanExplainer::explain_pdo(const CanFrame& frame) {
  const auto predefined = predefined_pdo(frame.id);
  const auto predefined_node = static_cast<std::uint8_t>(frame.id & 0x7F);
  // A COB-ID that a node is known to have; its own by the predefined set before others'.
  Node* own = predefined ? &node(predefined_node) : nullptr;
  if (own != nullptr) {
    if (const auto pdo = own->pdo_with(frame.id)) return decode_pdo(*own, *pdo, frame, false);
  }
  for (const auto& item : nodes_) {
    if (const auto pdo = item.second->pdo_with(frame.id)) return decode_pdo(*item.second, *pdo, frame, false);
  }
  if (own == nullptr) return std::nullopt;
  const std::int64_t id = own->value(*predefined, 1).value_or(0);
  const bool is_off = (id & off_bit) != 0 && static_cast<std::uint32_t>(id & 0x7FF) == frame.id;
  return decode_pdo(*own, *predefined, frame, is_off);
}

CanExplanation CanExplainer::decode_pdo(Node& node, std::uint16_t communication, const CanFrame& frame,
                                        bool is_off) {
  const bool is_transmit = is_transmit_pdo(communication);
  const int number = communication - (is_transmit ? transmit_communication : receive_communication) + 1;
  CanExplanation explanation{is_transmit ? CanFrameMeaning::tpdo : CanFrameMeaning::rpdo, node.number, false,
                             ""};
  explanation.text = fmt::format("{}PDO{} {} node {}: ", is_transmit ? 'T' : 'R', number,
                                 is_transmit ? "of" : "to", node.number);
  if (is_transmit) node.was_seen = true;
  const auto mapping = static_cast<std::uint16_t>(communication + mapping_offset);
  const std::optional<std::int64_t> count = node.value(mapping, 0);
  std::size_t at = 0;
  bool is_complete = count.has_value();
  for (std::int64_t sub = 1; is_complete && sub <= std::min<std::int64_t>(*count, 64); ++sub) {
    const auto entry = node.value(mapping, static_cast<std::uint8_t>(sub));
    if (!entry) {
      is_complete = false;
      break;
    }
    const auto index = static_cast<std::uint16_t>(*entry >> 16 & 0xFFFF);
    const auto entry_sub = static_cast<std::uint8_t>(*entry >> 8 & 0xFF);
    const auto bits = static_cast<std::size_t>(*entry & 0xFF);
    const std::string name = node.objects.name(index, entry_sub);
    explanation.text += sub > 1 ? ", " : "";
    if (bits % 8 != 0) {
      explanation.text += fmt::format("{} of {} bits", name, bits);
      is_complete = false;
      break;
    }
    if (at + bits / 8 > frame.size) {
      explanation.is_abnormal = true;
      explanation.text += fmt::format("{} is missing: the frame is too short for its mapping", name);
      at = frame.size;
      break;
    }
    const ObjectBytes bytes = frame.bytes().subspan(at, bits / 8);
    at += bits / 8;
    const std::int64_t value = object_number(bytes, node.objects.data_type(index, entry_sub));
    explanation.text += name + " " + node.objects.words(index, entry_sub, bytes, node.mode());
    learn(node, index, entry_sub, value, explanation);
  }
  if (!is_complete) explanation.text += at == 0 ? "mapping not known, " : ", ";
  if (at < frame.size) {
    const std::string rest = hex_bytes(frame.bytes().subspan(at));
    explanation.text += is_complete ? fmt::format("{}{} not mapped", at == 0 ? "" : ", ", rest) : rest;
  } else if (frame.size == 0 && !explanation.is_abnormal) {
    explanation.text += "no bytes";
  }
  if (is_off) {
    const bool by_trace = node.learned.contains(key_of(communication, 1));
    explanation.text += fmt::format(" (this PDO is off, says the {})", by_trace ? "trace" : "DCF");
  }
  return explanation;
}

std::vector<std::string> CanExplainer::open_matters() const {
  std::vector<std::string> matters;
  for (const auto& [number, node] : nodes_) {
    if (const auto asked = node->sdo.unanswered()) {
      matters.push_back(fmt::format("node {} has not answered: {}", number, *asked));
    }
  }
  return matters;
}

std::string candump_text(const CanFrame& frame) {
  constexpr std::uint32_t error_flag = 0x20000000;
  std::string text = frame.is_error      ? fmt::format("{:08X}#", frame.id | error_flag)
                     : frame.is_extended ? fmt::format("{:08X}#", frame.id)
                                         : fmt::format("{:03X}#", frame.id);
  if (frame.is_remote) return text + (frame.size > 0 ? fmt::format("R{}", frame.size) : "R");
  if (frame.is_fd) {
    text +=
        fmt::format("#{:X}", (frame.is_bit_rate_switched ? 1 : 0) | (frame.is_error_state_indicated ? 2 : 0));
  }
  for (const std::uint8_t byte : frame.bytes()) text += fmt::format("{:02X}", byte);
  return text;
}

}  // namespace alces::offline
