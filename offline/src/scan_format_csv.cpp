#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "alces_offline/error.h"
#include "alces_offline/scan_format.h"
#include "alces_offline/text_numbers.h"

namespace alces::offline {
namespace {

std::string_view trim(std::string_view text) {
  constexpr std::string_view junk = " \t\r\"'";
  const std::size_t first = text.find_first_not_of(junk);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(junk) + 1 - first);
}

// 0: any run of blanks separates
char separator_of(std::string_view line) {
  for (const char c : {';', ','}) {
    if (line.find(c) != std::string_view::npos) return c;
  }
  return 0;
}

void split(std::string_view line, char separator, std::vector<std::string_view>& cells) {
  cells.clear();
  if (separator == 0) {
    while (true) {
      line = trim(line);
      if (line.empty()) return;
      cells.push_back(trim(line.substr(0, line.find_first_of(" \t"))));
      line.remove_prefix(std::min(line.find_first_of(" \t"), line.size()));
    }
  }
  while (true) {
    const std::size_t stop = line.find(separator);
    cells.push_back(trim(line.substr(0, stop)));
    if (stop == std::string_view::npos) return;
    line.remove_prefix(stop + 1);
  }
}

// As CloudCompare (//X), ParaView (Points:0) and others head their columns.
std::size_t axis_named(std::string_view cell) {
  std::string name;
  for (const char c : cell) {
    if (c != '/' && c != ' ') name.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
  }
  constexpr std::array<std::array<std::string_view, 5>, 3> names = {
      {{"x", "px", "x_m", "points:0", "point.x"},
       {"y", "py", "y_m", "points:1", "point.y"},
       {"z", "pz", "z_m", "points:2", "point.z"}}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (std::find(names.at(axis).begin(), names.at(axis).end(), name) != names.at(axis).end()) return axis;
  }
  return 3;
}

bool is_number(std::string_view cell) {
  const std::string text(cell);  // for the 0 behind it
  double value = 0;
  return !text.empty() &&
         parse_number(text.data(), text.data() + text.size(), value) == text.data() + text.size();
}

std::array<std::size_t, 3> columns_of_header(const ScanBytes& scan, std::size_t line,
                                             const std::vector<std::string_view>& cells) {
  std::array<std::size_t, 3> columns = {cells.size(), cells.size(), cells.size()};
  for (std::size_t i = cells.size(); i-- > 0;) {
    const std::size_t axis = axis_named(cells[i]);
    if (axis < 3) columns.at(axis) = i;
  }
  if (std::find(columns.begin(), columns.end(), cells.size()) != columns.end()) {
    throw InputError(
        scan.file, line,
        fmt::format("the columns are \"{:.100}\"; name three of them x, y and z, or leave the header out",
                    fmt::format("{}", fmt::join(cells, " "))));
  }
  return columns;
}

}  // namespace

void parse_csv(const ScanBytes& scan, std::vector<Point>& points) {
  points.clear();
  const char* const end = scan.bytes.data() + scan.bytes.size();
  std::array<std::size_t, 3> columns = {0, 1, 2};
  char separator = 0;
  bool first = true;
  std::vector<std::string_view> cells;
  std::size_t at = 0;
  for (std::size_t line = 1; at < scan.bytes.size(); ++line) {
    const std::size_t stop = std::min(scan.bytes.find('\n', at), scan.bytes.size());
    const std::string_view text = trim(scan.bytes.substr(at, stop - at));
    at = stop + 1;
    if (text.empty() || text.front() == '#') continue;
    if (first) {
      separator = separator_of(text);
      first = false;
      split(text, separator, cells);
      if (std::none_of(cells.begin(), cells.end(), is_number)) {
        columns = columns_of_header(scan, line, cells);
        continue;
      }
    }
    split(text, separator, cells);
    std::array<float, 3> xyz{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t column = columns.at(axis);
      double value = 0;
      const char* next = nullptr;
      if (column < cells.size() && !cells[column].empty())
        next = parse_number(cells[column].data(), end, value);
      if (next == nullptr || next != cells[column].data() + cells[column].size()) {
        throw InputError(scan.file, line,
                         fmt::format("column {} of {} is missing or is no number; correct the line",
                                     column + 1, cells.size()));
      }
      xyz.at(axis) = static_cast<float>(value);
    }
    points.push_back({xyz[0], xyz[1], xyz[2]});
  }
}

}  // namespace alces::offline
