// Maps a drive around a house in half a megabyte: the library as a microcontroller uses it. No operating
// system, no heap. Prints the poses, and how far they are from the truth with the loop closed and without.
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>

#include "alces/mapper.h"
#include "board.h"
#include "yard.h"

namespace {

// Coarse cells, few samples, a short reach: what half a megabyte has room for. The last scan alone is the
// model.
constexpr alces::MapperConfig config() {
  alces::MapperConfig small = alces::MapperConfig::standard();
  small.scan_capacity = 64;
  small.loop_capacity = 8;
  small.model_scans = 1;
  small.model_points = 0;
  small.voxel.cell_size_m = 0.8F;
  small.voxel.maximum_range_m = 12;
  small.voxel.cell_capacity = 512;
  small.surface.sample_capacity = 96;
  small.surface.neighbors = 8;
  small.loop_verification.ambiguity_sigmas = 0;  // so few samples cannot tell one place from the next

  small.correspondence_capacity = 800;
  small.cache_slots = 10;
  small.pool_bytes = 0;
  return small;
}

// Every byte that the fixed parts leave is pool for scans.
constexpr std::size_t arena_bytes = 512 * 1024;
constexpr alces::MapperConfig config_that_fills_the_arena() {
  alces::MapperConfig full = config();
  full.pool_bytes = arena_bytes - alces::Mapper::memory_required(full);
  return full;
}
constexpr alces::MapperConfig mapper_config = config_that_fills_the_arena();
static_assert(alces::Mapper::memory_required(mapper_config) <= arena_bytes);

alignas(alces::Arena::alignment) IN_ARENA_MEMORY std::array<std::byte, arena_bytes> arena;
std::array<alces::Point, yard::points_per_scan> points;

// Millimetres and thousandths of a degree: whole numbers need no heap to be printed.
int in_thousandths(double value) {
  return static_cast<int>(std::lround(value * 1000));
}

// FNV-1a over the bits of all poses: one number that differs when one bit does.
std::uint32_t digest(std::span<const alces::Pose> poses) {
  std::uint32_t hash = 2166136261U;
  const auto take = [&hash](double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (int shift = 0; shift < 64; shift += 8)
      hash = (hash ^ static_cast<std::uint8_t>(bits >> shift)) * 16777619U;
  };
  for (const alces::Pose& pose : poses) {
    for (const double value : pose.rotation.coeffs()) take(value);
    for (const double value : pose.translation_m) take(value);
  }
  return hash;
}

double largest_error_m(std::span<const alces::Pose> poses) {
  double largest_m = 0;
  for (std::uint32_t i = 0; i < poses.size(); ++i)
    largest_m = std::fmax(largest_m, (poses[i].translation_m - yard::truth(i).translation_m).norm());
  return largest_m;
}

// The drive; false when the mapper refuses a scan.
bool drive(alces::Mapper& mapper) {
  alces::Pose odometry;
  for (std::uint32_t number = 0; number < yard::scan_count; ++number) {
    if (number > 0) odometry = odometry * yard::wheel_step(number);
    yard::scan(number, points);
    alces::ScanReport report;
    board::begin_counting();
    const alces::Status status = mapper.add_scan(points, &odometry, report);
    board::end_counting();
    if (status != alces::Status::ok) {
      std::printf("scan %d: %s\n", static_cast<int>(number), alces::to_string(status));
      return false;
    }
    if (report.loop_offered)
      std::printf("loop %d-%d: %s, moved %d mm\n", static_cast<int>(report.loop.first),
                  static_cast<int>(report.loop.last), alces::to_string(report.loop.verdict),
                  in_thousandths(report.loop.correction_m));
  }
  alces::LoopReport loop;
  if (mapper.finish(loop))
    std::printf("loop %d-%d: %s, moved %d mm\n", static_cast<int>(loop.first), static_cast<int>(loop.last),
                alces::to_string(loop.verdict), in_thousandths(loop.correction_m));
  return true;
}

// One drive in the arena. Whatever was in it is forgotten.
alces::Mapper* map(bool close_loops) {
  alces::MapperConfig chosen = mapper_config;
  chosen.close_loops = close_loops;
  alces::Status status = alces::Status::ok;
  alces::Mapper* const mapper = alces::Mapper::create(arena, chosen, status);
  if (mapper == nullptr) std::printf("%s\n", alces::to_string(status));
  return mapper != nullptr && drive(*mapper) ? mapper : nullptr;
}

}  // namespace

int main() {
  const alces::Mapper* const without = map(false);
  if (without == nullptr) return 1;
  const double without_m = largest_error_m(without->graph().poses());

  const alces::Mapper* const mapper = map(true);
  if (mapper == nullptr) return 1;
  const std::span<const alces::Pose> poses = mapper->graph().poses();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector3d& at_m = poses[i].translation_m;
    const double heading_rad = 2 * std::atan2(poses[i].rotation.z(), poses[i].rotation.w());
    std::printf("pose %2d: %6d %6d %6d mm %7d mdeg\n", static_cast<int>(i), in_thousandths(at_m.x()),
                in_thousandths(at_m.y()), in_thousandths(at_m.z()),
                in_thousandths(heading_rad * 57.29577951308232));
  }
  const double with_m = largest_error_m(poses);
  std::printf("%d scans in %d bytes, %d of them the pool of points\n", static_cast<int>(poses.size()),
              static_cast<int>(arena_bytes), static_cast<int>(mapper_config.pool_bytes));
  std::printf("largest error: %d mm, without closing the loop %d mm\n", in_thousandths(with_m),
              in_thousandths(without_m));
  std::printf("digest of the poses: %08x\n", static_cast<unsigned>(digest(poses)));
  if (const std::size_t bytes = board::stack_used_bytes(); bytes > 0)
    std::printf("stack used: %d bytes\n", static_cast<int>(bytes));
  return mapper->counters().loops_closed > 0 && with_m < without_m ? 0 : 1;
}
