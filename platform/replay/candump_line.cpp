#include "alces_platform/replay/candump_line.h"

#include "alces_platform/replay/line_reader.h"

namespace alces::replay {
namespace {

constexpr std::uint32_t id_mask = 0x1fff'ffff;
constexpr std::size_t classical_bytes = 8;

std::string quoted(std::string_view text, std::string_view what) {
  std::string sentence = "'";
  sentence += text;
  sentence += "' ";
  sentence += what;
  return sentence;
}

/// Each step returns what is wrong; empty: nothing.
class LineParser {
 public:
  LineParser(std::string_view text, CandumpLine& line) : words_(text), line_(line), frame_(line.frame) {}

  std::string parse() {
    if (std::string wrong = parse_stamp(); !wrong.empty()) return wrong;
    line_.interface = words_.next();
    if (line_.interface.empty()) return "ends where a CAN interface such as can0 should be";
    std::string_view word = words_.next();
    if (word.find('#') != std::string_view::npos) {
      line_.may_be_difference = false;
      if (std::string wrong = parse_log_frame(word); !wrong.empty()) return wrong;
      line_.is_sent = words_.next() == "T";
      return {};
    }
    if (word == "RX" || word == "TX") {
      line_.is_sent = word == "TX";
      word = words_.next();
      // two columns of flags, of which candump shows the FD ones
      for (int column = 0; column < 2 && (word == "-" || word == "B" || word == "E"); ++column) {
        frame_.is_bit_rate_switched = frame_.is_bit_rate_switched || word == "B";
        frame_.is_error_state_indicated = frame_.is_error_state_indicated || word == "E";
        word = words_.next();
      }
    }
    if (std::string wrong = parse_id(word); !wrong.empty()) return wrong;
    return parse_screen_data();
  }

 private:
  std::string parse_stamp() {
    const std::string_view stamp = words_.bracketed('(', ')');
    if (stamp.empty()) return {};
    std::int64_t stamp_ns = 0;
    if (parse_seconds(stamp, stamp_ns)) {
      line_.may_be_difference = stamp.find('.') < 9;  // absolute ones have ten digits
    } else if (!parse_date(stamp, stamp_ns)) {
      return quoted(stamp, "is no time in seconds and no date");
    }
    line_.stamp_ns = stamp_ns;
    return {};
  }

  std::string parse_id(std::string_view digits) {
    if (digits.empty()) return "ends where a CAN identifier should be";
    std::uint64_t id = 0;
    if ((digits.size() != 3 && digits.size() != 8) || !parse_unsigned(digits, id, 16))
      return quoted(digits, "is no CAN identifier (3 or 8 hexadecimal digits)");
    if (digits.size() == 3 ? id > 0x7ff : id > (candump_error_flag | id_mask))
      return quoted(digits, digits.size() == 3 ? "is more than 11 bits" : "is more than 29 bits");
    frame_.is_error = digits.size() == 8 && (id & candump_error_flag) != 0;
    frame_.is_extended = digits.size() == 8 && !frame_.is_error;
    frame_.id = static_cast<std::uint32_t>(id) & id_mask;
    return {};
  }

  std::string append_byte(std::string_view text, int base) {
    std::uint64_t byte = 0;
    if (!parse_unsigned(text, byte, base) || byte > 255)
      return quoted(text, "is no byte of two hexadecimal digits");
    if (frame_.size >= (frame_.is_fd ? CanFrame::maximum_bytes : classical_bytes))
      return frame_.is_fd ? "more than 64 bytes in a frame" : "more than 8 bytes in a classical frame";
    frame_.data[frame_.size++] = static_cast<std::uint8_t>(byte);
    return {};
  }

  /// "181#2104", "181#R4", "12345678##5AABB", "123#1122334455667788_B"; dots between bytes are allowed.
  std::string parse_log_frame(std::string_view text) {
    const std::size_t mark = text.find('#');
    if (std::string wrong = parse_id(text.substr(0, mark)); !wrong.empty()) return wrong;
    text.remove_prefix(mark + 1);
    if (!text.empty() && (text.front() == 'R' || text.front() == 'r')) return parse_remote_size(text);
    if (!text.empty() && text.front() == '#') {
      const int flags = text.size() > 1 ? hex_digit(text[1]) : -1;
      if (flags < 0) return "an FD frame without its digit of flags after '##'";
      frame_.is_fd = true;
      frame_.is_bit_rate_switched = (flags & candump_bit_rate_switch_flag) != 0;
      frame_.is_error_state_indicated = (flags & candump_error_state_flag) != 0;
      text.remove_prefix(2);
    }
    while (!text.empty()) {
      if (text.front() == '.') text.remove_prefix(1);
      if (text.front() == '_' && text.size() == 2) return {};  // a raw length above 8
      if (text.size() < 2) return quoted(text, "is no byte of two hexadecimal digits");
      if (std::string wrong = append_byte(text.substr(0, 2), 16); !wrong.empty()) return wrong;
      text.remove_prefix(2);
    }
    return {};
  }

