// A visitor of keys (mapper_keys.h, vehicle_keys.h) that writes them as a TOML document for people: tables
// under their comments, every key with its own.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "alces_platform/settings/mapper_keys.h"

namespace alces::settings {

class TomlWriter {
 public:
  /// Lines of their own.
  void remark(std::string_view text);
  /// A comment may have several lines.
  void table(const char* name, const char* comment);

  template <typename T>
  void number(const char* key, const T& value, double, double, const char* comment) {
    line(key, fmt::format("{}", value), comment);
  }
  template <typename T>
  void hex(const char* key, const T& value, double, const char* comment) {
    line(key, fmt::format("0x{:X}", value), comment);
  }
  void flag(const char* key, bool value, const char* comment) {
    line(key, value ? "true" : "false", comment);
  }
  template <typename Enum>
  void choice(const char* key, const Enum& value, const Names<Enum>& names, const char* comment) {
    for (const auto& [name, named] : names) {
      if (named == value) line(key, fmt::format("\"{}\"", name), comment);
    }
  }
  void text(const char* key, const std::string& value, const char* comment) {
    line(key, quoted(value), comment);
  }
  void bytes(const char* key, std::uint64_t value, double least, double most, const char* comment);
  void words(const char* key, const std::vector<std::string>& values, std::size_t, const char* comment);
  template <typename T, std::size_t size>
  void numbers(const char* key, const std::array<T, size>& values, std::size_t, double, double,
               const char* comment) {
    line(key, fmt::format("[{}]", fmt::join(values, ", ")), comment);
  }
  template <typename Row, typename VisitRow>
  void rows(const char* key, const std::vector<Row>& rows, std::size_t, VisitRow visit_row,
            const char* comment) {
    std::vector<std::string> texts;
    for (const Row& row : rows) texts.push_back(inline_table(row, visit_row));
    list(key, texts, comment);
  }
  template <typename Row, typename VisitRow>
  void optional_row(const char* key, const Row& row, bool is_there, VisitRow visit_row, const char* comment) {
    if (!is_there) {
      remark(fmt::format("{}: none. {}", key, comment));
      return;
    }
    remark(comment);
    line(key, inline_table(row, visit_row), "");
  }

  static void retired(const char*) {}
  [[nodiscard]] static bool wants(const char*, bool is_set) { return is_set; }
  static void need(std::initializer_list<const char*>) {}
  static void expect(bool, const char*, const std::string&) {}

  std::string document;

 private:
  template <typename Row, typename VisitRow>
  [[nodiscard]] static std::string inline_table(const Row& row, VisitRow visit_row) {
    TomlWriter writer;
    writer.is_inline_ = true;
    visit_row(row, writer);
    return "{" + writer.document + "}";
  }
  [[nodiscard]] static std::string quoted(const std::string& text);
  void line(const char* key, const std::string& value, const char* comment);
  void list(const char* key, const std::vector<std::string>& entries, const char* comment);
  bool is_inline_ = false;
};

}  // namespace alces::settings
