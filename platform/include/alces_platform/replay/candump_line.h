// One line of can-utils' text: candump.h lists the forms. The only parser of it: replay passes over what it
// refuses, explain-can stops there.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "alces_drivers/can_frame.h"

namespace alces::replay {

struct CandumpLine {
  CanFrame frame;
  std::string_view interface;  ///< of the text that was parsed
  bool is_sent = false;
  std::optional<std::int64_t> stamp_ns;  ///< as written: since 1970, since a start, or since the line before
  bool may_be_difference = false;        ///< by its form; the log form's stamps are none
};

/// Empty, and `line` is filled; otherwise what is wrong: "'1G' is no byte of two hexadecimal digits".
[[nodiscard]] std::string parse_candump_line(std::string_view text, CandumpLine& line);

/// What candump says besides frames: explanations of error frames, empty lines; and comments.
[[nodiscard]] bool is_candump_remark(std::string_view text);

/// A hexadecimal digit's value; -1: it is none.
[[nodiscard]] int hex_digit(char c);

/// Flags in the eight digits of an identifier, and in the digit behind "##" (linux/can.h).
inline constexpr std::uint32_t candump_error_flag = 0x2000'0000;
inline constexpr std::uint8_t candump_bit_rate_switch_flag = 1;
inline constexpr std::uint8_t candump_error_state_flag = 2;

}  // namespace alces::replay
