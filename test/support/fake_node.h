// A small CANopen node with a CiA 402 drive in profile velocity mode, for the tests of the drivers: an object
// dictionary behind an SDO server, NMT, heartbeat, EMCY, PDOs as they were mapped. It insists on the order of
// PDO set-up.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alces_drivers/can_frame.h"
#include "alces_drivers/canopen/bytes.h"
#include "alces_drivers/canopen/cob_id.h"
#include "alces_drivers/canopen/emcy.h"
#include "alces_drivers/canopen/nmt.h"
#include "alces_drivers/motor/cia402.h"
#include "alces_drivers/port/can_port.h"
#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/stamp.h"

namespace alces::test {

/// Keeps what was sent; takes nothing when it is full.
struct FakeCanPort final : CanPort {
  bool is_full = false;
  std::optional<std::uint32_t> refused_id;
  std::vector<CanFrame> sent;

  bool send(const CanFrame& frame) override {
    if (is_full || frame.id == refused_id) return false;
    sent.push_back(frame);
    return true;
  }
};

struct NoticeLog final : NoticePort {
  std::vector<Notice> notices;

  void raise(const Notice& notice) override { notices.push_back(notice); }
  [[nodiscard]] std::size_t count(const std::string& part) const {
    return static_cast<std::size_t>(std::count_if(notices.begin(), notices.end(), [&](const Notice& notice) {
      return std::string(notice.text).find(part) != std::string::npos;
    }));
  }
};

class FakeNode {
 public:
  using Address = std::pair<std::uint16_t, std::uint8_t>;

  // What it does wrong.
  bool is_present = true;
  bool answers_sdo = true;
  bool is_fault_for_ever = false;
  bool beats = true;
  bool sends_pdos = true;
  bool obeys_controlword = true;
  bool insists_on_rpdo_bit_30 = false;  ///< refuses COB-IDs of RPDOs without it
  std::uint16_t axis = 0;               ///< its profile's objects are 0x6000 + 0x800 * axis and following
  std::int64_t boot_time_ns = 50 * ns_per_ms;
  std::map<Address, std::uint32_t> aborts;  ///< objects that it refuses, with the abort code
  std::optional<std::int32_t> velocity_override;
  std::optional<std::uint8_t> mode_display_override;
  double acceleration_units_per_s = 20000;

  std::uint8_t node;
  std::map<Address, std::vector<std::uint8_t>> objects;
  canopen::NmtState nmt = canopen::NmtState::pre_operational;
  cia402::State drive = cia402::State::switch_on_disabled;
  double velocity_units = 0;
  double position_counts = 0;
  std::uint16_t controlword = 0;
  std::int32_t target_velocity_units = 0;
  std::deque<CanFrame> out;                   ///< to the bus
  std::vector<canopen::ObjectWrite> written;  ///< by SDO, accepted
  std::vector<cia402::State> walked;          ///< the states it went through
  int boots = 0;

  explicit FakeNode(std::uint8_t number) : node(number) { restore_communication(); }

  void set(std::uint16_t index, std::uint8_t subindex, std::uint8_t size, std::uint32_t value) {
    std::vector<std::uint8_t> bytes(size);
    canopen::store(value, bytes, size);
    objects[{index, subindex}] = bytes;
  }
  [[nodiscard]] std::uint32_t get(std::uint16_t index, std::uint8_t subindex) const {
    const auto found = objects.find({index, subindex});
    return found == objects.end() ? 0 : canopen::load(found->second, 4);
  }

  /// Power lost and back: a boot-up message after boot_time_ns.
  void restart(std::int64_t now_ns, bool is_whole_node = true) {
    if (is_whole_node) {
      go(cia402::State::switch_on_disabled);
      velocity_units = 0;
    }
    restore_communication();
    nmt = canopen::NmtState::unknown;
    boot_at_ns_ = now_ns + boot_time_ns;
  }

