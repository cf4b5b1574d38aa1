#include "alces/loop_optimizer.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "support/plain_loop_optimizer.h"

using namespace alces;
using alces::test::PlainEdge;
using alces::test::PlainLoopOptimizer;

namespace {

constexpr LoopCost all_costs[] = {LoopCost::x, LoopCost::y, LoopCost::z, LoopCost::rotation};

/// A graph and an optimizer that fits it, in a block of their own.
class Bench {
 public:
  explicit Bench(const PoseGraph::Capacity& capacity) : block_(plan(capacity) + Arena::alignment) {
    void* start = block_.data();
    std::size_t space = block_.size();
    std::align(Arena::alignment, plan(capacity), start, space);
    arena_ = Arena({static_cast<std::byte*>(start), space});
    graph = std::make_unique<PoseGraph>(arena_, capacity);
    optimizer = std::make_unique<LoopOptimizer>(arena_, capacity);
    REQUIRE_FALSE(arena_.overflowed());
  }

  /// Edge costs as given for x; y, z and rotation get other positive ones, drawn from the first.
  Bench(std::uint32_t vertices, const std::vector<PlainEdge>& edges)
      : Bench(PoseGraph::Capacity{vertices, static_cast<std::uint32_t>(edges.size())}) {
    for (std::uint32_t i = 0; i < vertices; ++i) REQUIRE(graph->add_vertex(Pose{}) == Status::ok);
    for (const PlainEdge& plain : edges) {
      Edge edge;
      edge.from = plain.from;
      edge.to = plain.to;
      edge.variance = {plain.cost, other_cost(plain.cost, 1), other_cost(plain.cost, 2),
                       other_cost(plain.cost, 3)};
      if (graph->add_edge(edge) != Status::ok) FAIL("edge refused");
    }
  }

  static double other_cost(double cost, int which) {
    const double chaos = cost < 1e9 ? std::fmod(cost * 7919.0 * which, 1.0) : 0.5;
    return which == 0 ? cost : 0.1 + chaos;
  }

  static constexpr std::size_t plan(const PoseGraph::Capacity& capacity) {
    Arena counting;
    const PoseGraph graph(counting, capacity);
    const LoopOptimizer optimizer(counting, capacity);
    return counting.used_bytes();
  }

  [[nodiscard]] std::vector<double> weights(std::uint32_t f, std::uint32_t l, LoopCost cost = LoopCost::x) {
    std::vector<double> result(graph->vertex_count(), -1.0);
    if (optimizer->prepare(*graph, f, l) != Status::ok) return {};
    if (optimizer->weights(cost, result) != Status::ok) return {};
    return result;
  }

  std::unique_ptr<PoseGraph> graph;
  std::unique_ptr<LoopOptimizer> optimizer;

 private:
  std::vector<std::byte> block_;
  Arena arena_;
};

bool is_same(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!(std::abs(a[i] - b[i]) < 1e-9)) return false;
  }
  return true;
}

