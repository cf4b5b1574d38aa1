#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <optional>

#include "offline/io/files/error.h"
#include "offline/io/files/text_numbers.h"
#include "scan_format.h"

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

// As CloudCompare (//X), ParaView (Points:0), LidarView (Points_m_XYZ:0) and others head their columns.
std::size_t axis_named(std::string_view cell) {
  std::string name;
  for (const char c : cell.substr(0, cell.find_first_of("[("))) {  // without its unit
    if (c != '/' && c != '#' && c != ' ')
      name.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
  }
  constexpr std::array<std::array<std::string_view, 4>, 3> names = {
      {{"x", "px", "x_m", "point.x"}, {"y", "py", "y_m", "point.y"}, {"z", "pz", "z_m", "point.z"}}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (std::find(names.at(axis).begin(), names.at(axis).end(), name) != names.at(axis).end()) return axis;
  }
  const std::size_t size = name.size();
  if (name.starts_with("points") && size > 2 && name[size - 2] == ':' && name[size - 1] >= '0' &&
      name[size - 1] <= '2')
    return static_cast<std::size_t>(name[size - 1] - '0');
  return 3;
}

bool is_number(std::string_view cell) {
  const std::string text(cell);  // for the 0 behind it
  double value = 0;
  return !text.empty() &&
         parse_number(text.data(), text.data() + text.size(), value) == text.data() + text.size();
}

bool is_count(std::string_view cell) {
  return !cell.empty() && cell.find_first_not_of("0123456789") == std::string_view::npos;
}

/// 3,807: digits, one comma, digits.
bool has_decimal_comma(std::string_view cell) {
  if (cell.starts_with('-') || cell.starts_with('+')) cell.remove_prefix(1);
  const std::size_t comma = cell.find(',');
  return comma != std::string_view::npos && comma > 0 && comma + 1 < cell.size() &&
         is_count(cell.substr(0, comma)) &&
         cell.find_first_not_of("0123456789eE+-", comma + 1) == std::string_view::npos;
}

/// Whether its commas are decimal points: another separator stands between columns, and each of these is one
/// number.
bool writes_decimal_commas(std::string_view line) {
  std::vector<std::string_view> cells;
  split(line, line.find(';') != std::string_view::npos ? ';' : '\0', cells);
  const auto commas = std::count_if(cells.begin(), cells.end(), has_decimal_comma);
  return cells.size() >= 3 && commas > 0 && std::all_of(cells.begin(), cells.end(), [](const auto& cell) {
           return cell.empty() || has_decimal_comma(cell) || is_number(cell);
         });
}

using Columns = std::array<std::size_t, 3>;

/// None where x, y and z are not all among the names.
std::optional<Columns> columns_named(const std::vector<std::string_view>& cells) {
  Columns columns = {cells.size(), cells.size(), cells.size()};
  for (std::size_t i = cells.size(); i-- > 0;) {
    const std::size_t axis = axis_named(cells[i]);
    if (axis < 3) columns.at(axis) = i;
  }
  if (std::find(columns.begin(), columns.end(), cells.size()) != columns.end()) return std::nullopt;
  return columns;
}

/// Reads line by line; what stands above the first point decides what the columns are.
class CsvReader {
 public:
  CsvReader(const ScanBytes& scan, std::vector<Point>& points) : scan_(scan), points_(points) {}

  void read() {
    std::string_view bytes = without_byte_order_mark(scan_.bytes);
    std::size_t at = 0;
    while (at < bytes.size()) {
      ++line_;
      const std::size_t stop = std::min(bytes.find('\n', at), bytes.size());
      const std::string_view text = trim(bytes.substr(at, stop - at));
      if (is_first_ && !text.empty() && !is_comment(text) && writes_decimal_commas(text) && plain_.empty()) {
        // from here on with points for commas; columns are then separated by something else
        plain_.assign(bytes.substr(at));
        std::replace(plain_.begin(), plain_.end(), ',', '.');
        bytes = plain_;
        at = 0;
        --line_;
        continue;
      }
      at = stop + 1;
      if (!text.empty()) take(text);
    }
    if (promised_ && *promised_ != points_.size()) {
      scan_.warnings.push_back(fmt::format("{}: its count promises {} points, {} are there",
                                           scan_.file.string(), *promised_, points_.size()));
    }
  }

