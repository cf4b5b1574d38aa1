// A k-d tree in arrays: exact nearest neighbours among the points of one scan.
//
// Median splits order the points so that every aligned run of 4^k leaves is a subtree: the tree needs no
// links. Leaves hold 16 points as x[16] y[16] z[16], inner nodes the tight boxes of their four children, so
// that both are measured four lanes at a time (a box prunes more than a splitting plane, for scans are
// surfaces).
//
// A point's index is its place in the leaves; KdTreeScratch::input_of() says where it stood in the input of
// build(). Memory: 15 bytes a point of capacity, and 16 more for building, which several trees can share.
// Build O(n log n), query O(log n) expected, at most all leaves.
#pragma once

#include <cstdint>
#include <limits>
#include <span>

#include "alces/arena.h"
#include "alces/point.h"

namespace alces {

/// A neighbour by its index in the tree, and its squared distance; `none` where no point lies within the
/// radius.
struct Neighbor {
  static constexpr std::uint32_t none = UINT32_MAX;
  std::uint32_t index = none;
  float squared_m2 = std::numeric_limits<float>::infinity();
};

/// What building takes beside the tree itself.
class KdTreeScratch {
 public:
  constexpr KdTreeScratch(Arena& arena, std::uint32_t point_capacity)
      : items_(arena.allocate<Item>(point_capacity)) {}

  /// Index, in the input of the last build with this scratch, of the tree's point `index`.
  [[nodiscard]] std::uint32_t input_of(std::uint32_t index) const { return items_[index].input; }

 private:
  friend class KdTree;
  struct Item {
    float xyz[3];
    std::uint32_t input;
  };
  std::span<Item> items_;
};

class KdTree {
 public:
  static constexpr std::uint32_t leaf_size = 16;
  static constexpr std::uint32_t maximum_neighbors = 32;
  static constexpr std::uint32_t maximum_points = 1U << 24;

  constexpr KdTree() = default;
  constexpr KdTree(Arena& arena, std::uint32_t point_capacity)
      : leaves_(arena.allocate<Leaf>(leaf_count(point_capacity))),
        nodes_(arena.allocate<Node>(node_count(leaf_count(point_capacity)))) {}

  /// Builds the tree over finite points. False, and an empty tree, if they exceed a capacity.
  [[nodiscard]] bool build(std::span<const Point> points, KdTreeScratch& scratch);

  /// Rebuilds the very tree that once gave these points in this order, in O(n): for scans brought back
  /// from a store. False, and an empty tree, if they exceed the capacity.
  [[nodiscard]] bool restore(std::span<const Point> points_in_tree_order);

  [[nodiscard]] std::uint32_t size() const { return size_; }
  [[nodiscard]] Point point(std::uint32_t index) const {
    const Leaf& leaf = leaves_[index / leaf_size];
    const std::uint32_t lane = index % leaf_size;
    return {leaf.xyz[0][lane], leaf.xyz[1][lane], leaf.xyz[2][lane]};
  }

  /// The nearest point closer than sqrt(radius_m2); the radius is given squared. A `hint`, any index of the
  /// tree that is likely near, spares most of the search; it never changes the distance found.
  [[nodiscard]] Neighbor nearest(const Point& query, float radius_m2,
                                 std::uint32_t hint = Neighbor::none) const;

  /// The same, and in `others_m2` a lower bound on the squared distance to all *other* points of the tree.
  /// Once the query has moved by d, the answer still stands if it is nearer than sqrt(others_m2) - d
  /// (Icp spares its searches by that).
  [[nodiscard]] Neighbor nearest(const Point& query, float radius_m2, std::uint32_t hint,
                                 float& others_m2) const;

  /// The up to neighbors.size() (at most maximum_neighbors) nearest points closer than sqrt(radius_m2),
  /// ascending; returns how many. A point of the tree finds itself at distance zero.
  std::uint32_t nearest(const Point& query, float radius_m2, std::span<Neighbor> neighbors) const;

 private:
  static constexpr std::uint32_t arity = 4;

  struct alignas(32) Leaf {
    float xyz[3][leaf_size];  // lanes beyond the last point hold +Inf
  };
  struct alignas(32) Node {
    float low[3][arity];  // boxes of the children; a missing child's is +Inf .. -Inf
    float high[3][arity];
  };

  static constexpr std::uint32_t leaf_count(std::uint32_t points) {
    return (points + leaf_size - 1) / leaf_size;
  }
  static constexpr std::uint32_t node_count(std::uint32_t leaves) {
    std::uint32_t nodes = 0;
    while (leaves > 1) nodes += leaves = (leaves + arity - 1) / arity;
    return nodes;
  }

  void bound_boxes();
  template <bool keeps_bound, typename Visit>
  float search(const Point& query, float radius_m2, Visit&& visit) const;
  template <bool keeps_bound>
  Neighbor find_nearest(const Point& query, float radius_m2, std::uint32_t hint, float& others_m2) const;

  static constexpr std::uint32_t maximum_levels = 12;  // of 4^12 leaves

  std::span<Leaf> leaves_;
  std::span<Node> nodes_;                        // level by level, the leaves' parents first
  std::uint32_t level_begin_[maximum_levels]{};  // where each level starts in nodes_
  std::uint32_t levels_ = 0;
  std::uint32_t size_ = 0;
};

}  // namespace alces