/// The decomposition, taken alone, gives the weights, and touches every connected vertex once. "" or what
/// fails.
std::string check_decomposition(Bench& bench, std::uint32_t f, std::uint32_t l, LoopCost cost) {
  const PoseGraph& graph = *bench.graph;
  LoopOptimizer& optimizer = *bench.optimizer;
  std::vector<double> expected(graph.vertex_count());
  if (optimizer.prepare(graph, f, l) != Status::ok) return "prepare";
  // in either order: the branches found by one run serve the others
  if ((f & 1) == 0 && optimizer.weights(cost, expected) != Status::ok) return "weights";
  if (optimizer.decompose(cost) != Status::ok) return "decompose";

  std::vector<double> w(graph.vertex_count(), std::nan(""));
  std::vector<bool> edge_is_used(graph.edge_count(), false);
  w[f] = 0;
  w[l] = 1;
  const auto cost_of = [&](std::uint32_t half_edge) {
    const EdgeVariance& v = graph.edges()[half_edge / 2].variance;
    const double costs[] = {v.x_m2, v.y_m2, v.z_m2, v.rotation_rad2};
    return costs[static_cast<std::size_t>(cost)];
  };
  for (const LoopOptimizer::Trail& trail : optimizer.trails()) {
    const auto steps = optimizer.steps(trail);
    if (steps.empty() || steps.back().vertex != trail.end) return "a trail does not end at its end";
    if (trail.start == trail.end) return "a trail is a cycle";
    if (std::isnan(w[trail.start]) || std::isnan(w[trail.end])) return "a trail's ends are not known";
    double length = 0;
    for (const auto& step : steps) length += cost_of(step.half_edge);
    double walked = 0;
    std::uint32_t at = trail.start;
    for (const auto& step : steps) {
      if (graph.target(step.half_edge) != step.vertex) return "a step leads elsewhere";
      if (graph.target(step.half_edge ^ 1) != at) return "a step does not begin where the last ended";
      if (edge_is_used[step.half_edge / 2]) return "an edge is used twice";
      edge_is_used[step.half_edge / 2] = true;
      walked += cost_of(step.half_edge);
      at = step.vertex;
      if (at == trail.end) continue;
      if (!std::isnan(w[at])) return "a trail runs through a known vertex";
      w[at] = w[trail.start] + walked / length * (w[trail.end] - w[trail.start]);
    }
  }
  for (const LoopOptimizer::BranchVertex& branch : optimizer.branches()) {
    if (graph.target(branch.half_edge) != branch.vertex) return "a branch leads elsewhere";
    if (graph.target(branch.half_edge ^ 1) != branch.parent) return "a branch begins elsewhere";
    if (edge_is_used[branch.half_edge / 2]) return "a branch edge is used twice";
    edge_is_used[branch.half_edge / 2] = true;
    if (!std::isnan(w[branch.vertex])) return "a branch runs through a known vertex";
    if (std::isnan(w[branch.parent])) return "a branch vertex comes before its parent";
    w[branch.vertex] = w[branch.parent];
    if (w[branch.root] != w[branch.vertex]) return "a branch has another root";
  }
  if ((f & 1) == 1 && optimizer.weights(cost, expected) != Status::ok) return "weights";
  for (const Edge& edge : graph.edges()) {
    if (std::isnan(w[edge.from]) != std::isnan(w[edge.to])) return "a connected vertex is left out";
  }
  for (std::uint32_t v = 0; v < graph.vertex_count(); ++v) {
    if (!(expected[v] >= 0 && expected[v] <= 1)) return "a weight is out of [0, 1]";
    if (!(std::abs((std::isnan(w[v]) ? 0 : w[v]) - expected[v]) < 1e-9)) return "other weights";
  }
  return "";
}

struct RandomGraph {
  std::uint32_t vertices = 0;
  std::vector<PlainEdge> edges;
  std::uint32_t f = 0;
  std::uint32_t l = 1;
};

class GraphMaker {
 public:
  explicit GraphMaker(std::uint32_t seed) : random_(seed) {}

  std::uint32_t below(std::uint32_t end) { return static_cast<std::uint32_t>(random_() % end); }
  double cost() {
    if (whole_costs) return 1.0 + below(3);
    return std::exp(std::uniform_real_distribution<double>(-3, 3)(random_));
  }

  RandomGraph drive(std::uint32_t scans, std::uint32_t loops) {
    RandomGraph graph{scans, {}, 0, scans - 1};
    for (std::uint32_t i = 1; i < scans; ++i) add(graph, i - 1, i);
    for (std::uint32_t i = 0; i < loops; ++i) add(graph, below(scans), below(scans));
    return graph;
  }

  RandomGraph any(std::uint32_t largest) {
    RandomGraph graph;
    graph.vertices = 2 + below(largest);
    switch (below(6)) {
      case 0:
        grow_tree(graph, 0, graph.vertices);
        break;
      case 1:
        graph = drive(graph.vertices, below(6));
        break;
      case 2:
        join_at_random(graph, below(3 * graph.vertices));
        break;
      case 3:  // dense, with many edges between the same two
        graph.vertices = 2 + below(5);
        join_at_random(graph, below(20));
        break;
      case 4:  // cycles, of two vertices as well, hanging on each other
        for (std::uint32_t v = 0; v < graph.vertices;) {
          const std::uint32_t hook = v == 0 ? graph.vertices : below(v);
          const std::uint32_t end = std::min(graph.vertices, v + 1 + below(5));
          for (std::uint32_t i = v + 1; i < end; ++i) add(graph, i - 1, i);
          add(graph, end - 1, v);
          if (hook < v) add(graph, v, hook);
          if (hook < v && below(2) == 0) add(graph, end - 1, hook);
          v = end;
        }
        break;
      default:  // two parts that may not know of each other
        grow_tree(graph, 0, graph.vertices / 2);
        grow_tree(graph, graph.vertices / 2, graph.vertices);
        join_at_random(graph, below(5));
    }
    graph.f = below(graph.vertices);
    graph.l = below(graph.vertices);
    std::shuffle(graph.edges.begin(), graph.edges.end(), random_);
    return graph;
  }

