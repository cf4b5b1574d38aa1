#include "alces_platform/replay/candump.h"

#include <algorithm>
#include <utility>

#include "alces_drivers/stamp.h"

namespace alces::replay {
namespace {

constexpr std::uint32_t error_flag = 0x2000'0000;  // CAN_ERR_FLAG
constexpr std::uint32_t id_mask = 0x1fff'ffff;
constexpr std::uint8_t bit_rate_switch_flag = 1;  // CANFD_BRS
constexpr std::uint8_t error_state_flag = 2;      // CANFD_ESI
constexpr std::size_t lines_looked_ahead = 64;

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

bool parse_id(std::string_view digits, CanFrame& frame) {
  std::uint64_t id = 0;
  if ((digits.size() != 3 && digits.size() != 8) || !parse_unsigned(digits, id, 16)) return false;
  frame.is_extended = digits.size() == 8 && (id & error_flag) == 0;
  frame.is_error = digits.size() == 8 && (id & error_flag) != 0;
  frame.id = static_cast<std::uint32_t>(id) & id_mask;
  return digits.size() == 3 ? id <= 0x7ff : id <= (error_flag | id_mask);
}

bool append_byte(CanFrame& frame, std::string_view text, int base) {
  std::uint64_t byte = 0;
  if (frame.size >= (frame.is_fd ? CanFrame::maximum_bytes : 8) || !parse_unsigned(text, byte, base) ||
      byte > 255)
    return false;
  frame.data[frame.size++] = static_cast<std::uint8_t>(byte);
  return true;
}

/// "181#2104", "181#R4", "12345678##5AABB", "123#1122334455667788_B"; dots between bytes are allowed.
bool parse_log_frame(std::string_view text, CanFrame& frame) {
  const std::size_t mark = text.find('#');
  if (mark == std::string_view::npos || !parse_id(text.substr(0, mark), frame)) return false;
  text.remove_prefix(mark + 1);
  if (!text.empty() && (text.front() == 'R' || text.front() == 'r')) {
    frame.is_remote = true;
    text.remove_prefix(1);
    if (text.empty()) return true;
    const int size = hex_digit(text.front());
    if (size < 0 || size > 8 || (text.size() > 1 && text[1] != '_')) return false;
    frame.size = static_cast<std::uint8_t>(size);
    return true;
  }
  if (!text.empty() && text.front() == '#') {
    const int flags = text.size() > 1 ? hex_digit(text[1]) : -1;
    if (flags < 0) return false;
    frame.is_fd = true;
    frame.is_bit_rate_switched = (flags & bit_rate_switch_flag) != 0;
    frame.is_error_state_indicated = (flags & error_state_flag) != 0;
    text.remove_prefix(2);
  }
  while (!text.empty()) {
    if (text.front() == '.') text.remove_prefix(1);
    if (text.front() == '_' && text.size() == 2) return true;  // a raw length above 8
    if (text.size() < 2 || !append_byte(frame, text.substr(0, 2), 16)) return false;
    text.remove_prefix(2);
  }
  return true;
}

/// "[8]", "[08]" for FD, "{B}" for a raw length above 8.
bool parse_size(std::string_view text, std::size_t& size, bool& is_fd) {
  if (text.size() < 3) return false;
  const std::string_view digits = text.substr(1, text.size() - 2);
  std::uint64_t value = 0;
  if (text.front() == '{' && text.back() == '}') {
    size = 8;
    is_fd = false;
    return parse_unsigned(digits, value, 16);
  }
  if (text.front() != '[' || text.back() != ']' || !parse_unsigned(digits, value)) return false;
  is_fd = digits.size() == 2;
  size = value;
  return value <= (is_fd ? CanFrame::maximum_bytes : 8);
}

/// "44`33`22`11" with -S, as one word: the last byte first.
bool parse_swapped(std::string_view text, CanFrame& frame, std::size_t size) {
  const std::size_t width = text.find('`') == std::string_view::npos ? text.size() : text.find('`');
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t at = (size - 1 - i) * (width + 1);
    if (at + width > text.size() || !append_byte(frame, text.substr(at, width), width == 8 ? 2 : 16))
      return false;
  }
  return true;
}

/// Behind the interface: "  RX B E  181   [8]  21 04 ...", "remote request", what -a and -e add is passed
/// over.
bool parse_screen_frame(std::string_view word, Words& words, CanFrame& frame, bool& is_sent) {
  if (word == "RX" || word == "TX") {
    is_sent = word == "TX";
    word = words.next();
    // two columns of flags, of which candump shows the FD ones
    for (int column = 0; column < 2 && (word == "-" || word == "B" || word == "E"); ++column) {
      frame.is_bit_rate_switched = frame.is_bit_rate_switched || word == "B";
      frame.is_error_state_indicated = frame.is_error_state_indicated || word == "E";
      word = words.next();
    }
  }
  std::size_t size = 0;
  bool is_fd = false;
  if (!parse_id(word, frame) || !parse_size(words.next(), size, is_fd)) return false;
  frame.is_fd = is_fd;
  if (!is_fd) frame.is_bit_rate_switched = frame.is_error_state_indicated = false;
  for (std::size_t i = 0; i < size; ++i) {
    word = words.next();
    if (i == 0 && word == "remote") {
      frame.is_remote = true;
      frame.size = static_cast<std::uint8_t>(size);
      return words.next() == "request";
    }
    if (i == 0 && word.find('`') != std::string_view::npos) return parse_swapped(word, frame, size);
    if ((word.size() != 2 && word.size() != 8) || !append_byte(frame, word, word.size() == 8 ? 2 : 16))
      return false;
  }
  if (size == 0) frame.is_remote = words.next() == "remote";
  return true;
}

struct Line {
  CanFrame frame;
  std::string_view interface;
  bool is_sent = false;
  bool has_stamp = false;
  bool may_be_difference = false;
  std::int64_t stamp_ns = 0;
};

bool parse_line(std::string_view text, Line& line) {
  Words words(text);
  if (const std::string_view stamp = words.bracketed('(', ')'); !stamp.empty()) {
    line.has_stamp = parse_seconds(stamp, line.stamp_ns);
    line.may_be_difference = line.has_stamp && stamp.find('.') < 9;  // absolute ones have ten digits
    if (!line.has_stamp) line.has_stamp = parse_date(stamp, line.stamp_ns);
    if (!line.has_stamp) return false;
  }
  line.interface = words.next();
  const std::string_view word = words.next();
  if (word.find('#') != std::string_view::npos) {
    line.may_be_difference = false;
    if (!parse_log_frame(word, line.frame)) return false;
    line.is_sent = words.next() == "T";
    return true;
  }
  return parse_screen_frame(word, words, line.frame, line.is_sent);
}

/// What candump says besides frames: explanations of error frames, empty lines, comments.
bool is_remark(std::string_view line) {
  return line.empty() || line.front() == '\t' || line.front() == '#' || line.front() == ';' ||
         line.find_first_not_of(' ') == std::string_view::npos;
}

}  // namespace

