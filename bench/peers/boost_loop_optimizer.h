// LOA as 3DTK and PCL have it: Algorithm 1 on a Boost graph, one Dijkstra for each candidate in every round.
#pragma once

#include <algorithm>
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/dijkstra_shortest_paths.hpp>
#include <cstddef>
#include <cstdint>
#include <list>
#include <span>
#include <utility>
#include <vector>

namespace alces::bench {

class BoostLoopOptimizer {
 public:
  using Graph = boost::adjacency_list<boost::vecS, boost::vecS, boost::undirectedS, boost::no_property,
                                      boost::property<boost::edge_weight_t, double>>;
  struct Edge {
    std::size_t from = 0;
    std::size_t to = 0;
    double cost = 1;
  };

  static std::vector<double> weights(std::size_t vertices, std::span<const Edge> edges, std::size_t f,
                                     std::size_t l) {
    Graph graph(vertices);
    for (const Edge& edge : edges) add_edge(edge.from, edge.to, edge.cost, graph);
    std::vector<double> weights(vertices, 0.0);
    weights[l] = 1;
    std::list<std::size_t> crossings = {f, l};
    std::list<std::size_t> branches;
    std::vector<std::size_t> before(vertices), best_before(vertices);
    std::vector<double> distance(vertices), best_distance(vertices);
    while (!crossings.empty()) {
      double shortest = -1;
      auto start = crossings.begin();
      auto end = crossings.begin();
      for (auto s = crossings.begin(); s != crossings.end();) {
        dijkstra_shortest_paths(graph, *s,
                                boost::predecessor_map(before.data()).distance_map(distance.data()));
        bool is_better = false;
        bool leads_on = false;
        for (auto e = crossings.begin(); e != crossings.end(); ++e) {
          if (e == s || *e == before[*e]) continue;
          leads_on = true;
          if (shortest >= 0 && distance[*e] >= shortest) continue;
          start = s;
          end = e;
          shortest = distance[*e];
          is_better = true;
        }
        if (is_better) {
          std::swap(before, best_before);
          std::swap(distance, best_distance);
        }
        if (leads_on) {
          ++s;
        } else {  // what still hangs on it is a branch
          branches.push_back(*s);
          s = crossings.erase(s);
        }
      }
      if (shortest < 0) continue;
      const std::size_t first = *start;
      const std::size_t last = *end;
      remove_edge(last, best_before[last], graph);
      for (std::size_t v = best_before[last]; v != first; v = best_before[v]) {
        weights[v] =
            weights[first] + (weights[last] - weights[first]) * best_distance[v] / best_distance[last];
        remove_edge(v, best_before[v], graph);
        if (degree(v, graph) > 0) crossings.push_back(v);
      }
      if (degree(first, graph) == 0) crossings.erase(start);
      if (degree(last, graph) == 0) crossings.erase(end);
    }
    std::vector<bool> is_seen(vertices, false);
    for (const std::size_t root : branches) is_seen[root] = true;
    while (!branches.empty()) {
      const std::size_t v = branches.front();
      branches.pop_front();
      for (auto [at, stop] = adjacent_vertices(v, graph); at != stop; ++at) {
        if (is_seen[*at]) continue;
        is_seen[*at] = true;
        weights[*at] = weights[v];
        branches.push_back(*at);
      }
    }
    return weights;
  }
};

}  // namespace alces::bench
