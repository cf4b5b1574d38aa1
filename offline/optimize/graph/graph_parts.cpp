#include "graph_parts.h"

#include <fmt/format.h>

#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

std::uint32_t root_of(std::vector<std::uint32_t>& parent, std::uint32_t vertex) {
  while (parent[vertex] != vertex) vertex = parent[vertex] = parent[parent[vertex]];
  return vertex;
}

}  // namespace

GraphParts graph_parts(const ConstraintGraph& graph) {
  const auto n = static_cast<std::uint32_t>(graph.vertices.size());
  std::vector<std::uint32_t> parent;
  parent.reserve(n);
  for (std::uint32_t vertex = 0; vertex < n; ++vertex) parent.push_back(vertex);
  for (const Constraint& constraint : graph.constraints) {
    const std::uint32_t a = root_of(parent, constraint.from);
    const std::uint32_t b = root_of(parent, constraint.to);
    // the earlier one becomes the root: a part is named after its first vertex
    if (a < b) parent[b] = a;
    if (b < a) parent[a] = b;
  }
  GraphParts parts;
  parts.part_of_vertex.reserve(n);
  for (std::uint32_t vertex = 0; vertex < n; ++vertex) {
    const std::uint32_t root = root_of(parent, vertex);
    const auto part = root == vertex ? static_cast<std::uint32_t>(parts.size()) : parts.part_of_vertex[root];
    if (root == vertex) {
      parts.first_vertex.push_back(vertex);
      parts.vertex_count.push_back(0);
    }
    parts.part_of_vertex.push_back(part);
    ++parts.vertex_count[part];
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
