#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "offline/io/files/error.h"
#include "offline/io/files/text_numbers.h"
#include "ply_header.h"
#include "scan_format.h"

namespace alces::offline {
namespace {

// The numbers of the body one after the other, whatever the encoding.
class Body {
 public:
  Body(const ScanBytes& scan, const PlyHeader& header)
      : scan_(scan),
        ascii_(header.encoding == PlyEncoding::ascii),
        order_(header.encoding == PlyEncoding::big_endian ? std::endian::big : std::endian::little),
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
      const std::string_view text(at_, std::min<std::size_t>(bytes_left(), 20));
      throw InputError(scan_.file, line_,
                       fmt::format("\"{}\" is no number; correct the line",
                                   text.substr(0, text.find_first_of(" \t\r\n"))));
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

  bool skip_list(const PlyProperty& property) {
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

bool skip_element(Body& body, const PlyElement& element) {
  if (!body.ascii() && !element.has_lists()) {
    const std::size_t bytes = element.bytes();
    return bytes == 0 ||
           (body.bytes_left() / bytes >= element.count && body.skip(NumberType::u8, bytes * element.count));
  }
  if (element.properties.empty()) return true;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& property : element.properties) {
      if (!(property.list_count ? body.skip_list(property) : body.skip(property.type, 1))) return false;
    }
  }
  return true;
}

void read_vertices(const ScanBytes& scan, Body& body, const PlyElement& vertex, std::vector<Point>& points) {
  std::vector<std::size_t> axis_of;  // per property; 3: not ours
  std::array<bool, 3> found{};
  for (const PlyProperty& property : vertex.properties) {
    std::size_t axis = property.name.size() == 1 && !property.list_count
                           ? std::string_view("xyz").find(property.name)
                           : std::string_view::npos;
    axis = std::min<std::size_t>(axis, 3);
    if (axis < 3) found.at(axis) = true;
    axis_of.push_back(axis);
  }
  if (!found[0] || !found[1] || !found[2]) {
    std::vector<std::string> names;
    for (const PlyProperty& property : vertex.properties) names.push_back(property.name);
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
    std::array<double, 4> xyz{};
    for (std::size_t p = 0; p < axis_of.size(); ++p) {
      const PlyProperty& property = vertex.properties[p];
      double value = 0;
      const bool there = property.list_count ? body.skip_list(property) : body.number(property.type, value);
      if (!there) fail_truncated(i);
      xyz.at(axis_of[p]) = value;
    }
    points.push_back(scan.reading.point(xyz[0], xyz[1], xyz[2]));
  }
}

}  // namespace

void parse_ply(const ScanBytes& scan, ScanPoints& out) {
  out.clear();
  std::vector<Point>& points = out.points;
  const PlyHeader header = read_ply_header(scan.file, scan.bytes);
  Body body(scan, header);
  for (const PlyElement& element : header.elements) {
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
