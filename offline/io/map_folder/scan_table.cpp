#include "scan_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/files/output_file.h"
#include "offline/io/files/text_numbers.h"

namespace alces::offline {
namespace {

constexpr std::size_t leading_columns = 8;
constexpr std::size_t step_columns = 2;  // words
constexpr std::size_t held_columns = 1 + direction_names.size();

// What a table has beside the columns that all have: tables of before steps were judged, or of before
// directions were measured, go on being read.
struct Form {
  bool has_steps = true;
  bool has_held = true;
  [[nodiscard]] std::size_t columns() const {
    return leading_columns + (has_steps ? step_columns + 1 : 0) + (has_held ? held_columns : 0) +
           stage_names.size();
  }
};
constexpr std::array<Form, 3> forms = {Form{true, true}, Form{true, false}, Form{false, false}};

std::string header(const Form& form) {
  std::string line = "scan,stamp_s,points,iterations,correspondences,overlap,rms_m,is_predicted";
  if (form.has_steps) line += ",step,doubt,fit";
  if (form.has_held) {
    line += ",surfaces";
    for (const char* name : direction_names) line += fmt::format(",held_{}", name);
  }
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
  output.write(header(forms[0]) + "\n");
  for (const ScanRow& row : table.rows) {
    const std::string stamp = table.has_time ? fmt::format("{:.9f}", row.stamp_s) : "";
    std::string line = fmt::format("{},{},{},{},{},{:.6g},{:.6g},{},{},{},{:.6g}", row.scan, stamp,
                                   row.points, row.iterations, row.correspondences, row.overlap, row.rms_m,
                                   row.is_predicted ? 1 : 0, row.step, row.doubt, row.fit);
    line += fmt::format(",{}", row.surfaces);
    for (const double share : row.held) line += fmt::format(",{:.4g}", share);
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
  Form form;
  std::vector<double> numbers;
  std::vector<std::string> words;
  for (std::size_t begin = 0; begin < bytes.size();) {
    const std::size_t end = std::min(bytes.find('\n', begin), bytes.size());
    std::string line = bytes.substr(begin, end - begin);
    begin = end + 1;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (++line_number == 1) {
      const auto* const known =
          std::ranges::find_if(forms, [&line](const Form& one) { return header(one) == line; });
      if (known == forms.end())
        throw InputError(file, 1, "is not the header that alces writes; map the scans again");
      form = *known;
      table.has_held = form.has_held;
      continue;
    }
    numbers.clear();
    words.clear();
    for (std::size_t field = 0; field <= line.size();) {
      const std::size_t field_end = std::min(line.find(',', field), line.size());
      const std::string text = line.substr(field, field_end - field);
      field = field_end + 1;
      if (form.has_steps && numbers.size() == leading_columns && words.size() < step_columns) {
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
    if (numbers.size() + words.size() != form.columns())
      throw InputError(file, line_number,
                       fmt::format("has {} columns where {} are expected; map the scans again",
                                   numbers.size() + words.size(), form.columns()));
    ScanRow row;
    row.scan = whole<std::uint64_t>(file, line_number, numbers[0]);
    row.stamp_s = numbers[1];
    row.points = whole<std::uint32_t>(file, line_number, numbers[2]);
    row.iterations = whole<std::uint32_t>(file, line_number, numbers[3]);
    row.correspondences = whole<std::uint32_t>(file, line_number, numbers[4]);
    row.overlap = numbers[5];
    row.rms_m = numbers[6];
    row.is_predicted = numbers[7] != 0;
    std::size_t next = leading_columns;
    if (form.has_steps) {
      row.step = words[0];
      row.doubt = words[1];
      row.fit = numbers[next++];
    }
    if (form.has_held) {
      row.surfaces = whole<std::uint32_t>(file, line_number, numbers[next++]);
      for (double& share : row.held) share = numbers[next++];
    }
    for (double& ms : row.stage_ms) ms = numbers[next++];
    table.rows.push_back(row);
  }
  if (line_number == 0) throw InputError(file, "is empty; map the scans again");
  return table;
}

}  // namespace alces::offline