  void raise_fault(std::uint16_t code) {
    go(cia402::State::fault);
    set(0x603F, 0, 2, code);
    out.push_back(canopen::emcy_frame({.node = node, .code = code, .error_register = 1}));
  }

  void on_frame(const CanFrame& frame, std::int64_t now_ns) {
    if (!is_present) return;
    if (const auto order = canopen::decode_nmt(frame)) {
      if (order->node == 0 || order->node == node) on_order(order->command, now_ns);
      return;
    }
    if (nmt == canopen::NmtState::unknown) return;
    if (frame.id == canopen::sdo_request_cob_id(node) && answers_sdo && frame.size == 8) on_sdo(frame);
    if (nmt != canopen::NmtState::operational) return;
    if (frame.id == canopen::sync_cob_id) on_sync();
    for (std::uint16_t number = 0; number < 4; ++number) on_rpdo(number, frame);
  }

  void tick(std::int64_t now_ns) {
    const double elapsed_s = last_tick_ns_ == no_stamp_ns ? 0 : seconds(now_ns - last_tick_ns_);
    last_tick_ns_ = now_ns;
    if (!is_present) return;
    move(elapsed_s);
    if (nmt == canopen::NmtState::unknown && now_ns >= boot_at_ns_) {
      nmt = canopen::NmtState::pre_operational;
      ++boots;
      beat_at_ns_ = now_ns;
      out.push_back(canopen::heartbeat_frame(node, canopen::NmtState::boot_up));
    }
    const std::int64_t period_ns = std::int64_t{get(0x1017, 0)} * ns_per_ms;
    if (nmt != canopen::NmtState::unknown && period_ns > 0 && now_ns >= beat_at_ns_ + period_ns) {
      beat_at_ns_ = now_ns;
      if (beats) out.push_back(canopen::heartbeat_frame(node, nmt));
    }
  }

  [[nodiscard]] std::uint16_t statusword() const {
    using cia402::State;
    switch (drive) {
      case State::switch_on_disabled:
        return 0x0250;
      case State::ready_to_switch_on:
        return 0x0231;
      case State::switched_on:
        return 0x0233;
      case State::operation_enabled:
        return 0x0237;
      case State::quick_stop_active:
        return 0x0217;
      case State::fault:
        return 0x0218;
      case State::fault_reaction_active:
        return 0x021F;
      default:
        return 0x0210;
    }
  }

 private:
  void restore_communication() {
    std::erase_if(objects, [](const auto& object) {
      return object.first.first >= 0x1400 && object.first.first < 0x1C00;
    });
    if (objects.find({0x1000, 0}) == objects.end()) set(0x1000, 0, 4, 0x00020192);
    set(0x1017, 0, 2, 0);
    for (std::uint16_t number = 0; number < 4; ++number) {
      const auto at = [&](int base) { return static_cast<std::uint16_t>(base + number); };
      const auto pdo = static_cast<std::uint16_t>(number + 1);
      set(at(0x1400), 1, 4, canopen::rpdo_cob_id(pdo, node));
      set(at(0x1400), 2, 1, 255);
      set(at(0x1600), 0, 1, 0);
      set(at(0x1800), 1, 4, canopen::tpdo_cob_id(pdo, node) | 0x40000000U);
      set(at(0x1800), 2, 1, 255);
      set(at(0x1A00), 0, 1, 0);
    }
  }

  void go(cia402::State state) {
    if (state != drive) walked.push_back(state);
    drive = state;
  }

  void on_order(canopen::NmtCommand command, std::int64_t now_ns) {
    using canopen::NmtCommand;
    using canopen::NmtState;
    switch (command) {
      case NmtCommand::reset_node:
        restart(now_ns);
        break;
      case NmtCommand::reset_communication:
        restart(now_ns, false);
        break;
      default:
        if (nmt == NmtState::unknown) break;
        nmt = command == NmtCommand::start  ? NmtState::operational
              : command == NmtCommand::stop ? NmtState::stopped
                                            : NmtState::pre_operational;
    }
  }

