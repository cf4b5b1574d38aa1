#include "reference_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "alces/arena.h"
#include "alces/voxel_grid.h"
#include "offline/io/files/error.h"
#include "offline/io/scans/scan_source.h"

namespace alces::offline {
namespace {

[[noreturn]] void refuse_size(std::size_t points) {
  throw CapacityError(
      fmt::format("the reference map has {} points, {} are the most; thin it out with a larger "
                  "--cell",
                  points, KdTree::maximum_points));
}

std::vector<Point> thinned(std::span<const Point> points, double cell_size_m) {
  std::vector<Point> kept;
  if (cell_size_m <= 0) {
    std::copy_if(points.begin(), points.end(), std::back_inserter(kept),
                 [](const Point& p) { return is_finite(p); });
    return kept;
  }
  VoxelGridConfig config;
  config.cell_size_m = static_cast<float>(cell_size_m);
  config.cell_capacity = static_cast<std::uint32_t>(
      std::min<std::size_t>(std::max<std::size_t>(points.size(), 1), KdTree::maximum_points));
  config.minimum_range_m = 0;
  config.maximum_range_m = 1e6F;
  Arena counting;
  { const VoxelGrid planned(counting, config); }
  const settings::MemoryBlock block(counting.used_bytes());
  Arena arena(block.bytes());
  VoxelGrid grid(arena, config);
  kept.resize(config.cell_capacity);
  VoxelGridCounts counts;
  const Status status = grid.reduce(points, kept, counts);
  if (status == Status::no_voxel_capacity) refuse_size(points.size());
  kept.resize(counts.kept);
  return kept;
}

}  // namespace

ReferenceMap::ReferenceMap(std::span<const Point> points, double cell_size_m) : given_(points.size()) {
  const std::vector<Point> kept = thinned(points, cell_size_m);
  if (kept.empty()) throw InputError("the reference map has no point that could be matched to");
  if (kept.size() > KdTree::maximum_points) refuse_size(kept.size());
  const auto count = static_cast<std::uint32_t>(kept.size());
  Arena counting;
  { const KdTree planned(counting, count); }
  block_ = std::make_unique<settings::MemoryBlock>(counting.used_bytes());
  Arena arena(block_->bytes());
  tree_ = KdTree(arena, count);
  Arena counting_scratch;
  { const KdTreeScratch planned(counting_scratch, count); }
  const settings::MemoryBlock scratch_block(counting_scratch.used_bytes());
  Arena scratch_arena(scratch_block.bytes());
  KdTreeScratch scratch(scratch_arena, count);
  if (!tree_.build(kept, scratch)) refuse_size(kept.size());
}

ReferenceCloud read_cloud(const std::filesystem::path& file, std::vector<std::string>& warnings) {
  const std::unique_ptr<ScanSource> source = open_scans(file);
  ReferenceCloud cloud;
  ScanPoints scan;
  for (std::size_t i = 0; source->read(i, scan); ++i) {
    cloud.points.insert(cloud.points.end(), scan.points.begin(), scan.points.end());
    if (i + 1 == source->size()) break;
  }
  for (const std::string& warning : source->warnings()) warnings.push_back(warning);
  const std::array<double, 3> origin_m = source->origin_m();
  cloud.origin_m = {origin_m[0], origin_m[1], origin_m[2]};
  return cloud;
}

}  // namespace alces::offline
