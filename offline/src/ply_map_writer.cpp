#include <fmt/format.h>

#include <bit>
#include <cassert>
#include <cstring>
#include <string>
#include <utility>

#include "alces_offline/error.h"
#include "alces_offline/map_writer.h"
#include "alces_offline/output_file.h"

namespace alces::offline {
namespace {

static_assert(std::endian::native == std::endian::little, "map.ply is written as the numbers lie in memory");

// The count is known last: room for any 64-bit number, filled up with blanks in front, which every reader
// skips.
std::string count_text(std::uint64_t count) {
  return fmt::format("{:>20}", count);
}

}  // namespace

struct PlyMapWriter::Impl {
  Impl(const std::filesystem::path& file, Attribute attribute_of_points)
      : output(file), attribute(attribute_of_points) {
    std::string header =
        "ply\nformat binary_little_endian 1.0\n"
        "comment written by alces\n"
        "comment right-handed, x forward, y left, z up, metres, origin scan 0\n"
        "element vertex ";
    count_position = header.size();
    header += count_text(0) + "\nproperty float x\nproperty float y\nproperty float z\n";
    header += attribute == Attribute::scan
                  ? "property uint scan\n"
                  : "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    output.write(header + "end_header\n");
  }

  void add(const Point& point, const Pose& map_from_body, const char* tail, std::size_t tail_bytes) {
    if (!is_finite(point)) {
      ++not_finite;
      return;
    }
    const Eigen::Vector3f p =
        (map_from_body * Eigen::Vector3f(point.x, point.y, point.z).cast<double>()).cast<float>();
    std::array<char, 16> record{};
    std::memcpy(record.data(), p.data(), 12);
    std::memcpy(record.data() + 12, tail, tail_bytes);
    output.write({record.data(), 12 + tail_bytes});
    ++written;
  }

  OutputFile output;
  Attribute attribute;
  std::uint64_t count_position = 0;
  std::uint64_t written = 0;
  std::uint64_t not_finite = 0;
};

PlyMapWriter::PlyMapWriter(const std::filesystem::path& file, Attribute attribute)
    : impl_(std::make_unique<Impl>(file, attribute)) {}
PlyMapWriter::PlyMapWriter(PlyMapWriter&&) noexcept = default;
PlyMapWriter& PlyMapWriter::operator=(PlyMapWriter&&) noexcept = default;
PlyMapWriter::~PlyMapWriter() = default;

void PlyMapWriter::add(std::span<const Point> points, const Pose& map_from_body, std::uint32_t scan) {
  assert(impl_->attribute == Attribute::scan);
  std::array<char, 4> tail{};
  std::memcpy(tail.data(), &scan, 4);
  for (const Point& point : points) impl_->add(point, map_from_body, tail.data(), tail.size());
}

void PlyMapWriter::add(std::span<const Point> points, const Pose& map_from_body,
                       std::span<const Rgb> colors) {
  assert(impl_->attribute == Attribute::color && colors.size() == points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::array<char, 3> tail{};
    std::memcpy(tail.data(), colors[i].data(), 3);
    impl_->add(points[i], map_from_body, tail.data(), tail.size());
  }
}

void PlyMapWriter::add(std::span<const Point> points, const Pose& map_from_body, const Rgb& color) {
  assert(impl_->attribute == Attribute::color);
  std::array<char, 3> tail{};
  std::memcpy(tail.data(), color.data(), 3);
  for (const Point& point : points) impl_->add(point, map_from_body, tail.data(), tail.size());
}

std::uint64_t PlyMapWriter::written() const {
  return impl_->written;
}
std::uint64_t PlyMapWriter::not_finite() const {
  return impl_->not_finite;
}

void PlyMapWriter::finish() {
  impl_->output.patch(impl_->count_position, count_text(impl_->written));
  impl_->output.commit();
}

}  // namespace alces::offline