  bool whole_costs = false;

 private:
  void add(RandomGraph& graph, std::uint32_t a, std::uint32_t b) {
    if (a == b) return;
    if (below(2) == 0) std::swap(a, b);
    graph.edges.push_back({a, b, cost()});
  }
  void grow_tree(RandomGraph& graph, std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t v = begin + 1; v < end; ++v) add(graph, v, begin + below(v - begin));
  }
  void join_at_random(RandomGraph& graph, std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) add(graph, below(graph.vertices), below(graph.vertices));
  }

  std::mt19937 random_;
};

/// A graph's vertices, f, l and edges as numbers, whatever the order and the direction of its edges.
std::vector<std::uint32_t> shape_of(const RandomGraph& graph) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const PlainEdge& edge : graph.edges) pairs.push_back(std::minmax(edge.from, edge.to));
  std::ranges::sort(pairs);
  std::vector<std::uint32_t> shape = {graph.vertices, graph.f, graph.l};
  for (const auto& [low, high] : pairs) shape.insert(shape.end(), {low, high});
  return shape;
}

/// What the part of a graph that joins f and l is like; a graph may be of several kinds.
enum class Kind { tree, nested_loops, multi_edge, branch, disconnected_part, end_on_branch, f_and_l_apart };

constexpr std::pair<Kind, const char*> names_of_kinds[] = {{Kind::tree, "a tree"},
                                                           {Kind::nested_loops, "loops that share a way"},
                                                           {Kind::multi_edge, "edges between the same two"},
                                                           {Kind::branch, "a branch beside a loop"},
                                                           {Kind::disconnected_part, "a part of its own"},
                                                           {Kind::end_on_branch, "f or l on a branch"},
                                                           {Kind::f_and_l_apart, "f and l are not joined"}};

/// Which vertices can be reached from `start` without the edge `left_out`.
std::vector<bool> reached_from(const RandomGraph& graph, std::uint32_t start,
                               std::size_t left_out = SIZE_MAX) {
  std::vector<bool> reached(graph.vertices, false);
  reached[start] = true;
  for (bool grows = true; grows;) {
    grows = false;
    for (std::size_t e = 0; e < graph.edges.size(); ++e) {
      const PlainEdge& edge = graph.edges[e];
      if (e == left_out || reached[edge.from] == reached[edge.to]) continue;
      reached[edge.from] = reached[edge.to] = grows = true;
    }
  }
  return reached;
}

std::set<Kind> kinds_of(const RandomGraph& graph) {
  std::set<Kind> kinds;
  const std::vector<bool> joined = reached_from(graph, graph.f);
  if (std::ranges::count(joined, false) > 0) kinds.insert(Kind::disconnected_part);
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  std::vector<std::uint32_t> loop_degree(graph.vertices, 0);  // edges that lie in a cycle
  bool has_bridge = false;
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const PlainEdge& edge = graph.edges[e];
    if (!joined[edge.from]) continue;
    if (!pairs.insert(std::minmax(edge.from, edge.to)).second) kinds.insert(Kind::multi_edge);
    if (!reached_from(graph, edge.from, e)[edge.to]) {
      has_bridge = true;
      continue;
    }
    ++loop_degree[edge.from];
    ++loop_degree[edge.to];
  }
  const bool has_loop = std::ranges::any_of(loop_degree, [](std::uint32_t degree) { return degree > 0; });
  if (!has_loop) {
    kinds.insert(Kind::tree);
    return kinds;
  }
  const bool share_a_way = std::ranges::any_of(loop_degree, [](std::uint32_t d) { return d % 2 == 1; });
  if (share_a_way) kinds.insert(Kind::nested_loops);
  if (has_bridge) kinds.insert(Kind::branch);
  if (loop_degree[graph.f] == 0 || loop_degree[graph.l] == 0) kinds.insert(Kind::end_on_branch);
  return kinds;
}

}  // namespace

