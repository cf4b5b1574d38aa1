#include "scan_survey.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "alces/arena.h"
#include "alces/kd_tree.h"
#include "offline/io/files/error.h"
#include "offline/map/memory_plan.h"

namespace alces::offline {
namespace {

/// Counts cells in a grid that has room for the largest scan so far.
class CellCounter {
 public:
  explicit CellCounter(const VoxelGridConfig& voxel) : voxel_(voxel) { voxel_.cell_capacity = 0; }

  [[nodiscard]] std::uint32_t cells(const std::vector<Point>& points) {
    const auto room =
        static_cast<std::uint32_t>(std::min<std::size_t>(points.size(), KdTree::maximum_points));
    if (room > voxel_.cell_capacity) {
      voxel_.cell_capacity = room;
      Arena counting;
      { const VoxelGrid planned(counting, voxel_); }
      block_ = std::make_unique<MemoryBlock>(counting.used_bytes());
      Arena arena(block_->bytes());
      grid_ = std::make_unique<VoxelGrid>(arena, voxel_);
      reduced_.resize(room);
    }
    if (room == 0) return 0;
    VoxelGridCounts counts;
    (void)grid_->reduce(points, reduced_, counts);  // its status says no more than the counts
    return counts.kept;
  }

 private:
  VoxelGridConfig voxel_;
  std::unique_ptr<MemoryBlock> block_;
  std::unique_ptr<VoxelGrid> grid_;
  std::vector<Point> reduced_;
};

/// Empty where it cannot be read.
void read_if_possible(ScanSource& scans, std::size_t index, ScanPoints& scan) {
  scan.clear();
  try {
    if (!scans.read(index, scan)) scan.clear();
  } catch (const Error&) {
    scan.clear();
  }
}

}  // namespace

std::uint32_t most_cells(ScanSource& scans, const VoxelGridConfig& voxel, std::uint32_t enough,
                         const std::function<bool()>& is_stopped) {
  std::size_t largest = 0;
  for (std::size_t i = 1; i < scans.size(); ++i) {
    if (scans.file_bytes(i) > scans.file_bytes(largest)) largest = i;
  }
  if (scans.size() == 0 || scans.file_bytes(largest) == 0) return enough;
  ScanPoints scan;
  const std::vector<Point>& points = scan.points;
  read_if_possible(scans, largest, scan);
  // Numbers in text are not all as long.
  const double points_a_byte =
      1.25 * static_cast<double>(points.size()) / static_cast<double>(scans.file_bytes(largest));
  const bool is_known = !points.empty();
  CellCounter counter(voxel);
  std::uint32_t most = std::max(enough, points.size() > enough ? counter.cells(points) : 0U);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (i == largest) continue;
    if (is_stopped && is_stopped()) break;
    if (is_known && points_a_byte * static_cast<double>(scans.file_bytes(i)) <= most) continue;
    read_if_possible(scans, i, scan);
    if (points.size() > most) most = std::max(most, counter.cells(points));
  }
  return most;
}

}  // namespace alces::offline
