#include "comparison.h"

#include <algorithm>
#include <string>
#include <vector>

#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "packed_bytes.h"

namespace alces::offline {
namespace {

constexpr std::size_t most_rows = 200;

/// RFC 4180: fields may stand in quotes, a quote inside them is doubled.
std::vector<std::vector<std::string>> csv_rows(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> row;
  std::string field;
  bool in_quotes = false;
  const auto end_row = [&] {
    if (row.empty() && field.empty()) return;
    row.push_back(std::exchange(field, {}));
    rows.push_back(std::exchange(row, {}));
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_quotes) {
      if (c != '"') {
        field += c;
      } else if (i + 1 < text.size() && text[i + 1] == '"') {
        field += text[++i];
      } else {
        in_quotes = false;
      }
    } else if (c == '"' && field.empty()) {
      in_quotes = true;
    } else if (c == ',') {
      row.push_back(std::exchange(field, {}));
    } else if (c == '\n') {
      end_row();
    } else if (c != '\r') {
      field += c;
    }
  }
  end_row();
  return rows;
}

}  // namespace

nlohmann::json read_comparison(const std::filesystem::path& folder) {
  nlohmann::json tables = nlohmann::json::array();
  nlohmann::json pictures = nlohmann::json::array();
  std::string bytes;
  for (const std::filesystem::path& file : list_files(folder)) {
    const std::string extension = file.extension().string();
    if (extension == ".csv") {
      read_file(file, bytes);
      std::vector<std::vector<std::string>> rows = csv_rows(bytes);
      if (rows.empty()) throw InputError(file, "is an empty table");
      if (rows.size() > most_rows + 1) continue;
      std::vector<std::string> columns = std::move(rows.front());
      rows.erase(rows.begin());
      tables.push_back(
          {{"name", file.stem().string()}, {"columns", std::move(columns)}, {"rows", std::move(rows)}});
    } else if (extension == ".png" || extension == ".svg") {
      read_file(file, bytes);
      const std::string type = extension == ".png" ? "image/png" : "image/svg+xml";
      pictures.push_back(
          {{"name", file.stem().string()}, {"href", "data:" + type + ";base64," + base64(bytes)}});
    }
  }
  if (tables.empty() && pictures.empty())
    throw InputError(folder, "holds no tables (.csv) and no pictures (.png, .svg) to show as a comparison");
  return {
      {"name", folder.filename().string()}, {"tables", std::move(tables)}, {"pictures", std::move(pictures)}};
}

}  // namespace alces::offline
