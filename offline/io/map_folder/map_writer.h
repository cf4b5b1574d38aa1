// The files of a map folder that other programs read: trajectory.tum and frames/ (see trajectory.h),
// graph.g2o and map.ply. Every file appears under its name only when it is whole; what cannot be written is
// an OutputError.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "alces/point.h"
#include "alces/pose.h"
#include "alces/pose_graph.h"
#include "trajectory.h"

namespace alces::offline {

/// VERTEX_SE3:QUAT for every vertex, FIX 0, EDGE_SE3:QUAT for every edge.
///
/// The information belongs to g2o's error vector, (translation, vector part of the quaternion) of
/// measurement^-1 * from^-1 * to, which is seen from the body frame of `to`:
///   - translation: diag(1/x, 1/y, 1/z) of EdgeVariance, which is given along that frame's axes;
///   - rotation: rotation_rad2 by its shares, an axis each; the vector part is half the angle, so the
///     information is four times that of the angle: 4 / (share * rotation_rad2).
void write_g2o(const std::filesystem::path& file, const PoseGraph& graph);
[[nodiscard]] Matrix6d g2o_information(const EdgeVariance& variance);

using Rgb = std::array<std::uint8_t, 3>;

/// A point cloud as binary little-endian PLY, written as the points come: any number of them in 1 MiB of
/// buffer. Each vertex is float x y z, then uint scan, uint scan and uchar intensity, or uchar red green
/// blue. The count is patched in by finish(); without finish() nothing is left behind.
class PlyMapWriter {
 public:
  enum class Attribute { scan, scan_and_intensity, color };

  explicit PlyMapWriter(const std::filesystem::path& file, Attribute attribute = Attribute::scan);
  PlyMapWriter(PlyMapWriter&&) noexcept;
  PlyMapWriter& operator=(PlyMapWriter&&) noexcept;
  ~PlyMapWriter();

  /// Points of the body frame of scan number `scan`. Points that are not finite are counted, not written.
  /// `intensity`: as many as points, or none, which is written as 0.
  void add(std::span<const Point> points, const Pose& map_from_body, std::uint32_t scan,
           std::span<const std::uint8_t> intensity = {});
  /// As many colours as points.
  void add(std::span<const Point> points, const Pose& map_from_body, std::span<const Rgb> colors);
  void add(std::span<const Point> points, const Pose& map_from_body, const Rgb& color);

  [[nodiscard]] std::uint64_t written() const;
  [[nodiscard]] std::uint64_t not_finite() const;

  /// Makes the file whole and gives it its name.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alces::offline
