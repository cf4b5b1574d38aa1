#include "toml_writer.h"

#include <algorithm>

#include "alces_platform/settings/byte_size.h"

namespace alces::settings {

void TomlWriter::table(const char* name, const char* comment) {
  if (!document.empty()) document += "\n";
  remark(comment);
  document += fmt::format("[{}]\n", name);
}

void TomlWriter::bytes(const char* key, std::uint64_t value, double, double, const char* comment) {
  line(key, fmt::format("\"{}\"", exact_byte_size(value)), comment);
}

void TomlWriter::words(const char* key, const std::vector<std::string>& values, std::size_t,
                       const char* comment) {
  std::string all;
  for (const std::string& value : values) all += (all.empty() ? "" : ", ") + quoted(value);
  line(key, "[" + all + "]", comment);
}

std::string TomlWriter::quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

void TomlWriter::line(const char* key, const std::string& value, const char* comment) {
  const std::string setting = fmt::format("{} = {}", key, value);
  if (is_inline_) {
    document += (document.empty() ? "" : ", ") + setting;
  } else {
    document += *comment == '\0' ? setting + "\n" : fmt::format("{:<35} # {}\n", setting, comment);
  }
}

void TomlWriter::list(const char* key, const std::vector<std::string>& entries, const char* comment) {
  if (is_inline_ || entries.empty()) {
    line(key, fmt::format("[{}]", fmt::join(entries, ", ")), comment);
    return;
  }
  remark(comment);
  document += fmt::format("{} = [\n", key);
  for (const std::string& entry : entries) document += fmt::format("  {},\n", entry);
  document += "]\n";
}

void TomlWriter::remark(std::string_view text) {
  while (!is_inline_ && !text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    document += end == 0 ? "#\n" : fmt::format("# {}\n", text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

}  // namespace alces::settings
