// A point cloud as levels of detail: an octree whose every node holds points of its own.
//
// A node of level l is a cube of side_m / 2^l, and its points are at least about 1/128 of that apart: of
// every cell of the node's 128 x 128 x 128 grid the first point that no level above has taken. Drawing a node
// adds to what its ancestors show and repeats nothing, so that any set of nodes that holds all ancestors of
// its members is a picture of even density. (The idea is that of QSplat and Potree; here it falls out of one
// sort: the level of a point is where its Morton key first differs from that of the point before it.)
//
// Deterministic. O(n log n) on all cores, 1 s for 10 million points; some 50 bytes a point while it works.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "alces/point.h"

namespace alces::offline {

struct CloudPoint {
  Point position;          ///< map frame, metres
  std::uint32_t scan = 0;  ///< row of the trajectory
  std::uint8_t intensity = 0;
};

struct CloudNode {
  std::uint32_t level = 0;
  std::array<std::uint32_t, 3> cell{};  ///< which cube of the level, along x, y, z
  std::size_t first = 0;                ///< in CloudOctree::points
  std::size_t count = 0;
};

struct CloudOctree {
  static constexpr std::uint32_t cells_a_side = 128;  ///< of a node's grid

  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< lowest corner of the root
  double side_m = 1;                                   ///< of the root
  std::vector<CloudNode> nodes;    ///< level by level, within a level along the Morton curve
  std::vector<CloudPoint> points;  ///< node by node, within a node along the Morton curve

  [[nodiscard]] double side_m_of(std::uint32_t level) const;
  [[nodiscard]] Eigen::Vector3d origin_m_of(const CloudNode& node) const;
};

/// All points are finite. The tree ends at cells of `finest_cell_m`: what is left goes into its last level.
/// Nodes of fewer than `fewest_points` are joined to their parent.
[[nodiscard]] CloudOctree build_cloud_octree(std::vector<CloudPoint> points, double finest_cell_m = 0.01,
                                             std::size_t fewest_points = 400);

}  // namespace alces::offline
