#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <charconv>
#include <cstdint>
#include <optional>

#include "offline/io/files/binary_number.h"
#include "offline/io/files/error.h"
#include "offline/io/files/lzf.h"
#include "offline/io/files/text_numbers.h"
#include "scan_format.h"

namespace alces::offline {
namespace {

struct Field {
  std::string name;
  std::size_t size = 4;
  char kind = 'F';
  std::size_t count = 1;
};

struct Column {
  NumberType type = NumberType::f32;
  std::size_t offset = 0;  ///< in bytes, within one point
  std::size_t place = 0;   ///< as text: how many numbers stand before it
};

struct Header {
  std::vector<Field> fields;
  std::uint64_t points = 0;
  std::string data;
  std::size_t end = 0;    ///< where the data starts
  std::size_t lines = 0;  ///< of the header
  std::size_t point_bytes = 0;
  std::size_t numbers = 0;  ///< of one point, as text
  std::array<Column, 3> xyz{};
};

std::optional<NumberType> number_type(char kind, std::size_t size) {
  switch (kind) {
    case 'F':
      if (size == 4) return NumberType::f32;
      if (size == 8) return NumberType::f64;
      break;
    case 'I':
      if (size == 1) return NumberType::i8;
      if (size == 2) return NumberType::i16;
      if (size == 4) return NumberType::i32;
      if (size == 8) return NumberType::i64;
      break;
    case 'U':
      if (size == 1) return NumberType::u8;
      if (size == 2) return NumberType::u16;
      if (size == 4) return NumberType::u32;
      if (size == 8) return NumberType::u64;
      break;
    default:
      break;
  }
  return std::nullopt;
}

class HeaderReader {
 public:
  explicit HeaderReader(const ScanBytes& scan) : scan_(scan) {}

  Header read() {
    while (header_.data.empty()) {
      if (header_.end >= scan_.bytes.size())
        fail("the header ends without a DATA line; this is no whole PCD file");
      const std::size_t stop = std::min(scan_.bytes.find('\n', header_.end), scan_.bytes.size());
      const std::string_view line = scan_.bytes.substr(header_.end, stop - header_.end);
      header_.end = std::min(stop + 1, scan_.bytes.size());
      ++header_.lines;
      entry(split_words(line));
    }
    finish();
    return header_;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(scan_.file, header_.lines, what); }

  std::uint64_t number(std::string_view word) const {
    std::uint64_t value = 0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || stop != word.data() + word.size()) {
      fail(fmt::format("\"{}\" is no whole number; correct the PCD header", word.substr(0, 40)));
    }
    return value;
  }

  void entry(const std::vector<std::string_view>& words) {
    if (words.empty() || words[0].front() == '#') return;
    const std::string_view key = words[0];
    const auto one_a_field = [&] {
      if (words.size() - 1 != header_.fields.size()) {
        fail(fmt::format("{} has {} values for {} FIELDS; correct the PCD header", key, words.size() - 1,
                         header_.fields.size()));
      }
    };
    const auto value = [&] {
      if (words.size() < 2) fail(fmt::format("{} has no value; correct the PCD header", key));
      return words[1];
    };
    if (key == "FIELDS" || key == "COLUMNS") {
      for (std::size_t i = 1; i < words.size(); ++i)
        header_.fields.push_back({.name = std::string(words[i])});
    } else if (key == "SIZE") {
      one_a_field();
      for (std::size_t i = 1; i < words.size(); ++i) header_.fields[i - 1].size = number(words[i]);
    } else if (key == "TYPE") {
      one_a_field();
      for (std::size_t i = 1; i < words.size(); ++i) header_.fields[i - 1].kind = words[i].front();
    } else if (key == "COUNT") {
      one_a_field();
      for (std::size_t i = 1; i < words.size(); ++i) header_.fields[i - 1].count = number(words[i]);
    } else if (key == "WIDTH") {
      width_ = number(value());
    } else if (key == "HEIGHT") {
      height_ = number(value());
    } else if (key == "POINTS") {
      points_ = number(value());
    } else if (key == "DATA") {
      header_.data = value();
    } else if (key != "VERSION" && key != "VIEWPOINT") {
      fail(fmt::format("\"{}\" is no entry of a PCD header; is this a PCD file?", key.substr(0, 40)));
    }
  }

  void finish() {
    if (points_) {
      header_.points = *points_;
    } else if (width_ && (height_.value_or(1) == 0 || *width_ <= UINT64_MAX / height_.value_or(1))) {
      header_.points = *width_ * height_.value_or(1);
    } else {
      fail("the header has neither POINTS nor WIDTH and HEIGHT; correct the PCD header");
    }
    std::array<bool, 3> found{};
    for (const Field& field : header_.fields) {
      const std::optional<NumberType> type = number_type(field.kind, field.size);
      // 64 Ki numbers in one field is more than any descriptor has
      if (!type || field.count > 65536) {
        fail(fmt::format(
            "field {} has type {}, size {} and count {}; types are F with 4 or 8 bytes, I and U with 1, "
            "2, 4 or 8",
            field.name, field.kind, field.size, field.count));
      }
      const std::size_t axis = std::string_view("xyz").find(field.name);
      if (field.name.size() == 1 && axis < 3 && field.count > 0) {
        header_.xyz.at(axis) = {*type, header_.point_bytes, header_.numbers};
        found.at(axis) = true;
      }
      header_.point_bytes += field.size * field.count;
      header_.numbers += field.count;
    }
    if (!found[0] || !found[1] || !found[2]) {
      std::vector<std::string> names;
      for (const Field& field : header_.fields) names.push_back(field.name);
      fail(fmt::format("the fields are \"{}\"; x, y and z are needed", fmt::join(names, " ")));
    }
  }

