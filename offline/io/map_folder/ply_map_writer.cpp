#include <fmt/format.h>

#include <array>
#include <bit>
#include <cassert>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "map_writer.h"
#include "offline/io/files/error.h"
#include "offline/io/files/output_file.h"

namespace alces::offline {
namespace {

static_assert(std::endian::native == std::endian::little, "map.ply is written as the numbers lie in memory");

// The count is known last: room for any 64-bit number, filled up with blanks in front, which every reader
// skips.
std::string vertex_count_text(std::uint64_t count) {
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
    header += vertex_count_text(0) + "\nproperty float x\nproperty float y\nproperty float z\n";
    if (attribute == Attribute::color) {
      header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    } else {
      header += "property uint scan\n";
      if (attribute == Attribute::scan_and_intensity) header += "property uchar intensity\n";
    }
    output.write(header + "end_header\n");
  }

  /// `tail_of(i)` are the bytes behind the coordinates of point i.
  template <std::size_t tail_bytes, typename TailOf>
  void add(std::span<const Point> points, const Pose& map_from_body, TailOf tail_of) {
    constexpr std::size_t record_bytes = 12 + tail_bytes;
    const Eigen::Matrix3d rotation = map_from_body.rotation.toRotationMatrix();
    records.resize(points.size() * record_bytes);
    char* at = records.data();
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!is_finite(points[i])) {
        ++not_finite;
        continue;
      }
      const Eigen::Vector3d in_body = Eigen::Vector3f(points[i].x, points[i].y, points[i].z).cast<double>();
      const Eigen::Vector3f p = (rotation * in_body + map_from_body.translation_m).cast<float>();
      std::memcpy(at, p.data(), 12);
      std::memcpy(at + 12, tail_of(i), tail_bytes);
      at += record_bytes;
      ++written;
    }
    output.write({records.data(), static_cast<std::size_t>(at - records.data())});
  }

  OutputFile output;
  Attribute attribute;
  std::uint64_t count_position = 0;
  std::uint64_t written = 0;
  std::uint64_t not_finite = 0;
  std::vector<char> records;  // of the last call; kept, so that its memory is used again
};

PlyMapWriter::PlyMapWriter(const std::filesystem::path& file, Attribute attribute)
    : impl_(std::make_unique<Impl>(file, attribute)) {}
PlyMapWriter::PlyMapWriter(PlyMapWriter&&) noexcept = default;
PlyMapWriter& PlyMapWriter::operator=(PlyMapWriter&&) noexcept = default;
PlyMapWriter::~PlyMapWriter() = default;

void PlyMapWriter::add(std::span<const Point> points, const Pose& map_from_body, std::uint32_t scan,
                       std::span<const std::uint8_t> intensity) {
  assert(impl_->attribute != Attribute::color && (intensity.empty() || intensity.size() == points.size()));
  if (impl_->attribute == Attribute::scan_and_intensity) {
    std::array<char, sizeof(scan) + 1> tail{};
    std::memcpy(tail.data(), &scan, sizeof(scan));
    return impl_->add<sizeof(scan) + 1>(points, map_from_body, [&](std::size_t i) {
      tail.back() = intensity.empty() ? '\0' : std::bit_cast<char>(intensity[i]);
      return tail.data();
    });
  }
  impl_->add<sizeof(scan)>(points, map_from_body, [&](std::size_t) { return &scan; });
}

void PlyMapWriter::add(std::span<const Point> points, const Pose& map_from_body,
                       std::span<const Rgb> colors) {
  assert(impl_->attribute == Attribute::color && colors.size() == points.size());
  impl_->add<sizeof(Rgb)>(points, map_from_body, [&](std::size_t i) { return colors[i].data(); });
}

void PlyMapWriter::add(std::span<const Point> points, const Pose& map_from_body, const Rgb& color) {
  assert(impl_->attribute == Attribute::color);
  impl_->add<sizeof(Rgb)>(points, map_from_body, [&](std::size_t) { return color.data(); });
}

std::uint64_t PlyMapWriter::written() const {
  return impl_->written;
}
std::uint64_t PlyMapWriter::not_finite() const {
  return impl_->not_finite;
}

void PlyMapWriter::finish() {
  impl_->output.patch(impl_->count_position, vertex_count_text(impl_->written));
  impl_->output.commit();
}

}  // namespace alces::offline
