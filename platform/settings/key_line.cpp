#include "alces_platform/settings/key_line.h"

#include "alces_platform/settings/settings_error.h"
#include "toml_reader.h"

namespace alces::settings {

namespace {

std::size_t line_of(const toml::node* node) {
  return node != nullptr ? node->source().begin.line : 0;
}

const toml::node* node_of(const toml::table& root, std::string_view table, std::string_view key) {
  const toml::table* const found = root.get_as<toml::table>(table);
  return found != nullptr ? found->get(key) : nullptr;
}

}  // namespace

std::size_t key_line(std::string_view text, std::string_view table, std::string_view key) {
  try {
    const toml::table root = parse_toml(text, "");
    return line_of(node_of(root, table, key));
  } catch (const Error&) {
    return 0;
  }
}

std::size_t row_line(std::string_view text, std::string_view table, std::string_view key, std::size_t row) {
  try {
    const toml::table root = parse_toml(text, "");
    const toml::node* const node = node_of(root, table, key);
    const toml::array* const rows = node != nullptr ? node->as_array() : nullptr;
    return rows != nullptr ? line_of(rows->get(row)) : 0;
  } catch (const Error&) {
    return 0;
  }
}

}  // namespace alces::settings