  std::string parse_remote_size(std::string_view text) {
    frame_.is_remote = true;
    if (text.size() == 1) return {};
    const int size = hex_digit(text[1]);
    if (size < 0 || size > 8 || (text.size() > 2 && text[2] != '_'))
      return quoted(text, "is no length of a remote frame");
    frame_.size = static_cast<std::uint8_t>(size);
    return {};
  }

  /// "[8]", "[08]" for FD, "{B}" for a raw length above 8.
  std::string parse_size(std::string_view text, std::size_t& size) {
    if (text.empty()) return "ends where the length in brackets should be";
    std::uint64_t value = 0;
    const std::string_view digits = text.size() < 3 ? std::string_view() : text.substr(1, text.size() - 2);
    if (text.front() == '{' && text.back() == '}' && parse_unsigned(digits, value, 16)) {
      size = classical_bytes;
      return {};
    }
    if (text.front() != '[' || text.back() != ']' || !parse_unsigned(digits, value))
      return quoted(text, "is no length such as [8]");
    frame_.is_fd = digits.size() == 2;
    size = value;
    if (value > (frame_.is_fd ? CanFrame::maximum_bytes : classical_bytes))
      return quoted(text, "is no length of a CAN frame");
    return {};
  }

  std::string parse_screen_data() {
    std::size_t size = 0;
    if (std::string wrong = parse_size(words_.next(), size); !wrong.empty()) return wrong;
    if (!frame_.is_fd) frame_.is_bit_rate_switched = frame_.is_error_state_indicated = false;
    std::string_view word = words_.next();
    if (word == "remote") {
      frame_.is_remote = true;
      frame_.size = static_cast<std::uint8_t>(size);
      return words_.next() == "request" ? std::string() : "ends in the middle of 'remote request'";
    }
    if (size > 0 && word.find('`') != std::string_view::npos) return parse_swapped(word, size);
    for (std::size_t i = 0; i < size; ++i, word = words_.next()) {
      if (word.empty())
        return "has " + std::to_string(i) + " of " + std::to_string(size) + " bytes: the line is cut";
      if (word.size() != 2 && word.size() != 8) return quoted(word, "is no byte of two hexadecimal digits");
      if (std::string wrong = append_byte(word, word.size() == 8 ? 2 : 16); !wrong.empty()) return wrong;
    }
    // what -a and -e add
    const bool is_known = word.empty() || word.front() == '\'' || word.front() == '`' || word == "ERRORFRAME";
    return is_known ? std::string() : "goes on after its " + std::to_string(size) + " bytes";
  }

  /// "44`33`22`11" with -S, as one word: the last byte first.
  std::string parse_swapped(std::string_view text, std::size_t size) {
    const std::size_t width = text.find('`');
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t at = (size - 1 - i) * (width + 1);
      if (at + width > text.size()) return quoted(text, "has fewer bytes than the length says");
      if (std::string wrong = append_byte(text.substr(at, width), width == 8 ? 2 : 16); !wrong.empty())
        return wrong;
    }
    return {};
  }

  Words words_;
  CandumpLine& line_;
  CanFrame& frame_;
};

}  // namespace

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

std::string parse_candump_line(std::string_view text, CandumpLine& line) {
  line = {};
  if (text.starts_with("DROPCOUNT:")) return "candump lost frames here";
  if (text.find('\0') != std::string_view::npos)
    return "holds zero bytes, as a file has that was being written when the power went";
  const std::string wrong = LineParser(text, line).parse();
  return wrong.empty() ? wrong : "no frame as candump writes it: " + wrong;
}

bool is_candump_remark(std::string_view text) {
  return text.empty() || text.front() == '\t' || text.front() == '#' || text.front() == ';' ||
         text.find_first_not_of(' ') == std::string_view::npos;
}

}  // namespace alces::replay
