// Lines of a text file with their numbers, without line ends and without a terminal's colours.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "alces_platform/replay/event_source.h"

namespace alces::replay {

class LineReader {
 public:
  /// TraceError when it cannot be opened.
  explicit LineReader(const std::filesystem::path& file);

  /// Longer lines are cut there: no tool writes them, binary files have them.
  static constexpr std::size_t maximum_length = 4096;

  [[nodiscard]] bool next(std::string_view& line);
  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] std::uint64_t bytes_read() const { return bytes_; }
  [[nodiscard]] std::string name() const { return name_; }

  /// "can0.log:12: what, 'the line'"
  [[nodiscard]] std::string problem(std::string_view what) const;

 private:
  std::ifstream stream_;
  std::string name_;
  std::string line_;
  std::uint64_t number_ = 0;
  std::uint64_t bytes_ = 0;
};

/// The words of a line, one after the other.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}
  /// Empty at the end.
  [[nodiscard]] std::string_view next();
  [[nodiscard]] std::string_view rest();
  /// "(...)", whatever is in it, without the brackets; empty and nothing taken when there is none.
  [[nodiscard]] std::string_view bracketed(char open, char close);

 private:
  void skip_blanks();
  std::string_view text_;
};

/// "1608.012345678": up to nine decimals, exactly. "2023-01-05T12:34:56.123456789Z", "2023-01-05
/// 12:34:56.123456": as UTC.
[[nodiscard]] bool parse_seconds(std::string_view text, std::int64_t& stamp_ns);
[[nodiscard]] bool parse_date(std::string_view text, std::int64_t& stamp_ns);
/// All of the text, decimal; in hexadecimal with base 16.
[[nodiscard]] bool parse_unsigned(std::string_view text, std::uint64_t& value, int base = 10);
[[nodiscard]] bool parse_signed(std::string_view text, std::int64_t& value);

/// Seconds with so many decimals, the rest cut off; at least `digits` digits before the point, `pad` in
/// front.
void append_seconds(std::string& text, std::int64_t stamp_ns, int decimals, int digits, char pad);

}  // namespace alces::replay
