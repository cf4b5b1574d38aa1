#include "alces_offline/candump_lines.h"

#include <fmt/core.h>

#include <charconv>
#include <vector>

#include "alces_offline/error.h"
#include "alces_offline/input_file.h"

namespace alces::offline {
namespace {

using Path = std::filesystem::path;

// Flags in the eight digits of an identifier (linux/can.h).
constexpr std::uint32_t error_flag = 0x20000000;
constexpr std::uint32_t extended_mask = 0x1FFFFFFF;
constexpr std::uint32_t standard_mask = 0x7FF;

class LineReader {
 public:
  LineReader(const Path& file, std::size_t line, std::string_view text) : file_(file), text_(text) {
    frame_.line = line;
  }

  CandumpLine run() {
    read_stamp();
    frame_.channel = word("a CAN interface such as can0");
    std::string_view next = word("a CAN identifier");
    if (next == "RX" || next == "TX") {  // candump -x: direction and flags
      for (int flag = 0; flag < 2; ++flag) {
        const std::string_view value = word("a flag (- B E)");
        if (value == "B") frame_.frame.is_bit_rate_switched = true;
        if (value == "E") frame_.frame.is_error_state_indicated = true;
      }
      next = word("a CAN identifier");
    }
    if (const std::size_t hash = next.find('#'); hash != std::string_view::npos) {
      read_id(next.substr(0, hash));
      read_log_data(next.substr(hash + 1));
    } else {
      read_id(next);
      read_screen_data();
    }
    return frame_;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(file_, frame_.line, what); }

  void skip_blanks() {
    while (!text_.empty() && (text_.front() == ' ' || text_.front() == '\t')) text_.remove_prefix(1);
  }

  std::string_view word(const char* expected) {
    skip_blanks();
    if (text_.empty()) fail(fmt::format("ends where {} should be", expected));
    const std::size_t end = std::min(text_.find_first_of(" \t"), text_.size());
    const std::string_view result = text_.substr(0, end);
    text_.remove_prefix(end);
    return result;
  }

  void read_stamp() {
    skip_blanks();
    if (!text_.starts_with('(')) return;
    const std::size_t end = text_.find(')');
    if (end == std::string_view::npos) fail("a time without its closing ')'");
    std::string_view stamp = text_.substr(1, end - 1);
    text_.remove_prefix(end + 1);
    while (stamp.starts_with(' ')) stamp.remove_prefix(1);
    double seconds = 0;
    if (const std::size_t blank = stamp.find(' ');
        blank != std::string_view::npos) {  // -t A: 2009-03-04 17:03:10.123456
      seconds = days(stamp.substr(0, blank)) * 86400;
      stamp.remove_prefix(blank + 1);
      if (stamp.size() < 8 || stamp[2] != ':' || stamp[5] != ':') fail("a date without a time of day");
      seconds +=
          number(stamp.substr(0, 2)) * 3600 + number(stamp.substr(3, 2)) * 60 + number(stamp.substr(6));
    } else {
      seconds = number(stamp);
    }
    frame_.stamp_s = seconds;
  }

  double number(std::string_view text) const {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size())
      fail(fmt::format("'{}' is no time in seconds", text));
    return value;
  }

  double days(std::string_view date) const {
    if (date.size() != 10 || date[4] != '-' || date[7] != '-') fail(fmt::format("'{}' is no date", date));
    // days from civil, years that begin in March
    const auto month = static_cast<int>(number(date.substr(5, 2)));
    const int year = static_cast<int>(number(date.substr(0, 4))) - (month <= 2 ? 1 : 0);
    const int day_of_year =
        (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + static_cast<int>(number(date.substr(8, 2))) - 1;
    return year * 365 + year / 4 - year / 100 + year / 400 + day_of_year - 719468;
  }

  void read_id(std::string_view digits) {
    std::uint32_t id = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), id, 16);
    const bool is_hex = error == std::errc{} && end == digits.data() + digits.size();
    if (!is_hex || (digits.size() != 3 && digits.size() != 8)) {
      fail(fmt::format("'{}' is no CAN identifier (3 or 8 hexadecimal digits)", digits));
    }
    CanFrame& frame = frame_.frame;
    frame.is_error = digits.size() == 8 && (id & error_flag) != 0;
    frame.is_extended = digits.size() == 8 && !frame.is_error;
    frame.id = digits.size() == 8 ? id & extended_mask : id;
    if (digits.size() == 3 && id > standard_mask)
      fail(fmt::format("identifier {} is more than 11 bits", digits));
  }

