#include "spanning_tree.h"

#include <algorithm>
#include <functional>
#include <queue>

namespace alces::offline {
namespace {

// Neighbours of all vertices, one after the other: those of v are [begin[v], begin[v + 1]).
struct Neighbours {
  explicit Neighbours(const ConstraintGraph& graph) : begin(graph.vertices.size() + 1) {
    for (const Constraint& constraint : graph.constraints) {
      ++begin[constraint.from + 1];
      ++begin[constraint.to + 1];
    }
    for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
    of.resize(begin.back());
    std::vector<std::size_t> end(begin.begin(), begin.end() - 1);
    for (const Constraint& constraint : graph.constraints) {
      of[end[constraint.from]++] = constraint.to;
      of[end[constraint.to]++] = constraint.from;
    }
  }
  std::vector<std::size_t> begin;
  std::vector<std::uint32_t> of;
};

}  // namespace

std::uint32_t SpanningTree::meeting(std::uint32_t a, std::uint32_t b) const {
  while (a != b) {
    if (depth[a] < depth[b]) std::swap(a, b);
    a = parent[a];
  }
  return a;
}

SpanningTree spanning_tree(const ConstraintGraph& graph) {
  const auto vertex_count = static_cast<std::uint32_t>(graph.vertices.size());
  const Neighbours neighbours(graph);
  SpanningTree tree;
  tree.parent.assign(vertex_count, SpanningTree::no_parent);
  tree.depth.assign(vertex_count, 0);
  tree.from_root.reserve(vertex_count);
  std::vector<bool> is_reached(vertex_count, false);
  std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> reached;
  const auto reach = [&](std::uint32_t vertex, std::uint32_t parent) {
    is_reached[vertex] = true;
    tree.parent[vertex] = parent;
    if (parent != SpanningTree::no_parent) tree.depth[vertex] = tree.depth[parent] + 1;
    reached.push(vertex);
  };

  const auto first_fixed =
      std::find_if(graph.vertices.begin(), graph.vertices.end(), [](const auto& v) { return v.is_fixed; });
  if (first_fixed != graph.vertices.end())
    tree.root = static_cast<std::uint32_t>(first_fixed - graph.vertices.begin());
  reach(tree.root, SpanningTree::no_parent);
  for (std::uint32_t v = tree.root + 1; v < vertex_count; ++v)
    if (graph.vertices[v].is_fixed) reach(v, tree.root);
  while (!reached.empty()) {
    const std::uint32_t vertex = reached.top();
    reached.pop();
    for (std::size_t i = neighbours.begin[vertex]; i < neighbours.begin[vertex + 1]; ++i)
      if (!is_reached[neighbours.of[i]]) reach(neighbours.of[i], vertex);
  }

  for (std::uint32_t v = 0; v < vertex_count; ++v) tree.from_root.push_back(v);
  std::stable_sort(tree.from_root.begin(), tree.from_root.end(),
                   [&tree](std::uint32_t a, std::uint32_t b) { return tree.depth[a] < tree.depth[b]; });
  return tree;
}

}  // namespace alces::offline
