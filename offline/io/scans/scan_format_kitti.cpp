#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>

#include "offline/io/files/binary_number.h"
#include "offline/io/files/error.h"
#include "scan_format.h"

namespace alces::offline {
namespace {

constexpr BinaryRecord kitti = {4, false};
constexpr BinaryRecord nuscenes = {5, false};

/// What the numbers at one place of all records look like.
struct Column {
  bool is_whole = true;
  float least = INFINITY;
  float most = -INFINITY;
  double negative_share = 0;
};

Column column_of(std::string_view bytes, const BinaryRecord& record, std::size_t place) {
  constexpr std::size_t enough = 20'000;
  const std::size_t records = bytes.size() / record.bytes();
  const std::size_t step = std::max<std::size_t>(1, records / enough);
  Column column;
  std::size_t count = 0;
  std::size_t negative = 0;
  for (std::size_t i = 0; i < records; i += step) {
    const auto value = load<float>(bytes.data() + i * record.bytes() + 4 * place, std::endian::little);
    column.is_whole = column.is_whole && value == std::floor(value) && std::abs(value) < 1e6F;
    column.least = std::fmin(column.least, value);
    column.most = std::fmax(column.most, value);
    negative += value < 0 ? 1U : 0U;
    ++count;
  }
  if (count > 0) column.negative_share = static_cast<double>(negative) / static_cast<double>(count);
  return column;
}

constexpr double intensities_may_be_negative = 0.05;  // as share of all

/// x y z intensity ring: the ring is a small whole number, the coordinates are none.
bool looks_like_nuscenes(std::string_view bytes) {
  constexpr std::size_t least_records = 8;  // fewer say nothing
  if (bytes.size() % nuscenes.bytes() != 0 || bytes.size() < least_records * nuscenes.bytes()) return false;
  const Column ring = column_of(bytes, nuscenes, 4);
  return ring.is_whole && ring.least >= 0 && ring.most <= 255 &&
         column_of(bytes, nuscenes, 3).negative_share <= intensities_may_be_negative &&
         !column_of(bytes, nuscenes, 0).is_whole;
}

constexpr const char* remedy =
    "say with --format what a point is: kitti (x y z intensity), float32x5, float64x3, ...";

}  // namespace

std::optional<BinaryRecord> binary_record_called(std::string_view name) {
  BinaryRecord record;
  if (name == "kitti") return kitti;
  if (name == "nuscenes") return nuscenes;
  record.is_double = name.starts_with("float64x");
  if (!record.is_double && !name.starts_with("float32x")) return std::nullopt;
  name.remove_prefix(8);
  constexpr std::size_t most_numbers = 64;
  const auto [stop, error] = std::from_chars(name.data(), name.data() + name.size(), record.numbers);
  if (error != std::errc{} || stop != name.data() + name.size()) return std::nullopt;
  if (record.numbers < 3 || record.numbers > most_numbers) return std::nullopt;
  return record;
}

BinaryRecord recognise_record(const ScanBytes& scan) {
  const std::string_view bytes = scan.bytes;
  // nuScenes calls its sweeps NAME.pcd.bin
  const bool is_called_nuscenes = scan.file.stem().extension() == ".pcd";
  if ((is_called_nuscenes && !bytes.empty() && bytes.size() % nuscenes.bytes() == 0) ||
      looks_like_nuscenes(bytes)) {
    scan.warnings.push_back(
        fmt::format("{}: taken as five float32 a point (x y z intensity ring, as nuScenes has them){}; "
                    "--format kitti if it is four",
                    scan.file.string(), is_called_nuscenes ? " by its name" : ": every fifth is a ring"));
    return nuscenes;
  }
  if (bytes.size() % kitti.bytes() != 0) {
    throw InputError(scan.file,
                     fmt::format("{} bytes are no multiple of 16 (float32 x y z intensity); the file is cut "
                                 "off after {} points or has other records: {}",
                                 bytes.size(), bytes.size() / kitti.bytes(), remedy));
  }
  const double negative = column_of(bytes, kitti, 3).negative_share;
  if (negative > intensities_may_be_negative) {
    throw InputError(
        scan.file, fmt::format("{:.0f} % of every fourth number are negative, these are no intensities: its "
                               "records are not KITTI's; {}",
                               100 * negative, remedy));
  }
  return kitti;
}

void parse_kitti(const ScanBytes& scan, ScanPoints& out) {
  out.clear();
  std::vector<Point>& points = out.points;
  const BinaryRecord record = scan.reading.record ? *scan.reading.record : recognise_record(scan);
  if (scan.bytes.size() % record.bytes() != 0) {
    throw InputError(
        scan.file, fmt::format("{} bytes are no multiple of {} ({} float{} a point); the file is cut off "
                               "after {} points or has other records: {}",
                               scan.bytes.size(), record.bytes(), record.numbers, record.is_double ? 64 : 32,
                               scan.bytes.size() / record.bytes(), remedy));
  }
  points.resize(scan.bytes.size() / record.bytes());
  const NumberType type = record.is_double ? NumberType::f64 : NumberType::f32;
  const char* at = scan.bytes.data();
  for (Point& point : points) {
    const auto number = [&](std::size_t place) {
      return load_number(at + place * size_of(type), type, std::endian::little);
    };
    point = scan.reading.point(number(0), number(1), number(2));
    at += record.bytes();
  }
}

}  // namespace alces::offline