  static int digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return -1;
  }

  void append_byte(std::string_view digits) {
    CanFrame& frame = frame_.frame;
    const int high = digits.size() == 2 ? digit(digits[0]) : -1;
    const int low = digits.size() == 2 ? digit(digits[1]) : -1;
    if (high < 0 || low < 0) fail(fmt::format("'{}' is no byte of two hexadecimal digits", digits));
    if (frame.size >= (frame.is_fd ? 64 : 8))
      fail(fmt::format("more than {} bytes in a frame", frame.is_fd ? 64 : 8));
    frame.data[frame.size++] = static_cast<std::uint8_t>(16 * high + low);
  }

  void read_log_data(std::string_view data) {
    CanFrame& frame = frame_.frame;
    if (data.starts_with('#')) {
      const int flags = data.size() > 1 ? digit(data[1]) : -1;
      if (flags < 0) fail("an FD frame without its flags digit after '##'");
      frame.is_fd = true;
      frame.is_bit_rate_switched = (flags & 1) != 0;
      frame.is_error_state_indicated = (flags & 2) != 0;
      data.remove_prefix(2);
    } else if (data.starts_with('R') || data.starts_with('r')) {
      frame.is_remote = true;
      if (data.size() > 1) {
        const int size = digit(data[1]);
        if (size < 0 || size > 8 || (data.size() > 2 && data[2] != '_'))
          fail(fmt::format("'{}' is no length of a remote frame", data));
        frame.size = static_cast<std::uint8_t>(size);
      }
      return;
    }
    if (const std::size_t raw_length = data.find('_'); raw_length != std::string_view::npos)
      data = data.substr(0, raw_length);
    while (!data.empty()) {
      if (data.front() == '.') {  // cansend's optional separators
        data.remove_prefix(1);
        continue;
      }
      append_byte(data.substr(0, std::min<std::size_t>(2, data.size())));
      data.remove_prefix(2);
    }
  }

  void read_screen_data() {
    CanFrame& frame = frame_.frame;
    const std::string_view brackets = word("the length in brackets");
    unsigned length = 0;
    const bool is_bracketed = brackets.size() >= 3 && (brackets.front() == '[' || brackets.front() == '{') &&
                              (brackets.back() == ']' || brackets.back() == '}');
    if (!is_bracketed) fail(fmt::format("'{}' is no length such as [8]", brackets));
    const std::string_view digits = brackets.substr(1, brackets.size() - 2);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), length);
    if (error != std::errc{} || end != digits.data() + digits.size() || length > CanFrame::maximum_bytes) {
      fail(fmt::format("'{}' is no length of a CAN frame", brackets));
    }
    frame.is_fd = digits.size() == 2;  // candump writes FD lengths with two digits
    if (!frame.is_fd && length > 8) fail(fmt::format("{} bytes in a classical frame", length));
    skip_blanks();
    if (text_.starts_with("remote request")) {
      frame.is_remote = true;
      frame.size = static_cast<std::uint8_t>(length);
      return;
    }
    while (frame.size < length) {
      skip_blanks();
      if (text_.empty()) fail(fmt::format("has {} of {} bytes: the line is cut", frame.size, length));
      append_byte(word("a byte"));
    }
    skip_blanks();
    const bool is_extra = !text_.empty() && text_.front() != '\'' && !text_.starts_with("ERRORFRAME");
    if (is_extra) fail(fmt::format("goes on after its {} bytes: '{}'", length, text_));
  }

  const Path& file_;
  std::string_view text_;
  CandumpLine frame_;
};

}  // namespace

std::size_t read_candump(const Path& file, const std::function<void(const CandumpLine&)>& take) {
  std::string content;
  read_file(file, content);
  std::string_view rest = content;
  std::size_t frames = 0;
  for (std::size_t number = 1; !rest.empty(); ++number) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ' || line.back() == '\t'))
      line.remove_suffix(1);
    const bool is_detail = line.starts_with('\t');  // candump -e
    if (line.empty() || line.front() == '#' || is_detail) continue;
    take(LineReader(file, number, line).run());
    ++frames;
  }
  if (frames == 0) throw InputError(file, "holds no CAN frame; candump's text is needed here");
  return frames;
}

}  // namespace alces::offline
