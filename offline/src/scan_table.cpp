#include "alces_offline/scan_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "alces_offline/error.h"
#include "alces_offline/input_file.h"
#include "alces_offline/output_file.h"
#include "alces_offline/text_numbers.h"

namespace alces::offline {
namespace {

constexpr std::size_t leading_columns = 8;
constexpr std::size_t step_columns = 2;  // words

/// Maps of before steps were judged have no step, doubt and fit.
std::string header(bool has_steps) {
  std::string line = "scan,stamp_s,points,iterations,correspondences,overlap,rms_m,is_predicted";
  if (has_steps) line += ",step,doubt,fit";
  for (const char* name : stage_names) line += fmt::format(",{}_ms", name);
  return line;
}

template <typename Integer>
Integer whole(const std::filesystem::path& file, std::size_t line, double value) {
  if (!(value >= 0 && value < 4294967296.0 && value == std::floor(value)))
    throw InputError(file, line, "counts are whole numbers; map the scans again");
  return static_cast<Integer>(value);
}

}  // namespace

void write_scan_table(const std::filesystem::path& file, const ScanTable& table) {
  OutputFile output(file);
  output.write(header(true) + "\n");
  for (const ScanRow& row : table.rows) {
    const std::string stamp = table.has_time ? fmt::format("{:.9f}", row.stamp_s) : "";
    std::string line = fmt::format("{},{},{},{},{},{:.6g},{:.6g},{},{},{},{:.6g}", row.scan, stamp,
                                   row.points, row.iterations, row.correspondences, row.overlap, row.rms_m,
                                   row.is_predicted ? 1 : 0, row.step, row.doubt, row.fit);
    for (const double ms : row.stage_ms) line += fmt::format(",{:.6g}", ms);
    output.write(line + "\n");
  }
  output.commit();
}

ScanTable read_scan_table(const std::filesystem::path& file) {
  std::string bytes;
  read_file(file, bytes);
  ScanTable table;
  std::size_t line_number = 0;
  bool has_steps = true;
  std::vector<double> numbers;
  std::vector<std::string> words;
  for (std::size_t begin = 0; begin < bytes.size();) {
    const std::size_t end = std::min(bytes.find('\n', begin), bytes.size());
    std::string line = bytes.substr(begin, end - begin);
    begin = end + 1;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (++line_number == 1) {
      has_steps = line != header(false);
      if (has_steps && line != header(true))
        throw InputError(file, 1, "is not the header that alces writes; map the scans again");
      continue;
    }
    numbers.clear();
    words.clear();
    for (std::size_t field = 0; field <= line.size();) {
      const std::size_t field_end = std::min(line.find(',', field), line.size());
      const std::string text = line.substr(field, field_end - field);
      field = field_end + 1;
      if (has_steps && numbers.size() == leading_columns && words.size() < step_columns) {
        words.push_back(text);
        continue;
      }
      double value = 0;
      const bool is_stamp = numbers.size() == 1;
      if (is_stamp) table.has_time = !text.empty();
      if (!(is_stamp && text.empty()) &&
          (text.empty() || parse_number(text.data(), text.data() + text.size(), value) == nullptr ||
           !std::isfinite(value)))
        throw InputError(file, line_number, fmt::format("\"{}\" is no number; map the scans again", text));
      numbers.push_back(value);
    }
    const std::size_t first_stage = leading_columns + (has_steps ? 1 : 0);
    const std::size_t expected = first_stage + stage_names.size() + (has_steps ? step_columns : 0);
    if (numbers.size() + words.size() != expected)
      throw InputError(file, line_number,
                       fmt::format("has {} columns where {} are expected; map the scans again",
                                   numbers.size() + words.size(), expected));
    ScanRow row;
    row.scan = whole<std::uint64_t>(file, line_number, numbers[0]);
    row.stamp_s = numbers[1];
    row.points = whole<std::uint32_t>(file, line_number, numbers[2]);
    row.iterations = whole<std::uint32_t>(file, line_number, numbers[3]);
    row.correspondences = whole<std::uint32_t>(file, line_number, numbers[4]);
    row.overlap = numbers[5];
    row.rms_m = numbers[6];
    row.is_predicted = numbers[7] != 0;
    if (has_steps) {
      row.step = words[0];
      row.doubt = words[1];
      row.fit = numbers[leading_columns];
    }
    for (std::size_t i = 0; i < stage_names.size(); ++i) row.stage_ms.at(i) = numbers[first_stage + i];
    table.rows.push_back(row);
  }
  if (line_number == 0) throw InputError(file, "is empty; map the scans again");
  return table;
}

}  // namespace alces::offline