  const ScanBytes& scan_;
  Header header_;
  std::optional<std::uint64_t> width_;
  std::optional<std::uint64_t> height_;
  std::optional<std::uint64_t> points_;
};

[[noreturn]] void fail_truncated(const ScanBytes& scan, std::uint64_t there, std::uint64_t promised) {
  throw InputError(scan.file,
                   fmt::format("holds {} points, its header promises {}; the file is cut off, copy it again",
                               there, promised));
}

double coordinate(const char* at, NumberType type) {
  if (type == NumberType::f32) return static_cast<double>(load<float>(at, std::endian::little));
  return load_number(at, type, std::endian::little);
}

void parse_binary(const ScanBytes& scan, const Header& header, std::vector<Point>& points) {
  const std::string_view data = scan.bytes.substr(header.end);
  if (data.size() / header.point_bytes < header.points) {
    fail_truncated(scan, data.size() / header.point_bytes, header.points);
  }
  points.resize(header.points);
  const char* at = data.data();
  for (Point& point : points) {
    point = scan.reading.point(coordinate(at + header.xyz[0].offset, header.xyz[0].type),
                               coordinate(at + header.xyz[1].offset, header.xyz[1].type),
                               coordinate(at + header.xyz[2].offset, header.xyz[2].type));
    at += header.point_bytes;
  }
}

// Field by field: all x, then all y, ...
void parse_compressed(const ScanBytes& scan, const Header& header, std::vector<Point>& points) {
  std::string_view data = scan.bytes.substr(header.end);
  constexpr std::size_t sizes_bytes = 8;
  if (data.size() < sizes_bytes) fail_truncated(scan, 0, header.points);
  const std::uint64_t compressed = load<std::uint32_t>(data.data(), std::endian::little);
  const std::uint64_t plain = load<std::uint32_t>(data.data() + 4, std::endian::little);
  data.remove_prefix(sizes_bytes);
  if (plain % header.point_bytes != 0 || plain / header.point_bytes != header.points) {
    fail_truncated(scan, plain / header.point_bytes, header.points);
  }
  if (compressed > data.size()) {
    throw InputError(scan.file,
                     fmt::format("holds {} of {} compressed bytes, so that the {} points that its header "
                                 "promises cannot be had; the file is cut off, copy it again",
                                 data.size(), compressed, header.points));
  }
  std::vector<char> bytes;
  if (plain / lzf_largest_expansion <= compressed) bytes.resize(plain);
  if (bytes.size() != plain || !lzf_decompress(data.substr(0, compressed), bytes)) {
    throw InputError(scan.file,
                     fmt::format("the {} compressed bytes do not unpack to the {} points that its header "
                                 "promises; the file is damaged, copy it again",
                                 compressed, header.points));
  }
  points.resize(header.points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto at = [&](const Column& column) {
      return coordinate(bytes.data() + column.offset * points.size() + i * size_of(column.type), column.type);
    };
    points[i] = scan.reading.point(at(header.xyz[0]), at(header.xyz[1]), at(header.xyz[2]));
  }
}

void parse_ascii(const ScanBytes& scan, const Header& header, std::vector<Point>& points) {
  points.clear();
  const char* at = scan.bytes.data() + header.end;
  const char* const end = scan.bytes.data() + scan.bytes.size();
  std::size_t line = header.lines + 1;
  while (points.size() < header.points) {
    while (is_blank(*at) || *at == '\n') line += *at++ == '\n' ? 1U : 0U;
    if (at >= end) fail_truncated(scan, points.size(), header.points);
    std::array<double, 3> xyz{};
    for (std::size_t place = 0; place < header.numbers; ++place) {
      while (is_blank(*at)) ++at;
      double value = 0;
      const char* const next = parse_number(at, end, value);
      if (next == nullptr) {
        throw InputError(scan.file, line,
                         fmt::format("number {} of {} is missing or is no number; correct the line",
                                     place + 1, header.numbers));
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (header.xyz.at(axis).place == place) xyz.at(axis) = value;
      }
      at = next;
    }
    points.push_back(scan.reading.point(xyz[0], xyz[1], xyz[2]));
    while (*at != '\n' && at != end) ++at;
  }
}

}  // namespace

void parse_pcd(const ScanBytes& scan, ScanPoints& out) {
  out.clear();
  std::vector<Point>& points = out.points;
  const Header header = HeaderReader(scan).read();
  if (header.data == "ascii") {
    parse_ascii(scan, header, points);
  } else if (header.data == "binary") {
    parse_binary(scan, header, points);
  } else if (header.data == "binary_compressed") {
    parse_compressed(scan, header, points);
  } else {
    throw InputError(scan.file, header.lines,
                     fmt::format("DATA \"{}\" is unknown; ascii, binary and binary_compressed are read",
                                 header.data.substr(0, 40)));
  }
}

}  // namespace alces::offline
