// A surveyed map to match scans to: a cloud, walls, or both, in one k-d tree.
//
// Memory: 15 bytes a point that is left after downsampling, and while it is built some 100 more.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "alces/kd_tree.h"
#include "alces/point.h"
#include "alces_platform/settings/memory_plan.h"

namespace alces::offline {

class ReferenceMap {
 public:
  /// Downsamples to one measured point a cell (0: all stay) and builds the tree. InputError when no finite
  /// point is left, CapacityError for more than 2^24 of them.
  ReferenceMap(std::span<const Point> points, double cell_size_m);

  [[nodiscard]] const KdTree& tree() const { return tree_; }
  [[nodiscard]] std::size_t given() const { return given_; }  ///< points before downsampling

 private:
  std::unique_ptr<settings::MemoryBlock> block_;
  KdTree tree_;
  std::size_t given_ = 0;
};

/// A cloud, and what was taken off its coordinates (ScanSource::origin_m).
struct ReferenceCloud {
  std::vector<Point> points;
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
};

/// In any of scan_source.h's formats. What the reader warns of (a national grid moved by kilometres) goes to
/// `warnings`. InputError.
[[nodiscard]] ReferenceCloud read_cloud(const std::filesystem::path& file,
                                        std::vector<std::string>& warnings);

}  // namespace alces::offline
