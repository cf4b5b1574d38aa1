#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>

#include "alces_offline/binary_number.h"
#include "alces_offline/error.h"
#include "alces_offline/scan_format.h"
#include "alces_offline/text_numbers.h"

namespace alces::offline {
namespace {

struct Property {
  std::string name;
  NumberType type = NumberType::f32;
  std::optional<NumberType> list_count;  ///< of a list: the type of its length
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  [[nodiscard]] bool has_lists() const {
    return std::any_of(properties.begin(), properties.end(),
                       [](const Property& p) { return p.list_count.has_value(); });
  }
  /// Of one entry: exact without lists, else the least it can be.
  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = 0;
    for (const Property& property : properties) sum += size_of(property.list_count.value_or(property.type));
    return sum;
  }
};

enum class Encoding { ascii, little_endian, big_endian };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t end = 0;
  std::size_t lines = 0;
};

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
    if (line.empty()) return words;
    words.push_back(line.substr(0, line.find_first_of(" \t\r")));
    line.remove_prefix(words.back().size());
  }
}

std::optional<NumberType> number_type(std::string_view name) {
  if (name == "char" || name == "int8") return NumberType::i8;
  if (name == "uchar" || name == "uint8") return NumberType::u8;
  if (name == "short" || name == "int16") return NumberType::i16;
  if (name == "ushort" || name == "uint16") return NumberType::u16;
  if (name == "int" || name == "int32") return NumberType::i32;
  if (name == "uint" || name == "uint32") return NumberType::u32;
  if (name == "float" || name == "float32") return NumberType::f32;
  if (name == "double" || name == "float64") return NumberType::f64;
  return std::nullopt;
}

Header read_header(const ScanBytes& scan) {
  Header header;
  const auto fail = [&](const std::string& what) { throw InputError(scan.file, header.lines, what); };
  bool format_seen = false;
  while (true) {
    if (header.end >= scan.bytes.size())
      fail("the header ends without end_header; this is no whole PLY file");
    const std::size_t stop = std::min(scan.bytes.find('\n', header.end), scan.bytes.size());
    const std::vector<std::string_view> words = split(scan.bytes.substr(header.end, stop - header.end));
    header.end = std::min(stop + 1, scan.bytes.size());
    ++header.lines;
    const std::string_view key = words.empty() ? std::string_view() : words[0];
    if (header.lines == 1) {
      if (key != "ply") fail("a PLY file starts with the line \"ply\", this one does not");
    } else if (key == "end_header") {
      break;
    } else if (key == "format") {
      const std::string_view name = words.size() > 1 ? words[1] : std::string_view();
      format_seen = true;
      if (name == "ascii") {
        header.encoding = Encoding::ascii;
      } else if (name == "binary_little_endian") {
        header.encoding = Encoding::little_endian;
      } else if (name == "binary_big_endian") {
        header.encoding = Encoding::big_endian;
      } else {
        fail("the format is unknown; ascii, binary_little_endian and binary_big_endian are read");
      }
    } else if (key == "element") {
      Element element;
      bool whole = words.size() == 3;
      if (whole) {
        const char* const end = words[2].data() + words[2].size();
        const auto [at, error] = std::from_chars(words[2].data(), end, element.count);
        whole = error == std::errc{} && at == end;
        element.name = words[1];
      }
      if (!whole) fail("\"element NAME COUNT\" is needed here");
      header.elements.push_back(std::move(element));
    } else if (key == "property") {
      const bool list = words.size() == 5 && words[1] == "list";
      const std::optional<NumberType> type =
          list ? number_type(words[3]) : (words.size() == 3 ? number_type(words[1]) : std::nullopt);
      Property property{std::string(words.back()), type.value_or(NumberType::f32), std::nullopt};
      if (list) property.list_count = number_type(words[2]);
      if (!type || (list && !property.list_count) || header.elements.empty()) {
        fail("\"property TYPE NAME\" or \"property list TYPE TYPE NAME\" is needed here, with PLY's types");
      }
      header.elements.back().properties.push_back(std::move(property));
    } else if (!key.empty() && key != "comment" && key != "obj_info") {
      fail(fmt::format("\"{}\" is no entry of a PLY header", key.substr(0, 40)));
    }
  }
  if (!format_seen) fail("the header has no format line");
  return header;
}

// The numbers of the body one after the other, whatever the encoding.
class Body {
 public:
  Body(const ScanBytes& scan, const Header& header)
      : scan_(scan),
        ascii_(header.encoding == Encoding::ascii),
        order_(header.encoding == Encoding::big_endian ? std::endian::big : std::endian::little),
        at_(scan.bytes.data() + header.end),
        end_(scan.bytes.data() + scan.bytes.size()),
        line_(header.lines + 1) {}

  [[nodiscard]] std::size_t bytes_left() const { return static_cast<std::size_t>(end_ - at_); }

