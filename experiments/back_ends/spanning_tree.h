// The tree that TORO puts its parameters on (Grisetti et al. 2007, "Construction of the tree"): the parent of
// a vertex is the first of its neighbours in the order of the drive. Where that gives no tree, because a
// vertex has later neighbours only, it is reached from the one of them that is itself reached first.
#pragma once

#include <cstdint>
#include <vector>

#include "offline/optimize/graph/constraint_graph.h"

namespace alces::offline {

struct SpanningTree {
  static constexpr std::uint32_t no_parent = UINT32_MAX;
  std::uint32_t root = 0;                ///< the first fixed vertex, or the first of all
  std::vector<std::uint32_t> parent;     ///< no_parent of the root; of other fixed vertices, the root
  std::vector<std::uint32_t> depth;      ///< 0 of the root
  std::vector<std::uint32_t> from_root;  ///< all vertices, parents before children

  /// Where the ways from two vertices to the root meet. O(depth).
  [[nodiscard]] std::uint32_t meeting(std::uint32_t a, std::uint32_t b) const;
};

/// Of a connected graph with at least one vertex; O((n + m) log n).
[[nodiscard]] SpanningTree spanning_tree(const ConstraintGraph& graph);

}  // namespace alces::offline