CandumpReader::CandumpReader(const std::filesystem::path& file, CandumpOptions options)
    : lines_(file), options_(std::move(options)) {
  for (std::size_t bus = 0; bus < std::min(options_.interfaces.size(), interfaces_.size()); ++bus)
    interfaces_[bus] = options_.interfaces[bus];
}

bool CandumpReader::is_frame(std::string_view line, Event& event) {
  Line parsed;
  if (!parse_line(line, parsed)) return false;
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
    if (is_remark(text)) continue;
    Line line;
    if (!parse_line(text, line)) {
      problems_.add(lines_.problem(text.starts_with("DROPCOUNT:") ? "candump lost frames here"
                                                                  : "this is no frame as candump writes it"));
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
    read.event.stamp_ns = line.stamp_ns;
    read.event.frame = line.frame;
    read.has_stamp = line.has_stamp;
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
  const std::uint32_t id = frame.id | (frame.is_error ? error_flag : 0);
  const int id_digits = frame.is_extended || frame.is_error ? 8 : 3;
  for (int digit = id_digits - 1; digit >= 0; --digit) text += digits[(id >> (4 * digit)) & 0xf];
  text += '#';
  if (frame.is_remote && !frame.is_fd) {
    text += 'R';
    if (frame.size > 0 && frame.size <= 8) text += digits[frame.size];
  } else {
    if (frame.is_fd) {
      text += '#';
      text += digits[(frame.is_bit_rate_switched ? bit_rate_switch_flag : 0) |
                     (frame.is_error_state_indicated ? error_state_flag : 0)];
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
