// Maps two scans in a block of memory whose size the compiler works out.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>

#include "alces/mapper.h"

namespace {

constexpr alces::MapperConfig config() {
  alces::MapperConfig small;
  small.scan_capacity = 2;
  small.loop_capacity = 1;
  small.pool_bytes = 64 * 1024;
  small.voxel.cell_capacity = 4096;
  return small;
}

alignas(alces::Arena::alignment) std::array<std::byte, alces::Mapper::memory_required(config())> block;

// A room of 8 m x 6 m with a pillar, seen from `x_m` along its length.
std::array<alces::Point, 3600> scan_from(float x_m) {
  std::array<alces::Point, 3600> points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float angle_rad = 0.0174533F * static_cast<float>(i % 360);
    const float height_m = 0.3F * static_cast<float>(i / 360) - 1;
    const float reach = 1 / std::fmax(std::fabs(std::cos(angle_rad)) / 4, std::fabs(std::sin(angle_rad)) / 3);
    const bool is_pillar = i % 360 < 20;
    const float range_m = is_pillar ? 2 : reach;
    points[i] = {range_m * std::cos(angle_rad) - x_m, range_m * std::sin(angle_rad), height_m};
  }
  return points;
}

}  // namespace

int main() {
  alces::Status status;
  alces::Mapper* const mapper = alces::Mapper::create(block, config(), status);
  alces::ScanReport report;
  for (const float x_m : {0.0F, 0.25F}) {  // the second scan is taken 25 cm further on; no odometry says so
    if (status == alces::Status::ok) status = mapper->add_scan(scan_from(x_m), nullptr, report);
  }
  if (status != alces::Status::ok) return std::printf("%s\n", alces::to_string(status)), 1;
  const Eigen::Vector3d place_m = mapper->graph().poses()[1].translation_m;
  std::printf("%s after %u iterations: the second scan lies at x = %.2f m; %zu bytes\n",
              alces::to_string(report.match), report.iterations, place_m.x(), block.size());
  return std::fabs(place_m.x() - 0.25) < 0.02 ? 0 : 1;
}
