#include "alces_platform/dictionary/object_dictionary_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <fstream>
#include <utility>

namespace alces {
namespace {

using Path = std::filesystem::path;

constexpr std::size_t highest_sub = 254;
constexpr std::size_t largest_bytes = std::size_t{64} << 20;

DictionaryError error_of(const Path& file, const std::string& what) {
  return DictionaryError(fmt::format("{}: {}", file.string(), what));
}

DictionaryError error_of(const Path& file, std::size_t line, const std::string& what) {
  return DictionaryError(fmt::format("{}:{}: {}", file.string(), line, what));
}

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

std::string_view trimmed(std::string_view text) {
  const auto is_space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

/// "0x7  ; a remark": what stands before a semicolon with a blank in front.
std::string_view without_remark(std::string_view value) {
  for (std::size_t at = value.find(';'); at != std::string_view::npos; at = value.find(';', at + 1)) {
    if (at == 0 || value[at - 1] == ' ' || value[at - 1] == '\t') return trimmed(value.substr(0, at));
  }
  return value;
}

/// Decimal, 0x..., octal with a leading 0 (decimal where it has an 8 or a 9: files written by hand).
std::optional<std::int64_t> plain_number(std::string_view text) {
  int base = 10;
  if (text.starts_with("0x") || text.starts_with("0X")) {
    text.remove_prefix(2);
    base = 16;
  } else if (text.size() > 1 && text.front() == '0' && text.find_first_of("89") == std::string_view::npos) {
    text.remove_prefix(1);
    base = 8;
  }
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return static_cast<std::int64_t>(value);
}

std::optional<std::uint32_t> hexadecimal(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::uint32_t key_of(std::uint16_t index, std::uint8_t sub) {
  return static_cast<std::uint32_t>(index) << 8 | sub;
}

bool is_string(std::uint16_t data_type) {
  return data_type >= 0x9 && data_type <= 0xF;  // strings, times, DOMAIN
}

bool is_real(std::uint16_t data_type) {
  return data_type == 0x8 || data_type == 0x11;
}

}  // namespace

std::optional<std::int64_t> object_value(std::string_view text, std::uint8_t node) {
  text = trimmed(text);
  std::int64_t sum = 0;
  bool is_first = true;
  while (!text.empty()) {
    bool is_negative = false;
    if (text.front() == '+' || text.front() == '-') {
      is_negative = text.front() == '-';
      text = trimmed(text.substr(1));
    } else if (!is_first) {
      return std::nullopt;
    }
    const std::string_view term = trimmed(text.substr(0, text.find_first_of("+-")));
    text = trimmed(text.substr(std::min(text.size(), text.find_first_of("+-"))));
    const std::optional<std::int64_t> value =
        lower(term) == "$nodeid" ? std::optional<std::int64_t>(node) : plain_number(term);
    if (!value) return std::nullopt;
    const std::uint64_t bits = static_cast<std::uint64_t>(*value);
    sum = static_cast<std::int64_t>(static_cast<std::uint64_t>(sum) + (is_negative ? 0 - bits : bits));
    is_first = false;
  }
  return is_first ? std::nullopt : std::optional(sum);
}

/// One pass over the lines; each section's entries are taken in when the next one begins.
class ObjectDictionaryFileParser {
 public:
  ObjectDictionaryFileParser(std::string_view text, const Path& file) : text_(text), file_(file) {}

  ObjectDictionaryFile run() {
    if (text_.starts_with("\xEF\xBB\xBF")) text_.remove_prefix(3);
    if (const std::size_t zero = text_.find('\0'); zero != std::string_view::npos) {
      throw error_of(file_, fmt::format("byte {} is 0: this is no EDS or DCF text", zero));
    }
    while (!text_.empty()) {
      const std::size_t end = std::min(text_.find('\n'), text_.size());
      ++line_;
      read_line(trimmed(text_.substr(0, end)));
      text_.remove_prefix(std::min(end + 1, text_.size()));
    }
    end_section();
    expand_compact();
    if (result_.objects_.empty() && stray_line_ > 0) {
      throw error_of(file_, stray_line_,
                     "is neither a [section] nor Name=value; is this an EDS or DCF file?");
    }
    if (result_.objects_.empty()) {
      throw error_of(file_, "holds no object such as [1000]; is this an EDS or DCF file?");
    }
    return std::move(result_);
  }

 private:
  struct Entry {
    std::string value;
    std::size_t line;
  };
  struct Compact {
    std::uint16_t index;
    std::size_t count;
    ObjectDescription description;
  };

  void read_line(std::string_view line) {
    if (line.empty() || line.front() == ';' || line.front() == '#') return;
    if (line.front() == '[') {
      const std::size_t end = line.find(']');
      if (end == std::string_view::npos) throw error_of(file_, line_, "a section's name has no closing ']'");
      end_section();
      section_ = lower(trimmed(line.substr(1, end - 1)));
      section_line_ = line_;
      has_section_ = true;
      return;
    }
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos) {
      warn(line_, "a line that is neither a [section] nor Name=value is passed over");
      if (stray_line_ == 0) stray_line_ = line_;
      return;
    }
    if (!has_section_) {
      warn(line_, "a value before the first [section] is passed over");
      if (stray_line_ == 0) stray_line_ = line_;
      return;
    }
    entries_[lower(trimmed(line.substr(0, equals)))] = {
        std::string(without_remark(trimmed(line.substr(equals + 1)))), line_};
  }

  void end_section() {
    if (section_ == "deviceinfo") {
      result_.vendor_ = text_of("vendorname");
      result_.product_ = text_of("productname");
    } else if (section_ == "devicecomissioning" ||
               section_ == "devicecommissioning") {  // the standard has one m
      read_node();
    } else if (section_.size() >= 4) {
      if (const auto index = hexadecimal(std::string_view(section_).substr(0, 4))) {
        read_object_section(static_cast<std::uint16_t>(*index), std::string_view(section_).substr(4));
      }
    }
    section_.clear();
    entries_.clear();
  }

  void read_node() {
    const auto entry = entries_.find("nodeid");
    if (entry == entries_.end() || entry->second.value.empty()) return;
    const std::optional<std::int64_t> node = object_value(entry->second.value, 0);
    if (!node || *node < 1 || *node > 127) {
      throw error_of(file_, entry->second.line,
                     fmt::format("NodeID={} is no node number (1 to 127)", entry->second.value));
    }
    result_.node_ = static_cast<std::uint8_t>(*node);
  }

  void read_object_section(std::uint16_t index, std::string_view rest) {
    if (rest.empty()) {
      if (entries_.contains("compactsubobj") && number_of("compactsubobj") > 0) return read_compact(index);
      if (entries_.contains("subnumber") && !entries_.contains("datatype")) {
        result_.names_[index] = text_of("parametername");
        return;
      }
      return add(index, 0, description());
    }
    if (rest.starts_with("sub")) {
      const auto sub = hexadecimal(rest.substr(3));
      if (!sub || *sub > 0xFF)
        throw error_of(file_, section_line_, fmt::format("[{}]: no sub-index", section_));
      return add(index, static_cast<std::uint8_t>(*sub), description());
    }
    if (rest == "name" || rest == "value") {
      auto& list = rest == "name" ? compact_names_ : compact_values_;
      for (const auto& [key, entry] : entries_) {
        const std::optional<std::int64_t> sub = plain_number(key);
        if (sub && *sub > 0 && *sub <= 254)
          list[key_of(index, static_cast<std::uint8_t>(*sub))] = entry.value;
      }
    }
  }

  ObjectDescription description() {
    ObjectDescription object;
    object.name = text_of("parametername");
    const std::int64_t type = number_of("datatype");
    if (type < 0 || type > 0xFFFF) {
      throw error_of(file_, entries_["datatype"].line,
                     fmt::format("[{}]: DataType={} is no data type", section_, type));
    }
    object.data_type = static_cast<std::uint16_t>(type);
    object.access = lower(text_of("accesstype"));
    object.is_pdo_mappable = number_of("pdomapping") != 0;
    object.default_value = text_of("defaultvalue");
    object.parameter_value = text_of("parametervalue");
    object.line = section_line_;
    if (object.data_type == 0) warn(section_line_, "has no DataType");
    return object;
  }

  void add(std::uint16_t index, std::uint8_t sub, const ObjectDescription& object) {
    for (const std::string* value : {&object.default_value, &object.parameter_value}) {
      const bool is_number =
          object.data_type != 0 && !is_string(object.data_type) && !is_real(object.data_type);
      if (is_number && !value->empty() && !object_value(*value, 1)) {
        warn(section_line_, fmt::format("'{}' is no number and is left out", *value));
      }
    }
    if (!result_.objects_.insert_or_assign(key_of(index, sub), object).second) {
      warn(section_line_, "is there twice; the later one counts");
    }
  }

  /// One description for all sub-indices: they follow when the whole file has been read.
  void read_compact(std::uint16_t index) {
    const std::int64_t count = number_of("compactsubobj");
    if (count > static_cast<std::int64_t>(highest_sub)) {
      throw error_of(file_, entries_["compactsubobj"].line,
                     fmt::format("CompactSubObj={} is more than 254", count));
    }
    compacts_.push_back({index, static_cast<std::size_t>(count), description()});
    result_.names_[index] = compacts_.back().description.name;
  }

  void expand_compact() {
    for (const Compact& compact : compacts_) {
      ObjectDescription& number = result_.objects_.try_emplace(key_of(compact.index, 0)).first->second;
      if (number.data_type == 0) {
        number.name = "NrOfObjects";
        number.data_type = 5;
        number.access = "ro";
        number.default_value = std::to_string(compact.count);
      }
      for (std::size_t sub = 1; sub <= compact.count; ++sub) {
        const std::uint32_t key = key_of(compact.index, static_cast<std::uint8_t>(sub));
        ObjectDescription object = compact.description;
        const auto name = compact_names_.find(key);
        object.name = name != compact_names_.end() ? name->second : fmt::format("{}{}", object.name, sub);
        if (const auto value = compact_values_.find(key); value != compact_values_.end()) {
          object.parameter_value = value->second;
        }
        result_.objects_.try_emplace(key, object);
      }
    }
  }

  std::string text_of(const std::string& key) const {
    const auto entry = entries_.find(key);
    return entry == entries_.end() ? "" : entry->second.value;
  }

  /// 0 where it is missing or empty.
  std::int64_t number_of(const std::string& key) const {
    const auto entry = entries_.find(key);
    if (entry == entries_.end() || entry->second.value.empty()) return 0;
    const std::optional<std::int64_t> value = object_value(entry->second.value, 0);
    if (!value) {
      throw error_of(file_, entry->second.line,
                     fmt::format("[{}]: {}={} is no number", section_, key, entry->second.value));
    }
    return *value;
  }

  void warn(std::size_t line, const std::string& what) {
    result_.warnings_.push_back(fmt::format("{}:{}: [{}] {}", file_.string(), line, section_, what));
  }

  std::string_view text_;
  const Path& file_;
  ObjectDictionaryFile result_;
  std::size_t line_ = 0;
  std::string section_;
  std::size_t section_line_ = 0;
  bool has_section_ = false;
  std::size_t stray_line_ = 0;  ///< the first that says nothing; 0: none
  std::map<std::string, Entry> entries_;
  std::vector<Compact> compacts_;
  std::map<std::uint32_t, std::string> compact_names_;
  std::map<std::uint32_t, std::string> compact_values_;
};

ObjectDictionaryFile ObjectDictionaryFile::read(const Path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    throw error_of(file, "is no file; give the drive's EDS or DCF file");
  std::ifstream stream(file, std::ios::binary);
  std::string text(
      std::min(largest_bytes, static_cast<std::size_t>(std::filesystem::file_size(file, ignored))), '\0');
  if (!stream.read(text.data(), static_cast<std::streamsize>(text.size())))
    throw error_of(file, "cannot be read");
  if (text.empty()) throw error_of(file, "is empty; an EDS or DCF file is needed here");
  return parse(text, file);
}

ObjectDictionaryFile ObjectDictionaryFile::parse(std::string_view text, const Path& file) {
  return ObjectDictionaryFileParser(text, file).run();
}

const ObjectDescription* ObjectDictionaryFile::find(std::uint16_t index, std::uint8_t sub) const {
  const auto object = objects_.find(key_of(index, sub));
  return object == objects_.end() ? nullptr : &object->second;
}

std::string_view ObjectDictionaryFile::name(std::uint16_t index) const {
  if (const auto name = names_.find(index); name != names_.end()) return name->second;
  const ObjectDescription* object = find(index, 0);
  return object == nullptr ? std::string_view() : std::string_view(object->name);
}

std::optional<std::int64_t> ObjectDictionaryFile::value(std::uint16_t index, std::uint8_t sub,
                                                        std::uint8_t node) const {
  const ObjectDescription* object = find(index, sub);
  if (object == nullptr) return std::nullopt;
  if (const auto value = object_value(object->parameter_value, node)) return value;
  return object_value(object->default_value, node);
}

}  // namespace alces
