// A visitor of keys (mapper_keys.h, vehicle_keys.h) that overwrites those values which a TOML document names.
// Every complaint is an Error with the line. What the document holds and nobody asked for is refused at the
// end.
//
// A key that is not there leaves its value as it is. Lists and rows are different: a table that is there
// names all of its own, so that a list can be emptied by leaving it out.
#pragma once

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "alces_platform/settings/mapper_keys.h"

namespace alces::settings {

/// Error for what is no TOML. `name` stands for the file.
[[nodiscard]] toml::table parse_toml(std::string_view text, const std::string& name);

class TomlReader {
 public:
  /// `example`: the file to look into for what there is, named in complaints.
  TomlReader(const toml::table& root, std::string file, std::string example)
      : file_(std::move(file)), example_(std::move(example)), root_(root) {}

  void table(const char* name, const char* comment);

  template <typename T>
  void number(const char* key, T& value, double least, double most, const char* comment);
  template <typename T>
  void hex(const char* key, T& value, double most, const char* comment) {
    number(key, value, 0, most, comment);
  }
  void flag(const char* key, bool& value, const char* comment);
  template <typename Enum>
  void choice(const char* key, Enum& value, const Names<Enum>& names, const char* comment);
  void text(const char* key, std::string& value, const char* comment);
  /// "64MiB", or a number of bytes.
  void bytes(const char* key, std::uint64_t& value, double least, double most, const char* comment);
  /// Words, or whole numbers as words.
  void words(const char* key, std::vector<std::string>& values, std::size_t capacity, const char* comment);
  /// At least `fewest` numbers; those that are not given become 0.
  template <typename T, std::size_t size>
  void numbers(const char* key, std::array<T, size>& values, std::size_t fewest, double least, double most,
               const char* comment);
  /// A list of inline tables.
  template <typename Row, typename VisitRow>
  void rows(const char* key, std::vector<Row>& rows, std::size_t capacity, VisitRow visit_row,
            const char* comment);
  /// One inline table that may be left out: then `row` is Row{}.
  template <typename Row, typename VisitRow>
  void optional_row(const char* key, Row& row, bool is_there, VisitRow visit_row, const char* comment);

  /// Is the key given? (A writer says `is_set`: whether it is worth a word.)
  [[nodiscard]] bool wants(const char* key, bool is_set);
  /// A key that older files have: it is read, and means nothing any more.
  void retired(const char* key) { static_cast<void>(find(key)); }
  /// Keys that this table or row must have.
  void need(std::initializer_list<const char*> keys) const;
  /// A sentence about the key, where the table has it, else about the table.
  void expect(bool holds, const char* key, const std::string& sentence) const;

  /// The same after everything was read.
  void require(bool holds, const char* table, const char* key, const std::string& sentence) const;
  /// What the file holds that nobody asked for.
  void refuse_unknown() const;

 private:
  using Keys = std::set<std::string, std::less<>>;
  /// A table, or a row of a list.
  struct Scope {
    std::string name;
    const toml::table* table = nullptr;  ///< null: it is not there
    Keys keys;                           ///< that were asked for
    bool is_row = false;
  };

  const toml::node* find(const char* key);
  [[nodiscard]] std::string name(const char* key) const { return scope_.name + "." + key; }
  [[nodiscard]] const toml::array* array(const char* key, std::size_t capacity);
  template <typename Row, typename VisitRow>
  void read_row(const toml::node& node, std::string name, Row& row, VisitRow visit_row);
  template <typename T>
  void read_number(const toml::node& node, const std::string& name, T& value, double least,
                   double most) const;
  void refuse_unknown(const Scope& scope) const;

  [[noreturn]] void fail(const toml::node& node, const std::string& sentence) const {
    fail(node.source(), sentence);
  }
  [[noreturn]] void fail(const toml::source_region& source, const std::string& sentence) const;
  [[noreturn]] void out_of_range(const toml::node& node, const std::string& name, double least,
                                 double most) const;

  std::string file_;
  std::string example_;
  const toml::table& root_;
  Scope scope_;
  std::map<std::string, Keys, std::less<>> tables_;  ///< keys that were asked for
};

template <typename T>
void TomlReader::read_number(const toml::node& node, const std::string& name, T& value, double least,
                             double most) const {
  if constexpr (std::is_floating_point_v<T>) {
    const auto given = node.value<double>();
    if (!node.is_number() || !given) fail(node, fmt::format("{} is a number", name));
    if (!(*given >= least && *given <= most)) out_of_range(node, name, least, most);
    value = static_cast<T>(*given);
  } else {
    if (!node.is_integer()) fail(node, fmt::format("{} is a whole number", name));
    const std::int64_t given = *node.value<std::int64_t>();
    const auto high = std::min(most, static_cast<double>(std::numeric_limits<std::int64_t>::max() / 2));
    if (given < static_cast<std::int64_t>(least) || given > static_cast<std::int64_t>(high))
      out_of_range(node, name, least, most);
    value = static_cast<T>(given);
  }
}

template <typename T>
void TomlReader::number(const char* key, T& value, double least, double most, const char*) {
  if (const toml::node* node = find(key)) read_number(*node, name(key), value, least, most);
}

template <typename Enum>
void TomlReader::choice(const char* key, Enum& value, const Names<Enum>& names, const char*) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  std::string all;
  for (const auto& [word, named] : names) {
    if (node->is_string() && *node->value<std::string_view>() == word) {
      value = named;
      return;
    }
    all += fmt::format("{}\"{}\"", all.empty() ? "" : ", ", word);
  }
  fail(*node, fmt::format("{} is one of {}", name(key), all));
}

template <typename T, std::size_t size>
void TomlReader::numbers(const char* key, std::array<T, size>& values, std::size_t fewest, double least,
                         double most, const char*) {
  if (find(key) == nullptr) return;
  const toml::array& given = *array(key, size);
  if (given.size() < fewest)
    fail(given, fmt::format("{} has {} entries, not {}", name(key), given.size(), fewest));
  values.fill(T{});
  for (std::size_t i = 0; i < given.size(); ++i)
    read_number(given[i], fmt::format("{}[{}]", name(key), i), values[i], least, most);
}

template <typename Row, typename VisitRow>
void TomlReader::rows(const char* key, std::vector<Row>& rows, std::size_t capacity, VisitRow visit_row,
                      const char*) {
  if (scope_.table == nullptr) return;
  rows.clear();
  const toml::array* given = array(key, capacity);
  if (given == nullptr) return;
  rows.resize(given->size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    read_row((*given)[i], fmt::format("{}[{}]", name(key), i), rows[i], visit_row);
}

template <typename Row, typename VisitRow>
void TomlReader::optional_row(const char* key, Row& row, bool, VisitRow visit_row, const char*) {
  if (scope_.table == nullptr) return;
  row = Row{};
  if (const toml::node* node = find(key)) read_row(*node, name(key), row, visit_row);
}

template <typename Row, typename VisitRow>
void TomlReader::read_row(const toml::node& node, std::string name, Row& row, VisitRow visit_row) {
  if (!node.is_table()) fail(node, fmt::format("{} is a table; write {{key = value, ...}}", name));
  Scope outer = std::move(scope_);
  scope_ = {std::move(name), node.as_table(), {}, true};
  visit_row(row, *this);
  refuse_unknown(scope_);
  scope_ = std::move(outer);
}

}  // namespace alces::settings
