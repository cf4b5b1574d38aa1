// A drive through a room, measured by a scanner that sees random points of its walls: small scans with a
// known way.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "alces/point.h"
#include "alces/pose.h"
#include "offline/io/scans/scan_source.h"
#include "offline/map/map_run.h"
#include "offline/map/mapper_settings.h"

namespace alces::offline {

/// 0.2 m a scan along x, turning slowly.
inline Pose room_from_body(std::size_t scan) {
  const double turned_rad = 0.01 * static_cast<double>(scan);
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turned_rad, Eigen::Vector3d::UnitZ())),
          {0.2 * static_cast<double>(scan) - 5, 0.05 * static_cast<double>(scan), 0}};
}

/// Points on the walls, floor and ceiling of a room of 24 x 12 x 4 m and on a pillar in it, in the body
/// frame.
inline std::vector<Point> scan_room(std::size_t scan, std::size_t count = 3000) {
  std::mt19937 random(static_cast<std::uint32_t>(scan) + 1);
  std::uniform_real_distribution<double> along(-1, 1);
  const Pose body_from_room = room_from_body(scan).inverse();
  std::vector<Point> points;
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Vector3d half(12, 6, 2);
    Eigen::Vector3d center(0, 0, 1);
    if (i % 8 == 0) {  // the pillar
      half = {0.5, 0.5, 2};
      center = {3, -3, 1};
    }
    Eigen::Vector3d place(half.x() * along(random), half.y() * along(random), half.z() * along(random));
    const auto axis = static_cast<Eigen::Index>(i % 3);
    place[axis] = half[axis] * (random() % 2 == 0 ? 1 : -1);
    const Eigen::Vector3f p = (body_from_room * (center + place)).cast<float>();
    points.push_back({p.x(), p.y(), p.z()});
  }
  return points;
}

/// Enough for such scans.
inline MapRequest small_request() {
  MapRequest request;
  request.config = default_settings(FrontEnd::standard);
  request.config.voxel.cell_capacity = 4096;
  request.config.loop_capacity = 16;
  request.memory_bytes = std::size_t{16} << 20;
  return request;
}

/// Scans out of thin air; what is asked of it is what a test sets.
class RoomSource : public ScanSource {
 public:
  explicit RoomSource(std::size_t size) : size_(size) {}
  [[nodiscard]] std::size_t size() const override { return size_; }
  bool read(std::size_t index, ScanPoints& scan) override {
    scan.clear();
    scan.points = scan_room(index);
    return true;
  }
  [[nodiscard]] std::string name(std::size_t index) const override {
    return "scan" + std::to_string(index) + ".synthetic";
  }
  [[nodiscard]] std::size_t number(std::size_t index) const override { return index; }
  [[nodiscard]] std::optional<Pose> odometry(std::size_t index) const override {
    return room_from_body(index);
  }
  [[nodiscard]] std::optional<double> stamp_s(std::size_t) const override { return std::nullopt; }
  [[nodiscard]] std::string description() const override { return "a room"; }
  [[nodiscard]] std::vector<std::string> warnings() const override { return {}; }

 private:
  std::size_t size_;
};

/// The room's scan as the bytes of a binary PCD.
inline std::string room_pcd(std::size_t scan, std::size_t count = 3000) {
  const std::vector<Point> points = scan_room(scan, count);
  std::string pcd = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " +
                    std::to_string(count) + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
                    std::to_string(count) + "\nDATA binary\n";
  for (const Point& point : points) {
    const float xyz[3] = {point.x, point.y, point.z};
    pcd.append(reinterpret_cast<const char*>(xyz), sizeof(xyz));
  }
  return pcd;
}

/// The same as 3DTK's .3d: left-handed, centimetres.
inline std::string room_3d(std::size_t scan, std::size_t count = 3000) {
  std::string text;
  for (const Point& p : scan_room(scan, count))
    text +=
        std::to_string(-100 * p.y) + " " + std::to_string(100 * p.z) + " " + std::to_string(100 * p.x) + "\n";
  return text;
}

}  // namespace alces::offline