TEST_CASE("a simple loop shares by distance (paper, Figure 5)") {
  Bench bench(5, {{0, 1, 1}, {1, 2, 3}, {2, 3, 2}, {3, 4, 1}});
  CHECK(is_same(bench.weights(0, 4), {0, 1.0 / 7, 4.0 / 7, 6.0 / 7, 1}));
  CHECK(is_same(bench.weights(4, 0), {1, 6.0 / 7, 3.0 / 7, 1.0 / 7, 0}));
}

TEST_CASE("a branch takes the weight of the vertex it hangs on (paper, Figure 6)") {
  // A B C D A' F G H
  Bench bench(8, {{0, 1, 1}, {1, 2, 3}, {2, 3, 2}, {3, 4, 1}, {1, 5, 5}, {5, 6, 4}, {6, 7, 2}});
  CHECK(is_same(bench.weights(0, 4), {0, 1.0 / 7, 4.0 / 7, 6.0 / 7, 1, 1.0 / 7, 1.0 / 7, 1.0 / 7}));
}

TEST_CASE("a second loop shares what its ends have (paper, Figure 7)") {
  // A B C G A' D E F
  Bench bench(8, {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {2, 5}, {5, 6}, {6, 7}, {7, 3}});
  CHECK(is_same(bench.weights(0, 4), {0, 1.0 / 4, 2.0 / 4, 3.0 / 4, 1, 9.0 / 16, 10.0 / 16, 11.0 / 16}));
}

TEST_CASE("parallel chains and edges between the same two vertices each share from end to end") {
  Bench bench(4, {{0, 1, 1}, {0, 1, 2}, {0, 2, 3}, {2, 1, 1}, {1, 3, 1}, {3, 0, 4}});
  CHECK(is_same(bench.weights(0, 1), {0, 1, 3.0 / 4, 4.0 / 5}));
}

TEST_CASE("a cycle that hangs on one vertex takes that vertex's weight") {
  // 0-1-2 with the cycle 1-3-4-1, the double edge 4-5, and the cycle 5-6-5 behind it
  Bench bench(7, {{0, 1}, {1, 2}, {1, 3}, {3, 4}, {4, 1}, {4, 5}, {4, 5}, {5, 6}, {6, 5}});
  CHECK(is_same(bench.weights(0, 2), {0, 0.5, 1, 0.5, 0.5, 0.5, 0.5}));
  CHECK(check_decomposition(bench, 0, 2, LoopCost::x).empty());
}

TEST_CASE("f or l may lie in the middle of a chain, at its end, or on a branch") {
  Bench bench(6, {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}});
  CHECK(is_same(bench.weights(1, 4), {0, 0, 1.0 / 3, 2.0 / 3, 1, 1}));
  Bench ring(5, {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {3, 4}});
  CHECK(is_same(ring.weights(4, 1), {2.0 / 3, 1, 2.0 / 3, 1.0 / 3, 0}));
}

TEST_CASE("what is not connected to the loop has weight zero and belongs to no trail") {
  // a line 0-1-2, a lone vertex 3, and the cycle 4-5-6 without a junction
  Bench bench(7, {{0, 1}, {1, 2}, {4, 5}, {5, 6}, {6, 4}});
  CHECK(is_same(bench.weights(0, 2), {0, 0.5, 1, 0, 0, 0, 0}));
  REQUIRE(bench.optimizer->decompose(LoopCost::x) == Status::ok);
  CHECK(bench.optimizer->trails().size() == 1);
  CHECK(bench.optimizer->branches().empty());
}

