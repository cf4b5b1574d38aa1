#include "toml_reader.h"

#include <utility>

#include "alces_platform/settings/byte_size.h"
#include "alces_platform/settings/settings_error.h"

namespace alces::settings {
namespace {

constexpr std::size_t longest_text = 4000;

/// Tables as earlier versions called them. Recordings carry their configuration: these are read for ever.
constexpr std::array<std::pair<const char*, const char*>, 3> earlier_names{{
    {"belief", "loop_verification"},
    {"step_belief", "step_verification"},
    {"sharing", "loop_correction"},
}};

void rename_earlier_tables(toml::table& root, const std::string& name) {
  for (const auto& [earlier, present] : earlier_names) {
    const toml::node* node = root.get(earlier);
    if (node == nullptr) continue;
    if (root.contains(present)) {
      throw Error(
          name, node->source().begin.line,
          fmt::format("{} is what earlier versions called {}, which is there, too; remove one of them",
                      earlier, present));
    }
    toml::node& moved = *root.get(earlier);
    moved.visit([&root, present = present](auto& value) { root.insert(present, std::move(value)); });
    root.erase(earlier);
  }
}

bool is_printable(std::string_view text) {
  return std::none_of(text.begin(), text.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 || byte == 0x7F;
  });
}

}  // namespace

toml::table parse_toml(std::string_view text, const std::string& name) {
  try {
    toml::table root = toml::parse(text, name);
    rename_earlier_tables(root, name);
    return root;
  } catch (const toml::parse_error& error) {
    const std::string what(error.description());
    if (error.source().begin.line == 0) throw Error(name, "cannot be read (" + what + ")");
    throw Error(name, error.source().begin.line, "is no TOML: " + what);
  }
}

void TomlReader::fail(const toml::source_region& source, const std::string& sentence) const {
  throw Error(file_, source.begin.line, sentence);
}

void TomlReader::out_of_range(const toml::node& node, const std::string& name, double least,
                              double most) const {
  fail(node, fmt::format("{} must lie between {} and {}", name, least, most));
}

void TomlReader::table(const char* name, const char*) {
  if (!scope_.name.empty()) tables_[scope_.name].merge(scope_.keys);
  tables_[name];
  scope_ = {name, nullptr, {}, false};
  const toml::node* node = root_.get(name);
  if (node == nullptr) return;
  scope_.table = node->as_table();
  if (scope_.table == nullptr) fail(*node, fmt::format("{} is a table; write [{}]", name, name));
}

const toml::node* TomlReader::find(const char* key) {
  scope_.keys.insert(key);
  return scope_.table == nullptr ? nullptr : scope_.table->get(key);
}

bool TomlReader::wants(const char* key, bool) {
  return find(key) != nullptr;
}

void TomlReader::flag(const char* key, bool& value, const char*) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (!node->is_boolean()) fail(*node, fmt::format("{} is true or false", name(key)));
  value = *node->value<bool>();
}

void TomlReader::text(const char* key, std::string& value, const char*) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (!node->is_string()) fail(*node, fmt::format("{} is a text; write it in quotes", name(key)));
  value = *node->value<std::string>();
  if (!is_printable(value) || value.size() > longest_text)
    fail(*node, fmt::format("{} is one line of at most {} bytes", name(key), longest_text));
}

void TomlReader::bytes(const char* key, std::uint64_t& value, double least, double most, const char*) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (node->is_string()) {
    const auto size = parse_byte_size(*node->value<std::string_view>());
    if (!size) fail(*node, fmt::format("{} is a size such as \"64MiB\" or \"1.5GB\"", name(key)));
    value = *size;
  } else if (node->is_integer() && *node->value<std::int64_t>() >= 0) {
    value = static_cast<std::uint64_t>(*node->value<std::int64_t>());
  } else {
    fail(*node, fmt::format("{} is a size such as \"64MiB\" or \"1.5GB\"", name(key)));
  }
  const auto given = static_cast<double>(value);
  if (given < least || given > most) {
    fail(*node, fmt::format("{} must lie between {} and {}", name(key),
                            format_byte_size(static_cast<std::size_t>(least)),
                            format_byte_size(static_cast<std::size_t>(most))));
  }
}

const toml::array* TomlReader::array(const char* key, std::size_t capacity) {
  const toml::node* node = find(key);
  if (node == nullptr) return nullptr;
  const toml::array* array = node->as_array();
  if (array == nullptr) fail(*node, fmt::format("{} is a list; write [ ... ]", name(key)));
  if (array->size() > capacity)
    fail(*node, fmt::format("{} has {} entries, there is room for {}", name(key), array->size(), capacity));
  return array;
}

void TomlReader::words(const char* key, std::vector<std::string>& values, std::size_t capacity, const char*) {
  if (scope_.table == nullptr) return;
  values.clear();
  const toml::array* given = array(key, capacity);
  if (given == nullptr) return;
  for (const toml::node& node : *given) {
    if (node.is_integer()) {
      values.push_back(std::to_string(*node.value<std::int64_t>()));
    } else if (node.is_string() && is_printable(*node.value<std::string_view>()) &&
               node.value<std::string_view>()->size() <= longest_text) {
      values.push_back(*node.value<std::string>());
    } else {
      fail(node, fmt::format("{} holds texts and whole numbers only", name(key)));
    }
  }
}

void TomlReader::need(std::initializer_list<const char*> keys) const {
  if (scope_.table == nullptr) return;
  for (const char* key : keys) {
    if (scope_.table->get(key) == nullptr) fail(*scope_.table, fmt::format("{} lacks {}", scope_.name, key));
  }
}

void TomlReader::expect(bool holds, const char* key, const std::string& sentence) const {
  if (holds) return;
  if (scope_.table == nullptr) throw Error(file_, sentence);
  const toml::node* node = scope_.table->get(key);
  fail(node != nullptr ? *node : *scope_.table, scope_.is_row ? scope_.name + ": " + sentence : sentence);
}

void TomlReader::require(bool holds, const char* table, const char* key, const std::string& sentence) const {
  if (holds) return;
  const toml::node* node = root_.get(table);
  if (node != nullptr && node->is_table() && node->as_table()->get(key) != nullptr)
    node = node->as_table()->get(key);
  if (node != nullptr) fail(*node, sentence);
  throw Error(file_, sentence);
}

void TomlReader::refuse_unknown(const Scope& scope) const {
  for (const auto& [key, value] : *scope.table) {
    if (scope.keys.find(key.str()) == scope.keys.end())
      fail(key.source(), fmt::format("there is no {}.{}; see {}", scope.name, key.str(), example_));
  }
}

void TomlReader::refuse_unknown() const {
  for (const auto& [key, node] : root_) {
    const auto known = tables_.find(key.str());
    const bool is_last = key.str() == scope_.name;
    if (known == tables_.end() || !node.is_table())
      fail(key.source(), fmt::format("there is no table [{}]; see {}", key.str(), example_));
    Scope scope{std::string(key.str()), node.as_table(), known->second, false};
    if (is_last) scope.keys.insert(scope_.keys.begin(), scope_.keys.end());
    refuse_unknown(scope);
  }
}

}  // namespace alces::settings
