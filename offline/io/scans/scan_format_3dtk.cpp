#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

#include "offline/io/files/error.h"
#include "offline/io/files/text_numbers.h"
#include "scan_format.h"

namespace alces::offline {
namespace {

constexpr double cm_per_m = 100.0;

bool all_of(std::string_view token, std::string_view characters) {
  return !token.empty() && token.find_first_not_of(characters) == std::string_view::npos;
}

std::string_view take_token(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
  const std::string_view token = line.substr(0, line.find_first_of(" \t\r"));
  line.remove_prefix(token.size());
  return token;
}

// Begins with `letters` letters and is no NaN or Inf.
bool is_word(std::string_view token, std::size_t letters) {
  constexpr std::string_view alphabet = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
  double value = 0;
  const std::string text(token);  // for the 0 behind it
  return token.size() >= letters && all_of(token.substr(0, letters), alphabet) &&
         parse_number(text.data(), text.data() + text.size(), value) == nullptr;
}

bool is_count(std::string_view token) {
  return all_of(token, "0123456789");
}

bool is_number(std::string_view token) {
  double value = 0;
  const std::string text(token);  // for the 0 behind it
  const char* const end = text.data() + text.size();
  return parse_number(text.data(), end, value) == end;
}

// "361 x 480", which 3DTK itself takes for a header, or "361 rows 480 columns".
bool is_grid(std::span<const std::string_view> tokens) {
  if (tokens.size() < 3 || !is_count(tokens[0]) || !is_count(tokens[2])) return false;
  return tokens.size() == 3 ? tokens[1] == "x"
                            : tokens.size() == 4 && is_word(tokens[1], 2) && is_word(tokens[3], 2);
}

// What tools put into the first line: a comment, a count of points, words, a grid. Any other line with two
// numbers is a point, and text in it is as wrong as in the lines below.
bool is_header(std::string_view line) {
  std::array<std::string_view, 8> room;  // its first words decide: a whole file may be one line
  std::size_t count = 0;
  while (count < room.size() && !(room[count] = take_token(line)).empty()) ++count;
  const std::span<const std::string_view> tokens = std::span(room).first(count);
  if (tokens.empty()) return false;
  if (tokens[0].front() == '#' || is_grid(tokens)) return true;
  if (std::count_if(tokens.begin(), tokens.end(), is_number) > 1) return false;
  return is_word(tokens[0], 1) || (is_count(tokens[0]) && (count == 1 || is_word(tokens[1], 2)));
}

}  // namespace

void parse_3dtk(const ScanBytes& scan, ScanPoints& out) {
  out.clear();
  std::vector<Point>& points = out.points;
  const std::string_view bytes = without_byte_order_mark(scan.bytes);
  const char* at = bytes.data();
  const char* const end = at + bytes.size();
  std::size_t line = 1;
  const std::string_view first_line = bytes.substr(0, bytes.find('\n'));
  double promised = -1;
  if (is_header(first_line)) {
    std::string_view rest = first_line;
    const std::string_view count = take_token(rest);
    // only a lone number is a promise
    if (is_count(count) && take_token(rest).empty() && parse_number(count.data(), end, promised) == nullptr) {
      promised = -1;
    }
    at += first_line.size();
  }
  while (true) {
    while (is_blank(*at)) ++at;
    if (*at == '\n') {
      ++at;
      ++line;
      continue;
    }
    if (at >= end) break;
    if (*at != '#') {
      std::array<double, 3> cm{};
      for (std::size_t i = 0; i < 3; ++i) {
        while (is_blank(*at)) ++at;
        const char* const next = parse_number(at, end, cm[i]);
        if (next == nullptr || !(is_blank(*next) || *next == '\n' || next == end)) {
          const std::string_view text(at, static_cast<std::size_t>(end - at));
          throw InputError(
              scan.file, line,
              fmt::format("number {} of x y z is missing or is no number (\"{}\"); every line of a "
                          "3DTK scan starts with three numbers in cm",
                          i + 1, text.substr(0, std::min<std::size_t>(text.find_first_of(" \t\r\n"), 20))));
        }
        at = next;
      }
      points.push_back(scan.reading.point(cm[2] / cm_per_m, -cm[0] / cm_per_m, cm[1] / cm_per_m));
    }
    while (*at != '\n' && at != end) ++at;
  }
  if (promised >= 0 && promised != static_cast<double>(points.size())) {
    scan.warnings.push_back(fmt::format("{}: its first line promises {:.0f} points, {} are there",
                                        scan.file.string(), promised, points.size()));
  }
}

}  // namespace alces::offline