  /// False at the end of the file.
  bool number(NumberType type, double& value) {
    if (!ascii_) {
      if (bytes_left() < size_of(type)) return false;
      value = load_number(at_, type, order_);
      at_ += size_of(type);
      return true;
    }
    while (is_blank(*at_) || *at_ == '\n') line_ += *at_++ == '\n' ? 1U : 0U;
    if (at_ >= end_) return false;
    const char* const next = parse_number(at_, end_, value);
    if (next == nullptr) {
      throw InputError(scan_.file, line_,
                       fmt::format("\"{}\" is no number; correct the line",
                                   std::string_view(at_, std::min<std::size_t>(bytes_left(), 20))));
    }
    at_ = next;
    return true;
  }

  bool skip(NumberType type, std::uint64_t count) {
    if (!ascii_) {
      if (bytes_left() / size_of(type) < count) return false;
      at_ += size_of(type) * count;
      return true;
    }
    double ignored = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      if (!number(type, ignored)) return false;
    }
    return true;
  }

  bool skip_list(const Property& property) {
    double count = 0;
    if (!number(*property.list_count, count)) return false;
    if (!(count >= 0 && count <= 4294967295.0) || count != std::floor(count)) {
      throw InputError(scan_.file, fmt::format("a list \"{}\" has the length {}; the file is damaged",
                                               property.name, count));
    }
    return skip(property.type, static_cast<std::uint64_t>(count));
  }

  [[nodiscard]] const char* at() const { return at_; }
  [[nodiscard]] bool ascii() const { return ascii_; }
  [[nodiscard]] std::endian order() const { return order_; }

 private:
  const ScanBytes& scan_;
  bool ascii_;
  std::endian order_;
  const char* at_;
  const char* end_;
  std::size_t line_;
};

bool skip_element(Body& body, const Element& element) {
  if (!body.ascii() && !element.has_lists()) {
    const std::size_t bytes = element.bytes();
    return bytes == 0 ||
           (body.bytes_left() / bytes >= element.count && body.skip(NumberType::u8, bytes * element.count));
  }
  if (element.properties.empty()) return true;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      if (!(property.list_count ? body.skip_list(property) : body.skip(property.type, 1))) return false;
    }
  }
  return true;
}

void read_vertices(const ScanBytes& scan, Body& body, const Element& vertex, std::vector<Point>& points) {
  std::vector<std::size_t> axis_of;  // per property; 3: not ours
  std::array<bool, 3> found{};
  for (const Property& property : vertex.properties) {
    std::size_t axis = property.name.size() == 1 && !property.list_count
                           ? std::string_view("xyz").find(property.name)
                           : std::string_view::npos;
    axis = std::min<std::size_t>(axis, 3);
    if (axis < 3) found.at(axis) = true;
    axis_of.push_back(axis);
  }
  if (!found[0] || !found[1] || !found[2]) {
    std::vector<std::string> names;
    for (const Property& property : vertex.properties) names.push_back(property.name);
    throw InputError(scan.file,
                     fmt::format("the properties of element vertex are \"{}\"; x, y and z are needed",
                                 fmt::join(names, " ")));
  }
  // before anything is allocated: can the file hold what it promises? As text a number takes two bytes or
  // more.
  const std::size_t least_bytes = body.ascii() ? 2 * vertex.properties.size() - 1 : vertex.bytes();
  const auto fail_truncated = [&](std::uint64_t there) {
    throw InputError(scan.file,
                     fmt::format("holds {} points, its header promises {}; the file is cut off, copy it "
                                 "again",
                                 there, vertex.count));
  };
  if (body.bytes_left() / least_bytes < vertex.count) {
    if (!body.ascii() && !vertex.has_lists()) fail_truncated(body.bytes_left() / least_bytes);
  } else {
    points.reserve(vertex.count);
  }
  for (std::uint64_t i = 0; i < vertex.count; ++i) {
    std::array<float, 4> xyz{};
    for (std::size_t p = 0; p < axis_of.size(); ++p) {
      const Property& property = vertex.properties[p];
      double value = 0;
      const bool there = property.list_count ? body.skip_list(property) : body.number(property.type, value);
      if (!there) fail_truncated(i);
      xyz.at(axis_of[p]) = static_cast<float>(value);
    }
    points.push_back({xyz[0], xyz[1], xyz[2]});
  }
}

}  // namespace

void parse_ply(const ScanBytes& scan, std::vector<Point>& points) {
  points.clear();
  const Header header = read_header(scan);
  Body body(scan, header);
  for (const Element& element : header.elements) {
    if (element.name == "vertex") return read_vertices(scan, body, element, points);
    if (!skip_element(body, element)) {
      throw InputError(scan.file,
                       fmt::format("ends within element {}, before the points; the file is cut off, copy it "
                                   "again",
                                   element.name));
    }
  }
  throw InputError(scan.file, "the header has no element vertex, so there are no points in this PLY file");
}

}  // namespace alces::offline
