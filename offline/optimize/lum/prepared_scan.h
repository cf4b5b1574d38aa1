// A scan as the relaxation uses it: downsampled, in a k-d tree, with samples of its surface.
//
// Some 15 bytes a point and 20 a sample: 0.2 MB for a scan of 14,000 points. Preparing takes 5 ms, bringing
// back from bytes a tenth of that.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "alces/kd_tree.h"
#include "alces/surface.h"
#include "alces_platform/settings/memory_plan.h"
#include "settings.h"

namespace alces::offline {

class PreparedScan {
 public:
  /// A scan without a usable point has size() 0 and takes part in no link.
  PreparedScan() = default;

  [[nodiscard]] std::uint32_t size() const { return tree_.size(); }
  [[nodiscard]] const KdTree& tree() const { return tree_; }
  [[nodiscard]] std::span<const SurfaceSample> samples() const { return samples_; }
  [[nodiscard]] std::size_t bytes() const;

  /// Points in the tree's order and samples, as bytes of this machine; for a scratch file.
  [[nodiscard]] std::string to_bytes() const;
  /// The very same scan. False: these bytes are not of to_bytes().
  [[nodiscard]] bool from_bytes(std::string_view bytes);

 private:
  friend class ScanPreparation;
  void reserve(std::uint32_t points);

  std::unique_ptr<settings::MemoryBlock> block_;
  KdTree tree_;
  std::vector<SurfaceSample> samples_;
};

/// Prepares scans one after the other; what it needs for that it keeps. One a thread.
class ScanPreparation {
 public:
  explicit ScanPreparation(const LumSettings& settings);

  /// More cells than voxel.cell_capacity: it is downsampled coarser, as in `map`.
  [[nodiscard]] PreparedScan prepare(std::span<const Point> points);

 private:
  static std::size_t bytes_needed(const VoxelGridConfig& voxel);

  VoxelGridConfig voxel_;
  SurfaceConfig surface_;
  settings::MemoryBlock block_;
  std::unique_ptr<VoxelGrid> grid_;
  std::unique_ptr<KdTreeScratch> scratch_;
  std::vector<Point> reduced_;
};

}  // namespace alces::offline