TEST_CASE("LOA says why it cannot run") {
  Bench bench(4, {{0, 1}, {2, 3}});
  LoopOptimizer& optimizer = *bench.optimizer;
  std::vector<double> weights(4);
  CHECK(optimizer.weights(LoopCost::x, weights) == Status::disconnected);
  CHECK(optimizer.decompose(LoopCost::x) == Status::disconnected);
  CHECK(optimizer.prepare(*bench.graph, 0, 4) == Status::no_such_vertex);
  CHECK(optimizer.prepare(*bench.graph, 4, 0) == Status::no_such_vertex);
  CHECK(optimizer.prepare(*bench.graph, 1, 1) == Status::no_loop);
  CHECK(optimizer.prepare(*bench.graph, 0, 2) == Status::disconnected);
  CHECK(optimizer.weights(LoopCost::x, weights) == Status::disconnected);
  CHECK(optimizer.prepare(*bench.graph, 0, 1) == Status::ok);
  CHECK(optimizer.weights(LoopCost::x, std::span(weights).first(3)) == Status::buffer_too_small);
  CHECK(optimizer.weights(LoopCost::x, weights) == Status::ok);

  Bench larger(5, {{0, 1}, {1, 2}, {2, 3}});
  CHECK(optimizer.prepare(*larger.graph, 0, 1) == Status::no_scan_capacity);
  Bench denser(4, {{0, 1}, {1, 2}, {2, 3}});
  CHECK(optimizer.prepare(*denser.graph, 0, 1) == Status::no_edge_capacity);
  CHECK(optimizer.decompose(LoopCost::x) == Status::disconnected);
}

TEST_CASE("LOA's weights are the plain algorithm's on random graphs, and its decomposition gives them") {
  GraphMaker maker(20110907);
  std::set<std::vector<std::uint32_t>> shapes;  // of all graphs that join f and l, costs apart
  std::map<Kind, int> count_of;
  for (int i = 0; i < 20000; ++i) {
    const RandomGraph random = maker.any(i % 100 == 0 ? 60 : 14);
    if (random.f == random.l) continue;
    CAPTURE(i, random.vertices, random.edges.size(), random.f, random.l);
    Bench bench(random.vertices, random.edges);
    bool is_connected = true;
    for (const LoopCost cost : {LoopCost::x, all_costs[i % 4]}) {
      std::vector<PlainEdge> edges = random.edges;
      for (PlainEdge& edge : edges) edge.cost = Bench::other_cost(edge.cost, static_cast<int>(cost));
      const std::vector<double> plain =
          PlainLoopOptimizer(random.vertices, std::move(edges)).weights(random.f, random.l);
      const std::vector<double> weights = bench.weights(random.f, random.l, cost);
      if (!is_same(weights, plain)) FAIL("other weights than the plain algorithm");
      is_connected = !plain.empty();
      if (!is_connected) break;
      const std::string complaint = check_decomposition(bench, random.f, random.l, cost);
      if (!complaint.empty()) FAIL(complaint);
    }
    if (!is_connected) {
      ++count_of[Kind::f_and_l_apart];
    } else if (shapes.insert(shape_of(random)).second) {
      for (const Kind kind : kinds_of(random)) ++count_of[kind];
    }
  }
  CHECK(shapes.size() >= 10000);
  for (const auto& [kind, name] : names_of_kinds) {
    CAPTURE(name, count_of[kind]);
    CHECK(count_of[kind] >= 500);
  }
}

TEST_CASE("ties between paths leave a valid result, the same each time") {
  GraphMaker maker(2);
  maker.whole_costs = true;
  for (int i = 0; i < 4000; ++i) {
    const RandomGraph random = maker.any(i % 20 == 0 ? 80 : 20);
    if (random.f == random.l) continue;
    CAPTURE(i);
    Bench bench(random.vertices, random.edges);
    const std::vector<double> weights = bench.weights(random.f, random.l);
    if (weights.empty()) continue;
    const std::string complaint = check_decomposition(bench, random.f, random.l, LoopCost::x);
    if (!complaint.empty()) FAIL(complaint);
    if (bench.weights(random.f, random.l) != weights) FAIL("not the same again");
  }
}

TEST_CASE("costs of any size leave weights between zero and one") {
  GraphMaker maker(3);
  for (int i = 0; i < 2000; ++i) {
    RandomGraph random = maker.any(20);
    if (random.f == random.l) continue;
    CAPTURE(i);
    // differences of 300 powers of ten: sums do not show their smaller part
    constexpr double sizes[] = {5e-324, 1e-300, 1e-20, 1.0, 1e20, 1e308};
    for (PlainEdge& edge : random.edges) edge.cost = sizes[maker.below(6)];
    Bench bench(random.vertices, random.edges);
    const std::vector<double> weights = bench.weights(random.f, random.l);
    if (weights.empty()) continue;
    if (!std::ranges::all_of(weights, [](double w) { return w >= 0 && w <= 1; }))
      FAIL("a weight is out of [0, 1]");
    REQUIRE(bench.optimizer->decompose(LoopCost::x) == Status::ok);
    std::vector<bool> seen(random.vertices, false);
    seen[random.f] = seen[random.l] = true;
    for (const auto& trail : bench.optimizer->trails()) {
      for (const auto& step : bench.optimizer->steps(trail)) seen[step.vertex] = true;
    }
    for (const auto& branch : bench.optimizer->branches()) seen[branch.vertex] = true;
    for (const Edge& edge : bench.graph->edges()) {
      if (seen[edge.from] != seen[edge.to]) FAIL("a connected vertex is left out");
    }
  }
}

