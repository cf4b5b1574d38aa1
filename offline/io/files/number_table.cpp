#include "number_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "error.h"
#include "input_file.h"
#include "text_numbers.h"

namespace alces::offline {
namespace {

constexpr std::size_t most_headings = 100;

std::vector<std::string> cells_of(std::string_view line) {
  const char* const separators = line.find(',') != std::string_view::npos   ? ","
                                 : line.find(';') != std::string_view::npos ? ";"
                                                                            : " \t";
  constexpr std::string_view junk = " \t\r\"'";
  std::vector<std::string> cells;
  while (!line.empty()) {
    const std::size_t stop = std::min(line.find_first_of(separators), line.size());
    std::string_view cell = line.substr(0, stop);
    cell.remove_prefix(std::min(cell.find_first_not_of(junk), cell.size()));
    cell = cell.substr(0, cell.find_last_not_of(junk) + 1);
    if (!cell.empty()) cells.emplace_back(cell);
    line.remove_prefix(std::min(stop + 1, line.size()));
  }
  return cells;
}

bool is_number_cell(const std::string& cell) {
  double value = 0;
  const char* const end = cell.data() + cell.size();
  return parse_number(cell.data(), end, value) == end;
}

/// "1,5;2,5": the first line that holds numbers says it for all.
bool has_decimal_commas(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::size_t stop = std::min(bytes.find('\n'), bytes.size());
    const std::string_view line = bytes.substr(0, stop);
    bytes.remove_prefix(std::min(stop + 1, bytes.size()));
    if (line.find_first_not_of("0123456789+-.,;eE \t\r") != std::string_view::npos ||
        line.find_first_of("0123456789") == std::string_view::npos)
      continue;
    return line.find(';') != std::string_view::npos && line.find(',') != std::string_view::npos &&
           line.find('.') == std::string_view::npos && line.find(", ") == std::string_view::npos;
  }
  return false;
}

}  // namespace

/// True: the line is none of numbers but of names.
bool NumberTable::take_heading(std::string_view line) {
  std::vector<std::string> cells = cells_of(line);
  if (cells.size() < 2 || std::any_of(cells.begin(), cells.end(), is_number_cell)) return false;
  if (headings_.size() < most_headings) headings_.push_back(std::move(cells));
  return true;
}

NumberTable NumberTable::read(const std::filesystem::path& file) {
  std::string bytes;
  read_file(file, bytes);
  NumberTable table;
  if (has_decimal_commas(without_byte_order_mark(bytes))) std::replace(bytes.begin(), bytes.end(), ',', '.');
  const char* at = without_byte_order_mark(bytes).data();
  const char* const end = bytes.data() + bytes.size();
  bool may_be_named = true;  // one line of names, above all numbers
  for (std::size_t line = 1; at < end; ++line) {
    const std::size_t begin = table.numbers_.size();
    const char* const stop = std::find(at, end, '\n');
    if (table.lines_.empty()) {
      std::string_view text(at, static_cast<std::size_t>(stop - at));
      text.remove_prefix(std::min(text.find_first_not_of(" \t\r"), text.size()));
      const bool is_comment = text.starts_with('#') || text.starts_with('%');
      if (is_comment) {
        text.remove_prefix(std::min(text.find_first_not_of("#% \t\r"), text.size()));
        static_cast<void>(table.take_heading(text));
      } else if (may_be_named && !text.empty() && table.take_heading(text)) {
        may_be_named = false;
        at = stop;
      }
    }
    while (at < end && *at != '\n') {
      if (is_blank(*at) || *at == ',' || *at == ';') {
        ++at;
      } else if (*at == '#' || *at == '%') {
        at = std::find(at, end, '\n');
      } else {
        double value = 0;
        const char* const next = parse_number(at, end, value);
        if (next == nullptr) {
          const char* const cell_end = std::find_if(at, end, ends_number);
          const std::string_view text(at, std::min<std::size_t>(static_cast<std::size_t>(cell_end - at), 40));
          throw InputError(file, line,
                           fmt::format("\"{}\" is no number; only numbers and # comments belong here", text));
        }
        table.numbers_.push_back(value);
        at = next;
      }
    }
    if (at < end) ++at;
    if (table.numbers_.size() > begin) {
      table.begins_.push_back(table.numbers_.size());
      table.lines_.push_back(line);
    }
  }
  return table;
}

}  // namespace alces::offline
