#include "alces_platform/replay/line_reader.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <system_error>

#include "alces_drivers/stamp.h"

namespace alces::replay {
namespace {

constexpr char escape = '\033';

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

/// Takes "ESC [ ... letter" out: candump -c.
void remove_colours(std::string& line) {
  std::size_t kept = 0;
  for (std::size_t at = 0; at < line.size(); ++at) {
    if (line[at] == escape && at + 1 < line.size() && line[at + 1] == '[') {
      at += 2;
      while (at < line.size() && (line[at] < '@' || line[at] > '~')) ++at;
      continue;
    }
    line[kept++] = line[at];
  }
  line.resize(kept);
}

template <typename Number>
bool parse_whole(std::string_view text, Number& value, int base) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  return error == std::errc{} && end == text.data() + text.size() && !text.empty();
}

bool parse_fraction(std::string_view digits, std::int64_t& fraction_ns) {
  std::uint64_t value = 0;
  if (digits.size() > 9 || !parse_unsigned(digits, value)) return false;
  for (std::size_t i = digits.size(); i < 9; ++i) value *= 10;
  fraction_ns = static_cast<std::int64_t>(value);
  return true;
}

}  // namespace

LineReader::LineReader(const std::filesystem::path& file)
    : stream_(file, std::ios::binary), name_(file.string()) {
  if (!stream_) {
    std::string sentence = name_;
    sentence += ": cannot be opened (";
    sentence += std::strerror(errno);
    throw TraceError(sentence + ")");
  }
}

bool LineReader::next(std::string_view& line) {
  line_.clear();
  if (!std::getline(stream_, line_)) {
    if (stream_.bad())
      throw TraceError(name_ + ": cannot be read on; what comes after is unknown, check the disk");
    return false;
  }
  ++number_;
  bytes_ += line_.size() + 1;
  if (line_.size() > maximum_length) line_.resize(maximum_length);
  if (line_.find(escape) != std::string::npos) remove_colours(line_);
  while (!line_.empty() && line_.back() == '\r') line_.pop_back();
  line = line_;
  return true;
}

std::string LineReader::problem(std::string_view what) const {
  std::string sentence = name_;
  sentence += ':';
  sentence += std::to_string(number_);
  sentence += ": ";
  sentence += what;
  sentence += ", '";
  for (const char c : line_.substr(0, 60)) sentence += c >= ' ' && c <= '~' ? c : '?';
  sentence += '\'';
  return sentence;
}

void Words::skip_blanks() {
  while (!text_.empty() && is_blank(text_.front())) text_.remove_prefix(1);
}

std::string_view Words::next() {
  skip_blanks();
  const auto end = std::find_if(text_.begin(), text_.end(), is_blank);
  const std::string_view word = text_.substr(0, static_cast<std::size_t>(end - text_.begin()));
  text_.remove_prefix(word.size());
  return word;
}

std::string_view Words::rest() {
  skip_blanks();
  std::string_view rest = text_;
  while (!rest.empty() && is_blank(rest.back())) rest.remove_suffix(1);
  text_ = {};
  return rest;
}

std::string_view Words::bracketed(char open, char close) {
  skip_blanks();
  const std::size_t end = text_.find(close);
  if (text_.empty() || text_.front() != open || end == std::string_view::npos) return {};
  const std::string_view inside = text_.substr(1, end - 1);
  text_.remove_prefix(end + 1);
  return inside;
}

bool parse_unsigned(std::string_view text, std::uint64_t& value, int base) {
  return parse_whole(text, value, base);
}

bool parse_signed(std::string_view text, std::int64_t& value) {
  return parse_whole(text, value, 10);
}

bool parse_seconds(std::string_view text, std::int64_t& stamp_ns) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);  // gpiomon 1 pads with blanks
  const std::size_t point = text.find('.');
  if (point == std::string_view::npos) return false;
  std::uint64_t whole_s = 0;
  std::int64_t fraction_ns = 0;
  if (!parse_unsigned(text.substr(0, point), whole_s) || !parse_fraction(text.substr(point + 1), fraction_ns))
    return false;
  if (whole_s >= static_cast<std::uint64_t>(INT64_MAX / ns_per_s)) return false;
  stamp_ns = static_cast<std::int64_t>(whole_s) * ns_per_s + fraction_ns;
  return true;
}

bool parse_date(std::string_view text, std::int64_t& stamp_ns) {
  // yyyy-mm-ddThh:mm:ss.fraction, then perhaps Z
  if (text.size() < 21 || text[4] != '-' || text[7] != '-' || (text[10] != 'T' && text[10] != ' ') ||
      text[13] != ':' || text[16] != ':' || text[19] != '.')
    return false;
  if (text.back() == 'Z') text.remove_suffix(1);
  std::uint64_t year = 0;
  std::uint64_t month = 0;
  std::uint64_t day = 0;
  std::uint64_t hour = 0;
  std::uint64_t minute = 0;
  std::uint64_t second = 0;
  std::int64_t fraction_ns = 0;
  if (!parse_unsigned(text.substr(0, 4), year) || !parse_unsigned(text.substr(5, 2), month) ||
      !parse_unsigned(text.substr(8, 2), day) || !parse_unsigned(text.substr(11, 2), hour) ||
      !parse_unsigned(text.substr(14, 2), minute) || !parse_unsigned(text.substr(17, 2), second) ||
      !parse_fraction(text.substr(20), fraction_ns))
    return false;
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(year)),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok() || year < 1970 || year > 2200 || hour > 23 || minute > 59 || second > 60) return false;
  const std::int64_t days = std::chrono::sys_days(date).time_since_epoch().count();
  const auto second_of_day = static_cast<std::int64_t>((hour * 60 + minute) * 60 + second);
  stamp_ns = (days * 86'400 + second_of_day) * ns_per_s + fraction_ns;
  return true;
}

void append_seconds(std::string& text, std::int64_t stamp_ns, int decimals, int digits, char pad) {
  const std::int64_t positive_ns = std::max<std::int64_t>(stamp_ns, 0);
  const std::string whole = std::to_string(positive_ns / ns_per_s);
  const auto width = static_cast<std::size_t>(digits);
  if (whole.size() < width) text.append(width - whole.size(), pad);
  text += whole;
  text += '.';
  const std::string fraction = std::to_string(ns_per_s + positive_ns % ns_per_s);  // 1 and nine digits
  text.append(fraction, 1, static_cast<std::size_t>(decimals));
}

}  // namespace alces::replay
