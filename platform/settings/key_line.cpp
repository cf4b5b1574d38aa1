#include "alces_platform/settings/key_line.h"

#include "alces_platform/settings/settings_error.h"
#include "toml_reader.h"

namespace alces::settings {

std::size_t key_line(std::string_view text, std::string_view table, std::string_view key) {
  try {
    const toml::table root = parse_toml(text, "");
    const toml::table* const found = root.get_as<toml::table>(table);
    const toml::node* const node = found != nullptr ? found->get(key) : nullptr;
    return node != nullptr ? node->source().begin.line : 0;
  } catch (const Error&) {
    return 0;
  }
}

}  // namespace alces::settings
