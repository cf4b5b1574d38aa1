// LOA as Algorithm 1 of the paper has it, for the tests: slow, on the heap, obviously right.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <set>
#include <utility>
#include <vector>

namespace alces::test {

struct PlainEdge {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  double cost = 1;
};

class PlainLoopOptimizer {
 public:
  PlainLoopOptimizer(std::uint32_t vertex_count, std::vector<PlainEdge> edges)
      : vertex_count_(vertex_count), edges_(std::move(edges)) {}

  /// Weights of all vertices, 0 where nothing leads to f or l; empty when no way joins f and l.
  std::vector<double> weights(std::uint32_t f, std::uint32_t l) {
    alive_.assign(edges_.size(), true);
    std::vector<double> w(vertex_count_, 0.0);
    w[l] = 1;
    std::set<std::uint32_t> omega = {f, l};
    for (int round = 0;; ++round) {
      // the overall shortest path between two members, by Dijkstra from each of them
      double shortest = infinity;
      std::vector<std::uint32_t> path_edges;
      std::vector<std::uint32_t> path_vertices;  // s..e
      for (const std::uint32_t s : omega) {
        const Tree tree = dijkstra(s);
        for (const std::uint32_t e : omega) {
          if (e == s || !(tree.distance[e] < shortest)) continue;
          shortest = tree.distance[e];
          path_edges.clear();
          path_vertices = {e};
          for (std::uint32_t v = e; v != s; v = other_end(tree.arrived_by[v], v)) {
            path_edges.push_back(tree.arrived_by[v]);
            path_vertices.push_back(other_end(tree.arrived_by[v], v));
          }
          std::reverse(path_edges.begin(), path_edges.end());
          std::reverse(path_vertices.begin(), path_vertices.end());
        }
      }
      if (path_edges.empty()) {
        if (round == 0) return {};
        break;
      }
      const std::uint32_t s = path_vertices.front();
      const std::uint32_t e = path_vertices.back();
      double walked = 0;
      for (std::size_t i = 1; i + 1 < path_vertices.size(); ++i) {
        walked += edges_[path_edges[i - 1]].cost;
        w[path_vertices[i]] = w[s] + walked / shortest * (w[e] - w[s]);
        if (degree(path_vertices[i]) > 2) omega.insert(path_vertices[i]);
      }
      for (const std::uint32_t edge : path_edges) alive_[edge] = false;
      if (degree(s) == 0) omega.erase(s);
      if (degree(e) == 0) omega.erase(e);
    }
    while (!omega.empty()) {
      const std::uint32_t v = *omega.begin();
      for (std::uint32_t edge = 0; edge < edges_.size(); ++edge) {
        if (!alive_[edge] || (edges_[edge].from != v && edges_[edge].to != v)) continue;
        const std::uint32_t neighbour = other_end(edge, v);
        w[neighbour] = w[v];
        alive_[edge] = false;
        if (degree(neighbour) > 0) omega.insert(neighbour);
      }
      omega.erase(v);
    }
    return w;
  }

 private:
  static constexpr double infinity = std::numeric_limits<double>::infinity();

  struct Tree {
    std::vector<double> distance;
    std::vector<std::uint32_t> arrived_by;
  };

  [[nodiscard]] std::uint32_t other_end(std::uint32_t edge, std::uint32_t vertex) const {
    return edges_[edge].from == vertex ? edges_[edge].to : edges_[edge].from;
  }

  [[nodiscard]] std::uint32_t degree(std::uint32_t vertex) const {
    std::uint32_t count = 0;
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      if (alive_[i] && (edges_[i].from == vertex || edges_[i].to == vertex)) ++count;
    }
    return count;
  }

  [[nodiscard]] Tree dijkstra(std::uint32_t start) const {
    Tree tree{std::vector<double>(vertex_count_, infinity), std::vector<std::uint32_t>(vertex_count_, 0)};
    std::vector<bool> settled(vertex_count_, false);
    tree.distance[start] = 0;
    for (;;) {
      std::uint32_t nearest = vertex_count_;
      for (std::uint32_t v = 0; v < vertex_count_; ++v) {
        if (settled[v] || tree.distance[v] == infinity) continue;
        if (nearest == vertex_count_ || tree.distance[v] < tree.distance[nearest]) nearest = v;
      }
      if (nearest == vertex_count_) return tree;
      settled[nearest] = true;
      for (std::uint32_t edge = 0; edge < edges_.size(); ++edge) {
        if (!alive_[edge] || (edges_[edge].from != nearest && edges_[edge].to != nearest)) continue;
        const std::uint32_t neighbour = other_end(edge, nearest);
        const double distance = tree.distance[nearest] + edges_[edge].cost;
        if (distance < tree.distance[neighbour]) {
          tree.distance[neighbour] = distance;
          tree.arrived_by[neighbour] = edge;
        }
      }
    }
  }

  std::uint32_t vertex_count_;
  std::vector<PlainEdge> edges_;
  std::vector<bool> alive_;
};

}  // namespace alces::test