// Takes half a second. LOA that searches anew for each of the 100,000 trails would take hours.
TEST_CASE("a drive of 200,000 scans with 100,000 loops is taken apart in one search") {
  GraphMaker maker(4);
  const RandomGraph random = maker.drive(200'000, 100'000);
  Bench bench(random.vertices, random.edges);
  REQUIRE(bench.optimizer->prepare(*bench.graph, random.f, random.l) == Status::ok);
  REQUIRE(bench.optimizer->decompose(LoopCost::rotation) == Status::ok);
  CHECK(bench.optimizer->trails().size() > 90'000);
  std::size_t vertices = 2 + bench.optimizer->branches().size();  // f and l
  for (const LoopOptimizer::Trail& trail : bench.optimizer->trails()) vertices += trail.step_count - 1;
  CHECK(vertices == random.vertices);
}

TEST_CASE("LOA's memory is what the plan says, at compile time") {
  constexpr PoseGraph::Capacity capacity{100, 120};
  static_assert(Bench::plan(capacity) > 0);
  alignas(Arena::alignment) static std::byte block[Bench::plan(capacity)];
  Arena arena(block);
  const PoseGraph graph(arena, capacity);
  LoopOptimizer optimizer(arena, capacity);
  CHECK_FALSE(arena.overflowed());
  CHECK(arena.used_bytes() == sizeof block);
  CHECK(optimizer.prepare(graph, 0, 1) == Status::no_such_vertex);
}

TEST_CASE("LOA in time", "[.benchmark]") {
  GraphMaker maker(5);
  struct Size {
    std::uint32_t scans, loops;
  };
  for (const Size size : {Size{924, 6}, Size{469, 8}, Size{469, 150}, Size{10000, 100}, Size{10000, 3000},
                          Size{100000, 1000}, Size{100000, 30000}}) {
    const RandomGraph random = maker.drive(size.scans, size.loops);
    Bench bench(random.vertices, random.edges);
    std::vector<double> weights(random.vertices);
    double best_prepare_us = 1e9;
    double best_run_us = 1e9;
    double best_all_us = 1e9;
    double best_decompose_us = 1e9;
    for (int repeat = 0; repeat < (size.scans < 5000 ? 2000 : 5); ++repeat) {
      const auto now = [] { return std::chrono::steady_clock::now(); };
      const auto us = [](auto duration) {
        return std::chrono::duration<double, std::micro>(duration).count();
      };
      const auto start = now();
      if (bench.optimizer->prepare(*bench.graph, random.f, random.l) != Status::ok) FAIL();
      const auto prepared = now();
      if (bench.optimizer->weights(LoopCost::x, weights) != Status::ok) FAIL();
      const auto ran = now();
      for (const LoopCost cost : {LoopCost::y, LoopCost::z, LoopCost::rotation}) {
        if (bench.optimizer->weights(cost, weights) != Status::ok) FAIL();
      }
      const auto all = now();
      if (bench.optimizer->decompose(LoopCost::rotation) != Status::ok) FAIL();
      best_decompose_us = std::min(best_decompose_us, us(now() - all));
      best_prepare_us = std::min(best_prepare_us, us(prepared - start));
      best_run_us = std::min(best_run_us, us(ran - prepared));
      best_all_us = std::min(best_all_us, us(all - start));
    }
    std::printf(
        "%6u scans %5u loops: prepare %9.2f us, one run %9.2f us, prepare and four runs %9.2f us, decompose "
        "%9.2f us\n",
        size.scans, size.loops, best_prepare_us, best_run_us, best_all_us, best_decompose_us);
  }
}
