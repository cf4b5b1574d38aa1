// A mapper in a block of its own and drives for it: once around a block of houses with scans made beforehand,
// or scan by scan through any Scene, also with the scanner covered, when nothing but odometry tells the way.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <vector>

#include "alces/mapper.h"
#include "support/in_block.h"
#include "support/plain_scene.h"

namespace alces::test {

constexpr MapperConfig small_config() {
  MapperConfig config = MapperConfig::standard();
  config.scan_capacity = 64;
  config.loop_capacity = 16;
  config.pool_bytes = std::size_t{4} << 20;
  config.voxel.cell_capacity = 4096;
  config.voxel.maximum_range_m = 30;
  config.surface.sample_capacity = 1024;
  config.detector.minimum_gap_scans = 20;
  config.detector.radius_m = 6;
  config.detector.radius_cap_m = 6;
  return config;
}

/// A square of streets around a block of houses, driven once around and a little farther; side 24 m.
struct BlockDrive {
  std::vector<Pose> truth;
  std::vector<Pose> odometry;
  std::vector<std::vector<Point>> scans;
};

inline Scene block_of_houses() {
  Scene scene;
  scene.rectangle({-30, -30, 0}, {60, 0, 0}, {0, 60, 0});
  sim::Random random(5);
  for (int side = 0; side < 4; ++side) {
    for (double along = -22; along < 18;) {
      const double width = random.uniform(3, 6);
      for (const double distance : {8.0 - random.uniform(0, 1.5), -16.5 - random.uniform(0, 1.5)}) {
        const double near = std::abs(distance);
        const double far = distance > 0 ? near - 2 : near + 2;
        Eigen::Vector3d a(along, std::min(near, far), 0);
        Eigen::Vector3d b(along + width, std::max(near, far), random.uniform(3, 6));
        if (distance > 0 && (along < -6 || along + width > 6)) continue;
        for (int turn = 0; turn < side; ++turn) {
          const Eigen::Vector3d low = a;
          const Eigen::Vector3d high = b;
          a = {-high.y(), low.x(), low.z()};
          b = {-low.y(), high.x(), high.z()};
        }
        scene.box(a, b);
      }
      along += width + random.uniform(0.3, 1.5);
    }
  }
  return scene;
}

inline const BlockDrive& round_the_block() {
  static const BlockDrive made = [] {
    BlockDrive drive;
    const Scene scene = block_of_houses();
    std::vector<Pose> way;
    constexpr int steps_a_side = 12;
    for (int step = 0; step < 4 * steps_a_side + 5; ++step) {
      const int side = step / steps_a_side;
      const double along = -12 + 2.0 * (step % steps_a_side);
      const double turning = step % steps_a_side >= steps_a_side - 1 ? 45
                             : step % steps_a_side == 0 && step > 0  ? -45
                                                                     : 0;
      const Pose rotated = pose_at(0, 0, 0, 90.0 * side);
      way.push_back(rotated * pose_at(along, -12, 1, std::max(0.0, turning), 0.3 * std::sin(step),
                                      0.3 * std::cos(step)));
    }
    Pose odometry;
    for (std::size_t i = 0; i < way.size(); ++i) {
      drive.truth.push_back(way[0].inverse() * way[i]);
      if (i > 0) {
        Pose step = way[i - 1].inverse() * way[i];
        step.translation_m *= 1.02;
        step.rotation = exp_so3({0, 0, 0.01}) * step.rotation;
        odometry = odometry * step;
      }
      drive.odometry.push_back(odometry);
      drive.scans.push_back(scene.scan(way[i], 3000, 20, 0.01, i));
    }
    return drive;
  }();
  return made;
}

/// A mapper in a block of its own, of exactly the bytes it asks for.
class MapperBench {
 public:
  explicit MapperBench(const MapperConfig& config, ScanArchive* archive = nullptr,
                       LoopRelaxation* relaxation = nullptr)
      : block_(Mapper::memory_required(config)) {
    Status status = Status::bad_config;
    mapper = Mapper::create(block_.bytes(), config, status, archive, nullptr, relaxation);
    REQUIRE(status == Status::ok);
    REQUIRE(mapper != nullptr);
  }
  Mapper* operator->() const { return mapper; }
  Mapper* mapper = nullptr;

 private:
  Block block_;
};

inline void drive_through(Mapper& mapper, const BlockDrive& drive, std::size_t count,
                          bool with_odometry = true) {
  for (std::size_t i = 0; i < count; ++i) {
    ScanReport report;
    REQUIRE(mapper.add_scan(drive.scans[i], with_odometry ? &drive.odometry[i] : nullptr, report) ==
            Status::ok);
    REQUIRE(report.scan == i);
  }
}

/// Appends what a vehicle at `at` sees of the scene, while its odometry believes it `believed`.
inline ScanReport see(Mapper& mapper, const Scene& scene, const Pose& at, const Pose& believed,
                      const Eigen::Vector3d* gps_position_m = nullptr) {
  ScanReport report;
  const std::vector<Point> points = scene.scan(at, 4000, 15, 0.01, mapper.scan_count());
  REQUIRE(mapper.add_scan(points, &believed, report, gps_position_m) == Status::ok);
  return report;
}

/// Appends a scan made with the scanner covered, of one point: its pose is the prediction.
inline ScanReport see_nothing(Mapper& mapper, const Pose& believed,
                              const Eigen::Vector3d* gps_position_m = nullptr) {
  ScanReport report;
  const Point speck{3, 2, 1};
  REQUIRE(mapper.add_scan({&speck, 1}, &believed, report, gps_position_m) == Status::ok);
  REQUIRE(report.is_predicted == (report.scan > 0));
  return report;
}

inline bool is_same_pose(const Pose& a, const Pose& b) {
  return a.translation_m == b.translation_m && a.rotation.coeffs() == b.rotation.coeffs();
}

inline bool is_same(const Mapper& a, const Mapper& b) {
  return std::ranges::equal(a.graph().poses(), b.graph().poses(), is_same_pose);
}

inline double mean_error_m(const Mapper& mapper, const BlockDrive& drive) {
  double sum = 0;
  for (std::uint32_t i = 0; i < mapper.scan_count(); ++i) {
    sum += distance_m(mapper.graph().poses()[i], drive.truth[i]);
  }
  return sum / mapper.scan_count();
}

}  // namespace alces::test
