// Decimal numbers out of text, at the speed that files of many million points ask for.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace alces::offline {

/// Blank, comma, semicolon, end of line or end of text.
[[nodiscard]] inline bool ends_number(char c) {
  return static_cast<unsigned char>(c) <= ' ' || c == ',' || c == ';';
}
[[nodiscard]] inline bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

/// Editors on Windows put a UTF-8 byte-order mark in front of a text.
[[nodiscard]] inline std::string_view without_byte_order_mark(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  return text;
}

/// What stands between blanks.
[[nodiscard]] std::vector<std::string_view> split_words(std::string_view line);

/// Any spelling: exponents, nan, inf, a leading plus, any number of digits.
[[nodiscard]] const char* parse_any_number(const char* at, const char* end, double& value);

/// Reads the number at `at` and returns where it ends, or nullptr when there is none or it runs into other
/// text.
/// `*end` must be readable and 0, as behind a std::string. The value is the nearest double.
[[nodiscard]] inline const char* parse_number(const char* at, const char* end, double& value) {
  static constexpr std::array<double, 20> power_of_ten = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,
                                                          1e7,  1e8,  1e9,  1e10, 1e11, 1e12, 1e13,
                                                          1e14, 1e15, 1e16, 1e17, 1e18, 1e19};
  // Plain decimals of up to 19 digits: an integer up to 2^53 over a power of ten, one exact division.
  const char* const begin = at;
  const bool negative = *at == '-';
  if (negative) ++at;
  std::uint64_t mantissa = 0;
  const char* const whole = at;
  unsigned digit = 0;
  while ((digit = static_cast<unsigned char>(*at) - unsigned{'0'}) < 10) {
    mantissa = mantissa * 10 + digit;
    ++at;
  }
  auto digits = at - whole;
  std::ptrdiff_t decimals = 0;
  if (*at == '.') {
    const char* const fraction = ++at;
    while ((digit = static_cast<unsigned char>(*at) - unsigned{'0'}) < 10) {
      mantissa = mantissa * 10 + digit;
      ++at;
    }
    decimals = at - fraction;
    digits += decimals;
  }
  if (digits == 0 || digits > 19 || mantissa > (std::uint64_t{1} << 53) || !ends_number(*at)) {
    return parse_any_number(begin, end, value);
  }
  const double magnitude = static_cast<double>(mantissa) / power_of_ten[static_cast<std::size_t>(decimals)];
  value = negative ? -magnitude : magnitude;
  return at;
}

}  // namespace alces::offline