 private:
  static bool is_comment(std::string_view text) { return text.front() == '#' || text.front() == '%'; }

  void take(std::string_view text) {
    if (is_comment(text)) {
      if (is_first_) take_comment(text);
      return;
    }
    if (is_first_) {
      split(text, separator_of(text), cells_);
      if (cells_.size() == 1 && is_count(cells_[0]) && cells_[0].size() < 19 && !promised_) {
        std::uint64_t count = 0;
        std::from_chars(cells_[0].data(), cells_[0].data() + cells_[0].size(), count);
        promised_ = count;
        return;
      }
      if (std::none_of(cells_.begin(), cells_.end(), is_number) && !has_header_) {
        take_header();
        return;
      }
      separator_ = separator_of(text);
      is_first_ = false;
    }
    take_point(text);
  }

  /// A comment that names x, y and z is a header; any other is prose.
  void take_comment(std::string_view text) {
    text.remove_prefix(std::min(text.find_first_not_of("#% \t"), text.size()));
    split(text, separator_of(text), cells_);
    if (const auto columns = columns_named(cells_)) {
      columns_ = *columns;
      named_ = 0;  // prose may stand between the names: their number proves nothing
    }
  }

  void take_header() {
    const auto columns = columns_named(cells_);
    if (!columns) {
      throw InputError(scan_.file, line_,
                       fmt::format("the columns are \"{:.100}\"; name three of them x, y and z, or leave the "
                                   "header out",
                                   fmt::format("{}", fmt::join(cells_, " "))));
    }
    columns_ = *columns;
    named_ = cells_.size();
    has_header_ = true;
  }

  void take_point(std::string_view text) {
    split(text, separator_, cells_);
    while (named_ > 0 && cells_.size() > named_ && cells_.back().empty()) cells_.pop_back();
    if (named_ > 0 && cells_.size() > named_) {
      throw InputError(scan_.file, line_,
                       fmt::format("has {} columns where the header names {}; decimal commas need another "
                                   "separator between the columns",
                                   cells_.size(), named_));
    }
    std::array<double, 3> xyz{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t column = columns_.at(axis);
      const char* next = nullptr;
      if (column < cells_.size() && !cells_[column].empty())
        next = parse_number(cells_[column].data(), end_of(cells_[column]), xyz.at(axis));
      if (next == nullptr || next != cells_[column].data() + cells_[column].size()) {
        throw InputError(scan_.file, line_,
                         fmt::format("column {} of {} is missing or is no number; correct the line",
                                     column + 1, cells_.size()));
      }
    }
    points_.push_back(scan_.reading.point(xyz[0], xyz[1], xyz[2]));
  }

  /// Of the text that the cell lies in; a 0 stands there.
  [[nodiscard]] const char* end_of(std::string_view cell) const {
    const bool is_plain =
        !plain_.empty() && cell.data() >= plain_.data() && cell.data() < plain_.data() + plain_.size();
    return is_plain ? plain_.data() + plain_.size() : scan_.bytes.data() + scan_.bytes.size();
  }

  const ScanBytes& scan_;
  std::vector<Point>& points_;
  std::string plain_;  ///< the points with decimal points, where the file has commas
  std::vector<std::string_view> cells_;
  Columns columns_ = {0, 1, 2};
  std::size_t named_ = 0;  ///< columns of the header; 0: not to be counted
  std::optional<std::uint64_t> promised_;
  char separator_ = 0;
  std::size_t line_ = 0;
  bool is_first_ = true;
  bool has_header_ = false;
};

}  // namespace

void parse_csv(const ScanBytes& scan, ScanPoints& out) {
  out.clear();
  std::vector<Point>& points = out.points;
  CsvReader(scan, points).read();
}

}  // namespace alces::offline