  /// An object of the profile as the first axis has it; others: themselves.
  [[nodiscard]] std::uint16_t first_axis(std::uint16_t index) const {
    return index >= 0x6000 + 0x800 * axis && index < 0x6800 + 0x800 * axis
               ? static_cast<std::uint16_t>(index - 0x800 * axis)
           : index >= 0x6000 && index < 0xA000 ? std::uint16_t{0}
                                               : index;
  }

  [[nodiscard]] std::uint32_t value_of(std::uint16_t index, std::uint8_t subindex) const {
    switch (first_axis(index)) {
      case 0x6041:
        return statusword();
      case 0x6061:
        return mode_display_override.value_or(
            static_cast<std::uint8_t>(get(static_cast<std::uint16_t>(0x6060 + 0x800 * axis), 0)));
      case 0x6064:
        return static_cast<std::uint32_t>(static_cast<std::int64_t>(position_counts));
      case 0x606C:
        return static_cast<std::uint32_t>(
            velocity_override.value_or(static_cast<std::int32_t>(velocity_units)));
      default:
        return get(index, subindex);
    }
  }

  // SDO server
  // ------------------------------------------------------------------------------------------------------

  void answer(std::uint8_t command, Address object, std::uint32_t value) {
    CanFrame frame{.id = canopen::sdo_response_cob_id(node), .size = 8};
    frame.data[0] = command;
    frame.data[1] = static_cast<std::uint8_t>(object.first);
    frame.data[2] = static_cast<std::uint8_t>(object.first >> 8);
    frame.data[3] = object.second;
    canopen::store(value, std::span(frame.data).subspan(4), 4);
    out.push_back(frame);
  }

  [[nodiscard]] std::uint32_t refuses(Address object, std::uint32_t value) const {
    const auto found = aborts.find(object);
    if (found != aborts.end()) return found->second;
    const auto [index, subindex] = object;
    const bool is_mapping = (index >= 0x1600 && index < 0x1800) || (index >= 0x1A00 && index < 0x1C00);
    if (is_mapping) {
      const auto communication = static_cast<std::uint16_t>(index - 0x200);
      if ((get(communication, 1) & 0x80000000U) == 0) return 0x08000022;  // switch the PDO off first
      if (subindex > 0 && get(index, 0) != 0) return 0x06010003;          // no entries first
    }
    if (insists_on_rpdo_bit_30 && subindex == 1 && index >= 0x1400 && index < 0x1600 &&
        (value & 0x40000000U) == 0)
      return 0x06090030;
    const bool is_cob_id =
        subindex == 1 && ((index >= 0x1400 && index < 0x1600) || (index >= 0x1800 && index < 0x1A00));
    if (is_cob_id && index >= 0x1800 && (value & 0x40000000U) == 0)
      return 0x06090030;  // no remote frames here
    return 0;
  }

