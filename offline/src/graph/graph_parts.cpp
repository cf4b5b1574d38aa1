#include "alces_offline/graph/graph_parts.h"

#include <fmt/format.h>

#include <numeric>

#include "alces_offline/error.h"

namespace alces::offline {
namespace {

std::uint32_t root_of(std::vector<std::uint32_t>& parent, std::uint32_t vertex) {
  while (parent[vertex] != vertex) vertex = parent[vertex] = parent[parent[vertex]];
  return vertex;
}

}  // namespace

GraphParts graph_parts(const ConstraintGraph& graph) {
  const std::size_t n = graph.vertices.size();
  std::vector<std::uint32_t> parent(n);
  std::iota(parent.begin(), parent.end(), 0U);
  for (const Constraint& constraint : graph.constraints) {
    const std::uint32_t a = root_of(parent, constraint.from);
    const std::uint32_t b = root_of(parent, constraint.to);
    // the earlier one becomes the root: a part is named after its first vertex
    if (a < b) parent[b] = a;
    if (b < a) parent[a] = b;
  }
  GraphParts parts;
  parts.part_of_vertex.resize(n);
  for (std::uint32_t vertex = 0; vertex < n; ++vertex) {
    const std::uint32_t root = root_of(parent, vertex);
    if (root == vertex) {
      parts.part_of_vertex[vertex] = static_cast<std::uint32_t>(parts.size());
      parts.first_vertex.push_back(vertex);
      parts.vertex_count.push_back(0);
    }
    parts.part_of_vertex[vertex] = parts.part_of_vertex[root];
    ++parts.vertex_count[parts.part_of_vertex[vertex]];
  }
  return parts;
}

void require_connected(const ConstraintGraph& graph) {
  const GraphParts parts = graph_parts(graph);
  if (parts.size() < 2) return;
  throw InputError(fmt::format(
      "the graph falls into {} parts that no edge joins; the second begins at vertex {} ({} of {} vertices): "
      "join them by an edge or optimise them one by one",
      parts.size(), graph.vertices[parts.first_vertex[1]].id, parts.vertex_count[1], graph.vertices.size()));
}

}  // namespace alces::offline
