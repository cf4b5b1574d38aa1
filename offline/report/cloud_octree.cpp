#include "cloud_octree.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "alces_platform/parallel.h"

namespace alces::offline {
namespace {

constexpr std::uint32_t key_bits = 21;  // an axis; 63 in all
constexpr std::uint32_t grid_bits = 7;  // of a node's grid
constexpr std::uint32_t deepest_level = key_bits - grid_bits;
static_assert(1U << grid_bits == CloudOctree::cells_a_side);

/// Bit i of the 21 goes to bit 3i.
std::uint64_t spread(std::uint64_t bits) {
  bits = (bits | bits << 32) & 0x001F00000000FFFFULL;
  bits = (bits | bits << 16) & 0x001F0000FF0000FFULL;
  bits = (bits | bits << 8) & 0x100F00F00F00F00FULL;
  bits = (bits | bits << 4) & 0x10C30C30C30C30C3ULL;
  return (bits | bits << 2) & 0x1249249249249249ULL;
}
std::uint32_t gather(std::uint64_t bits) {
  bits &= 0x1249249249249249ULL;
  bits = (bits | bits >> 2) & 0x10C30C30C30C30C3ULL;
  bits = (bits | bits >> 4) & 0x100F00F00F00F00FULL;
  bits = (bits | bits >> 8) & 0x001F0000FF0000FFULL;
  bits = (bits | bits >> 16) & 0x001F00000000FFFFULL;
  return static_cast<std::uint32_t>((bits | bits >> 32) & 0x1FFFFF);
}

struct Keyed {
  std::uint64_t key = 0;
  std::size_t index = 0;
};

/// The key of the node of `level` that a point's key lies in.
std::uint64_t node_key(std::uint64_t key, std::uint32_t level) {
  return key >> (3 * (key_bits - level));
}

/// The coarsest level in whose grid the two lie in different cells.
std::uint32_t level_between(std::uint64_t before, std::uint64_t key, std::uint32_t last_level) {
  if (before == key) return last_level;
  const auto highest = static_cast<std::uint32_t>(63 - std::countl_zero(before ^ key));
  const std::uint32_t axis_bit = key_bits - 1 - highest / 3;  // 0: the half of the root
  return std::min(axis_bit < grid_bits ? 0 : axis_bit - grid_bits + 1, last_level);
}

}  // namespace

double CloudOctree::side_m_of(std::uint32_t level) const {
  return std::ldexp(side_m, -static_cast<int>(level));
}

Eigen::Vector3d CloudOctree::origin_m_of(const CloudNode& node) const {
  return origin_m + side_m_of(node.level) * Eigen::Vector3d(node.cell[0], node.cell[1], node.cell[2]);
}

CloudOctree build_cloud_octree(std::vector<CloudPoint> points, double finest_cell_m,
                               std::size_t fewest_points) {
  CloudOctree tree;
  if (points.empty()) return tree;
  Eigen::Array3f low = Eigen::Array3f::Constant(points[0].position.x);
  low << points[0].position.x, points[0].position.y, points[0].position.z;
  Eigen::Array3f high = low;
  for (const CloudPoint& point : points) {
    const Eigen::Array3f at(point.position.x, point.position.y, point.position.z);
    low = low.min(at);
    high = high.max(at);
  }
  tree.origin_m = low.cast<double>();
  tree.side_m = std::max(static_cast<double>((high - low).maxCoeff()) * (1 + 1e-6), 1.0);
  const double levels = std::ceil(std::log2(tree.side_m / CloudOctree::cells_a_side / finest_cell_m));
  const auto last_level = static_cast<std::uint32_t>(std::clamp(levels, 0.0, double{deepest_level}));

  std::vector<Keyed> order(points.size());
  const double cells_a_metre = double{1U << key_bits} / tree.side_m;
  for_each_index(points.size(), [&](std::size_t i) {
    const auto axis = [&](float at, double origin) {
      const double cell = (static_cast<double>(at) - origin) * cells_a_metre;
      return spread(static_cast<std::uint64_t>(std::clamp(cell, 0.0, double{(1U << key_bits) - 1})));
    };
    const Point& p = points[i].position;
    order[i] = {
        axis(p.x, tree.origin_m.x()) | axis(p.y, tree.origin_m.y()) << 1 | axis(p.z, tree.origin_m.z()) << 2,
        i};
  });
  sort_in_parallel(order, [](const Keyed& a, const Keyed& b) {
    return a.key != b.key ? a.key < b.key : a.index < b.index;
  });

  std::vector<std::uint8_t> levels_of(points.size(), 0);
  for (std::size_t i = 1; i < order.size(); ++i)
    levels_of[i] = static_cast<std::uint8_t>(level_between(order[i - 1].key, order[i].key, last_level));

  // From the finest level up: a node that is hardly one joins its parent; then the nodes are known.
  std::vector<std::vector<CloudNode>> nodes(last_level + 1);
  std::vector<std::size_t> members;
  for (std::uint32_t level = last_level + 1; level-- > 0;) {
    const auto end_node = [&](std::uint64_t key) {
      if (members.empty()) return;
      if (level > 0 && members.size() < fewest_points) {
        for (const std::size_t i : members) levels_of[i] = static_cast<std::uint8_t>(level - 1);
      } else {
        nodes[level].push_back({level, {gather(key), gather(key >> 1), gather(key >> 2)}, 0, members.size()});
      }
      members.clear();
    };
    std::uint64_t key = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (levels_of[i] != level) continue;
      const std::uint64_t of_point = node_key(order[i].key, level);
      if (of_point != key) end_node(key);
      key = of_point;
      members.push_back(i);
    }
    end_node(key);
  }

  std::vector<std::size_t> next(last_level + 1, 0);
  std::size_t first = 0;
  for (std::uint32_t level = 0; level <= last_level; ++level) {
    next[level] = first;
    for (CloudNode& node : nodes[level]) {
      node.first = first;
      first += node.count;
      tree.nodes.push_back(node);
    }
  }
  tree.points.resize(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) tree.points[next[levels_of[i]]++] = points[order[i].index];
  return tree;
}

}  // namespace alces::offline