  void on_sdo(const CanFrame& frame) {
    const Address object{static_cast<std::uint16_t>(frame.data[1] | frame.data[2] << 8), frame.data[3]};
    const std::uint8_t command = frame.data[0];
    const auto data = std::span(frame.data).subspan(4, 4);
    switch (command >> 5) {
      case 1:  // download
        if ((command & 2) != 0) {
          const auto size = static_cast<std::uint8_t>(4 - (command >> 2 & 3));
          const std::uint32_t value = canopen::load(data, size);
          if (const std::uint32_t code = refuses(object, value)) return answer(0x80, object, code);
          set(object.first, object.second, size, value);
          written.push_back({object.first, object.second, size, value});
          if (first_axis(object.first) == 0x6040) {
            next_controlword_ = static_cast<std::uint16_t>(value);
            apply();
          }
        } else {
          segmented_ = object;
          objects[object].clear();
          toggle_ = 0;
        }
        return answer(0x60, object, 0);
      case 0: {  // download segment
        auto& bytes = objects[segmented_];
        bytes.insert(bytes.end(), frame.data.begin() + 1, frame.data.begin() + 8 - (command >> 1 & 7));
        return answer(static_cast<std::uint8_t>(0x20 | (command & 0x10)), {0, 0}, 0);
      }
      case 2: {  // upload
        const auto found = aborts.find(object);
        if (found != aborts.end()) return answer(0x80, object, found->second);
        const auto known = objects.find(object);
        if (known != objects.end() && known->second.size() > 4) {
          segmented_ = object;
          offset_ = 0;
          return answer(0x41, object, static_cast<std::uint32_t>(known->second.size()));
        }
        const std::uint16_t first = first_axis(object.first);
        const bool is_live = first == 0x6041 || first == 0x6061 || first == 0x6064 || first == 0x606C;
        if (known == objects.end() && !is_live) return answer(0x80, object, 0x06020000);
        const std::size_t size = is_live ? (first == 0x6061   ? 1
                                            : first == 0x6041 ? 2
                                                              : 4)
                                         : known->second.size();
        return answer(static_cast<std::uint8_t>(0x43 | (4 - size) << 2), object,
                      value_of(object.first, object.second));
      }
      case 3: {  // upload segment
        const auto& bytes = objects[segmented_];
        const std::size_t size = std::min<std::size_t>(bytes.size() - offset_, 7);
        CanFrame reply{.id = canopen::sdo_response_cob_id(node), .size = 8};
        const bool is_last = offset_ + size == bytes.size();
        reply.data[0] = static_cast<std::uint8_t>((command & 0x10) | (7 - size) << 1 | (is_last ? 1 : 0));
        std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(offset_), size, reply.data.begin() + 1);
        offset_ += size;
        out.push_back(reply);
        return;
      }
      default:
        return;  // an abort
    }
  }

  // PDOs
  // ------------------------------------------------------------------------------------------------------------

  template <class Visit>
  void visit_mapping(std::uint16_t mapping, Visit visit) const {
    std::size_t bit = 0;
    for (std::uint8_t entry = 1; entry <= get(mapping, 0); ++entry) {
      const std::uint32_t value = get(mapping, entry);
      visit(static_cast<std::uint16_t>(value >> 16), static_cast<std::uint8_t>(value >> 8), bit / 8,
            (value & 0xFF) / 8);
      bit += value & 0xFF;
    }
  }

  void on_rpdo(std::uint16_t number, const CanFrame& frame) {
    const auto communication = static_cast<std::uint16_t>(0x1400 + number);
    const std::uint32_t cob_id = get(communication, 1);
    if ((cob_id & 0x80000000U) != 0 || frame.id != (cob_id & 0x7FF)) return;
    visit_mapping(static_cast<std::uint16_t>(0x1600 + number), [&](std::uint16_t index, std::uint8_t,
                                                                   std::size_t byte, std::size_t size) {
      const std::uint32_t value = canopen::load(std::span(frame.data).subspan(byte, size), size);
      if (first_axis(index) == 0x6040) next_controlword_ = static_cast<std::uint16_t>(value);
      if (first_axis(index) == 0x60FF) next_target_ = static_cast<std::int32_t>(value);
    });
    if (get(communication, 2) > 240) apply();
  }

  void on_sync() {
    apply();
    ++syncs_;
    for (std::uint16_t number = 0; number < 4; ++number) {
      const auto communication = static_cast<std::uint16_t>(0x1800 + number);
      const std::uint32_t cob_id = get(communication, 1);
      const std::uint32_t type = get(communication, 2);
      if ((cob_id & 0x80000000U) != 0 || type < 1 || type > 240 || syncs_ % type != 0 || !sends_pdos)
        continue;
      CanFrame frame{.id = cob_id & 0x7FF};
      visit_mapping(static_cast<std::uint16_t>(0x1A00 + number),
                    [&](std::uint16_t index, std::uint8_t subindex, std::size_t byte, std::size_t size) {
                      canopen::store(value_of(index, subindex), std::span(frame.data).subspan(byte, size),
                                     size);
                      frame.size = static_cast<std::uint8_t>(byte + size);
                    });
      if (frame.size > 0) out.push_back(frame);
    }
  }

