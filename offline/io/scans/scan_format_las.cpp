#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "las_layout.h"
#include "offline/io/files/binary_number.h"
#include "offline/io/files/error.h"
#include "scan_format.h"

namespace alces::offline {
namespace {

template <typename T>
T at(std::string_view bytes, std::size_t offset) {
  return load<T>(bytes.data() + offset, std::endian::little);
}

struct Header {
  std::uint64_t count = 0;
  std::size_t points_at = 0;
  std::size_t record_bytes = 0;
  std::array<double, 3> scale{};
  std::array<double, 3> offset_m{};
};

Header read_header(const ScanBytes& scan) {
  const std::string_view bytes = scan.bytes;
  if (!bytes.starts_with("LASF")) throw InputError(scan.file, "does not begin with LASF; it is no LAS file");
  if (bytes.size() < las::header_bytes_1_0)
    throw InputError(scan.file, fmt::format("ends after {} bytes, within its header", bytes.size()));
  const auto minor = at<std::uint8_t>(bytes, las::version_minor_at);
  const auto format = at<std::uint8_t>(bytes, las::format_at);
  if ((format & las::compressed_flag) != 0)
    throw InputError(scan.file,
                     "is compressed (LAZ), for which Debian has no library; write it as LAS first");
  if (format >= las::record_bytes.size())
    throw InputError(scan.file, fmt::format("has point format {}; LAS has 0 to 10", format));
  Header header;
  header.points_at = at<std::uint32_t>(bytes, las::points_at);
  header.record_bytes = at<std::uint16_t>(bytes, las::record_size_at);
  if (header.record_bytes < las::record_bytes.at(format))
    throw InputError(scan.file, fmt::format("has records of {} bytes; point format {} needs {}",
                                            header.record_bytes, format, las::record_bytes.at(format)));
  header.count = at<std::uint32_t>(bytes, las::legacy_count_at);
  if (minor >= 4) {
    if (bytes.size() < las::header_bytes)
      throw InputError(scan.file, fmt::format("ends after {} bytes, within its header", bytes.size()));
    header.count = at<std::uint64_t>(bytes, las::count_at);
  }
  const std::size_t room =
      bytes.size() > header.points_at ? (bytes.size() - header.points_at) / header.record_bytes : 0;
  if (header.count > room)
    throw InputError(scan.file,
                     fmt::format("promises {} points and holds {}; it is cut off", header.count, room));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    header.scale.at(axis) = at<double>(bytes, las::scale_at + 8 * axis);
    header.offset_m.at(axis) = at<double>(bytes, las::offset_at + 8 * axis);
    const bool is_usable = std::isfinite(header.scale.at(axis)) && header.scale.at(axis) != 0 &&
                           std::isfinite(header.offset_m.at(axis));
    if (!is_usable) throw InputError(scan.file, "has a scale or offset that is no number");
  }
  return header;
}

}  // namespace

void parse_las(const ScanBytes& scan, ScanPoints& out) {
  out.clear();
  std::vector<Point>& points = out.points;
  const Header header = read_header(scan);
  points.resize(header.count);
  const char* record = scan.bytes.data() + header.points_at;
  for (Point& point : points) {
    const auto coordinate = [&](std::size_t axis) {
      const auto steps = load<std::int32_t>(record + 4 * axis, std::endian::little);
      return steps * header.scale.at(axis) + header.offset_m.at(axis);
    };
    point = scan.reading.point(coordinate(0), coordinate(1), coordinate(2));
    record += header.record_bytes;
  }
}

}  // namespace alces::offline
