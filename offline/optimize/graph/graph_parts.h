// Which vertices of a graph constraints join, one way or another.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "constraint_graph.h"

namespace alces::offline {

struct GraphParts {
  std::vector<std::uint32_t> part_of_vertex;  ///< numbered in the order of their first vertices
  std::vector<std::uint32_t> first_vertex;    ///< of each part
  std::vector<std::uint32_t> vertex_count;    ///< of each part

  [[nodiscard]] std::size_t size() const { return first_vertex.size(); }
};

/// O(n + m).
[[nodiscard]] GraphParts graph_parts(const ConstraintGraph& graph);

/// An optimiser cannot place one part against another: InputError that says how many there are, and where the
/// second begins. Nothing for a connected graph.
void require_connected(const ConstraintGraph& graph);

}  // namespace alces::offline
