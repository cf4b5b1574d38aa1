// Point clouds for other programs, written as the points come: any number of them in 1 MiB of buffer. A file
// appears under its name only when it is whole (OutputFile); what cannot be written is an OutputError.
//
// | form | what a point has | opens in |
// |---|---|---|
// | ply | float x y z, uint scan, uchar intensity | CloudCompare, MeshLab, Open3D |
// | pcd | float x y z, uint scan, float intensity 0 to 255; binary | PCL, CloudCompare |
// | las | x y z in steps of 0.1 mm, intensity as 16 bits, GPS time = the scan's stamp, point source ID = scan
// mod 65536; LAS 1.4, |     | point format 6 (ASPRS 2013) | PDAL, QGIS, CloudCompare, potree | | csv |
// x,y,z,scan,intensity with a header | spreadsheets | | kitti | float x y z, intensity 0 to 1 | KITTI's
// tools, LIO/LOAM code |
//
// Intensity is there where the scans have it (LAS and KITTI: else 0).
//
// Coordinates are REP 103's metres, as handed over, with the origin added: then ply and pcd have double x y
// z, csv four decimals, LAS the origin as its offset; KITTI's floats cannot have it. Points that are not
// finite are counted, not written.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "alces/point.h"

namespace alces::offline {

enum class CloudForm : std::uint8_t { ply, pcd, las, csv, kitti };

/// By the name: .ply .pcd .las .csv .xyz .bin.
[[nodiscard]] std::optional<CloudForm> cloud_form_of(const std::filesystem::path& file);

class CloudWriter {
 public:
  CloudWriter() = default;
  CloudWriter(const CloudWriter&) = delete;
  CloudWriter& operator=(const CloudWriter&) = delete;
  virtual ~CloudWriter() = default;

  /// Points of scan number `scan`, measured at stamp_s; `intensity`: as many as points, or none. OutputError;
  /// also when LAS cannot hold a coordinate (beyond 214 km).
  void add(std::span<const Point> points, std::uint32_t scan, double stamp_s,
           std::span<const std::uint8_t> intensity = {});
  /// Makes the file whole and gives it its name.
  virtual void finish() = 0;

  [[nodiscard]] std::uint64_t written() const { return written_; }
  [[nodiscard]] std::uint64_t not_finite() const { return not_finite_; }

 protected:
  virtual void write(const Point& point, std::uint32_t scan, double stamp_s, std::uint8_t intensity) = 0;
  /// After the points of one add().
  virtual void flush() = 0;

 private:
  std::uint64_t written_ = 0;
  std::uint64_t not_finite_ = 0;
};

/// `origin_m` was taken off the coordinates and comes back; zero: none was. `has_intensity`: some scan will
/// bring it.
[[nodiscard]] std::unique_ptr<CloudWriter> open_cloud_writer(const std::filesystem::path& file,
                                                             CloudForm form,
                                                             const std::array<double, 3>& origin_m = {},
                                                             bool has_intensity = false);

}  // namespace alces::offline
