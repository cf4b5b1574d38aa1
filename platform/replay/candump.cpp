#include "alces_platform/replay/candump.h"

#include <algorithm>
#include <utility>

#include "alces_drivers/stamp.h"
#include "alces_platform/replay/candump_line.h"

namespace alces::replay {
namespace {

constexpr std::size_t lines_looked_ahead = 64;

}  // namespace

CandumpReader::CandumpReader(const std::filesystem::path& file, CandumpOptions options)
    : lines_(file), options_(std::move(options)) {
  for (std::size_t bus = 0; bus < std::min(options_.interfaces.size(), interfaces_.size()); ++bus)
    interfaces_[bus] = options_.interfaces[bus];
}

bool CandumpReader::is_frame(std::string_view line, Event& event) {
  CandumpLine parsed;
  if (!parse_candump_line(line, parsed).empty()) return false;
  event = {};
  event.kind = parsed.is_sent ? EventKind::can_sent : EventKind::can_frame;
  event.frame = parsed.frame;
  return true;
}

int CandumpReader::bus_of(std::string_view interface) {
  if (const auto known = std::ranges::find(interfaces_, interface); known != interfaces_.end())
    return static_cast<int>(known - interfaces_.begin());
  if (!options_.interfaces.empty()) return -1;
  const int digit = interface.back() - '0';
  const bool is_numbered = digit >= 0 && digit < static_cast<int>(interfaces_.size()) &&
                           (interface.size() < 2 || hex_digit(interface[interface.size() - 2]) < 0 ||
                            hex_digit(interface[interface.size() - 2]) > 9);
  if (is_numbered && interfaces_[static_cast<std::size_t>(digit)].empty()) {
    interfaces_[static_cast<std::size_t>(digit)] = interface;
    return digit;
  }
  const auto free = std::ranges::find(interfaces_, "");
  if (free == interfaces_.end()) return -1;
  *free = interface;
  return static_cast<int>(free - interfaces_.begin());
}

bool CandumpReader::read(Read& read) {
  std::string_view text;
  while (lines_.next(text)) {
    if (is_candump_remark(text)) continue;
    CandumpLine line;
    if (const std::string wrong = parse_candump_line(text, line); !wrong.empty()) {
      problems_.add(lines_.problem(wrong));
      continue;
    }
    const int bus = bus_of(line.interface);
    if (bus < 0) {
      problems_.add(lines_.problem("an interface that is none of the configured ones, or the fifth"));
      continue;
    }
    read = {};
    read.event.kind = line.is_sent ? EventKind::can_sent : EventKind::can_frame;
    read.event.channel = static_cast<std::uint8_t>(bus);
    read.event.stamp_ns = line.stamp_ns.value_or(0);
    read.event.frame = line.frame;
    read.has_stamp = line.stamp_ns.has_value();
    read.may_be_difference = line.may_be_difference;
    return true;
  }
  return false;
}

/// Are the stamps differences? They are when one is smaller than the one before.
void CandumpReader::read_ahead() {
  looked_ahead_ = true;
  are_differences_ = options_.stamps == CandumpOptions::Stamps::differences;
  if (options_.stamps != CandumpOptions::Stamps::automatic) return;
  bool is_smaller = false;
  Read one;
  while (ahead_.size() < lines_looked_ahead && read(one)) {
    if (!ahead_.empty() && one.has_stamp && one.event.stamp_ns < ahead_.back().event.stamp_ns)
      is_smaller = true;
    const bool could_be = one.has_stamp && one.may_be_difference;
    ahead_.push_back(one);
    if (!could_be) return;  // absolute, or none at all
  }
  are_differences_ = is_smaller;
}

bool CandumpReader::next(Event& event) {
  if (!looked_ahead_) read_ahead();
  Read one;
  if (!ahead_.empty()) {
    one = ahead_.front();
    ahead_.pop_front();
  } else if (!read(one)) {
    return false;
  }
  event = one.event;
  if (!one.has_stamp) {
    event.stamp_ns = is_first_ ? 0 : last_stamp_ns_ + options_.pace_ns;
  } else if (are_differences_) {
    event.stamp_ns = (is_first_ ? 0 : last_stamp_ns_) + one.event.stamp_ns;
  }
  last_stamp_ns_ = event.stamp_ns;
  is_first_ = false;
  return true;
}

void append_candump(std::string& text, const Event& event, std::string_view interface) {
  constexpr const char* digits = "0123456789ABCDEF";
  const CanFrame& frame = event.frame;
  text += '(';
  append_seconds(text, event.stamp_ns, 6, 10, '0');
  text += ") ";
  text += interface;
  text += ' ';
  const std::uint32_t id = frame.id | (frame.is_error ? candump_error_flag : 0);
  const int id_digits = frame.is_extended || frame.is_error ? 8 : 3;
  for (int digit = id_digits - 1; digit >= 0; --digit) text += digits[(id >> (4 * digit)) & 0xf];
  text += '#';
  if (frame.is_remote && !frame.is_fd) {
    text += 'R';
    if (frame.size > 0 && frame.size <= 8) text += digits[frame.size];
  } else {
    if (frame.is_fd) {
      text += '#';
      text += digits[(frame.is_bit_rate_switched ? candump_bit_rate_switch_flag : 0) |
                     (frame.is_error_state_indicated ? candump_error_state_flag : 0)];
    }
    for (const std::uint8_t byte :
         std::span(frame.data).first(std::min(frame.size, CanFrame::maximum_bytes))) {
      text += digits[byte >> 4];
      text += digits[byte & 0xf];
    }
  }
  text += event.kind == EventKind::can_sent ? " T\n" : " R\n";
}

}  // namespace alces::replay