  void apply() {
    using cia402::State;
    const std::uint16_t before = controlword;
    controlword = next_controlword_;
    target_velocity_units = next_target_;
    if (!obeys_controlword) return;
    if (drive == State::fault) {
      const bool is_edge = (controlword & 0x80) != 0 && (before & 0x80) == 0;
      if (!is_edge || is_fault_for_ever) return;
      out.push_back(canopen::emcy_frame({.node = node}));
      set(0x603F, 0, 2, 0);
      return go(State::switch_on_disabled);
    }
    const bool is_on = drive == State::ready_to_switch_on || drive == State::switched_on ||
                       drive == State::operation_enabled || drive == State::quick_stop_active;
    if ((controlword & 2) == 0) {
      if (is_on) go(State::switch_on_disabled);
    } else if ((controlword & 4) == 0) {
      if (drive == State::operation_enabled) {
        go(State::quick_stop_active);
      } else if (is_on && drive != State::quick_stop_active) {
        go(State::switch_on_disabled);
      }
    } else if (drive != State::quick_stop_active) {
      switch (controlword & 0x0F) {
        case 0x06:
        case 0x0E:
          go(State::ready_to_switch_on);
          break;
        case 0x07:
          if (drive != State::switch_on_disabled) go(State::switched_on);
          break;
        case 0x0F:
          if (drive == State::switched_on) {
            go(State::operation_enabled);
          } else if (drive == State::ready_to_switch_on) {
            go(State::switched_on);
          }
          break;
        default:
          break;
      }
    }
  }

  void move(double elapsed_s) {
    using cia402::State;
    const double goal = drive == State::operation_enabled ? target_velocity_units : 0;
    const double step = acceleration_units_per_s * elapsed_s;
    velocity_units += std::clamp(goal - velocity_units, -step, step);
    position_counts += velocity_units * elapsed_s;
    if (drive == State::quick_stop_active && velocity_units == 0) go(State::switch_on_disabled);
  }

  std::int64_t boot_at_ns_ = 0;
  std::int64_t beat_at_ns_ = 0;
  std::int64_t last_tick_ns_ = no_stamp_ns;
  Address segmented_;
  std::size_t offset_ = 0;
  int toggle_ = 0;
  std::uint16_t next_controlword_ = 0;
  std::int32_t next_target_ = 0;
  std::uint32_t syncs_ = 0;
};

/// The bytes of a frame as candump's screen text writes them: "601   [8]  40 41 60 00 00 00 00 00".
inline std::optional<CanFrame> parse_candump(const std::string& line) {
  const std::size_t open = line.find('[');
  const std::size_t close = line.find(']');
  if (open == std::string::npos || close == std::string::npos) return std::nullopt;
  CanFrame frame;
  const std::string head = line.substr(0, open);
  const std::size_t end = head.find_last_not_of(' ');
  const std::size_t begin = head.find_last_of(' ', end) + 1;
  frame.id =
      static_cast<std::uint32_t>(std::strtoul(head.substr(begin, end + 1 - begin).c_str(), nullptr, 16));
  frame.size = static_cast<std::uint8_t>(std::strtoul(line.c_str() + open + 1, nullptr, 10));
  if (frame.size > 8) return std::nullopt;
  const char* text = line.c_str() + close + 1;
  for (std::size_t byte = 0; byte < frame.size; ++byte) {
    char* next = nullptr;
    frame.data[byte] = static_cast<std::uint8_t>(std::strtoul(text, &next, 16));
    if (next == text) return std::nullopt;
    text = next;
  }
  return frame;
}

}  // namespace alces::test
