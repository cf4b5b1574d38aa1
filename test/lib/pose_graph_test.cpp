#include "alces/pose_graph.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace alces;

namespace {

constexpr PoseGraph::Capacity capacity{50, 80};

constexpr std::size_t plan() {
  Arena counting;
  const PoseGraph graph(counting, capacity);
  return counting.used_bytes();
}

alignas(Arena::alignment) std::byte block[plan()];

Edge edge_between(std::uint32_t from, std::uint32_t to) {
  Edge edge;
  edge.from = from;
  edge.to = to;
  return edge;
}

}  // namespace

TEST_CASE("a graph's memory is what the plan says, at compile time") {
  static_assert(plan() > 0);
  Arena arena(block);
  const PoseGraph graph(arena, capacity);
  CHECK(arena.used_bytes() == sizeof block);
  CHECK_FALSE(arena.overflowed());
  CHECK(graph.vertex_capacity() == capacity.vertices);
  CHECK(graph.edge_capacity() == capacity.edges);
  CHECK(graph.vertex_count() == 0);
  CHECK(graph.edge_count() == 0);
}

TEST_CASE("every half-edge is found from its vertex, leads to the other one, and h ^ 1 leads back") {
  Arena arena(block);
  PoseGraph graph(arena, capacity);
  for (std::uint32_t v = 0; v < capacity.vertices; ++v) REQUIRE(graph.add_vertex(Pose{}) == Status::ok);
  std::mt19937 random(1);
  std::vector<std::vector<std::uint32_t>> leaving(capacity.vertices);
  while (graph.edge_count() < capacity.edges) {
    const auto from = static_cast<std::uint32_t>(random() % capacity.vertices);
    const auto to = static_cast<std::uint32_t>(random() % capacity.vertices);
    if (from == to) continue;
    leaving[from].push_back(2 * graph.edge_count());
    leaving[to].push_back(2 * graph.edge_count() + 1);
    REQUIRE(graph.add_edge(edge_between(from, to)) == Status::ok);
  }
  for (std::uint32_t v = 0; v < capacity.vertices; ++v) {
    std::vector<std::uint32_t> found;
    for (std::uint32_t h = graph.first_half_edge(v); h != no_index; h = graph.next_half_edge(h)) {
      found.push_back(h);
      CHECK(graph.target(h ^ 1) == v);
      CHECK(graph.target(h) == ((h & 1) == 0 ? graph.edges()[h / 2].to : graph.edges()[h / 2].from));
    }
    CHECK(found.size() == graph.degree(v));
    std::ranges::sort(found);
    CHECK(found == leaving[v]);
  }
}

TEST_CASE("a full graph refuses what does not fit and stays whole") {
  Arena arena(block);
  PoseGraph graph(arena, {2, 2});
  CHECK(graph.add_vertex(Pose{}) == Status::ok);
  CHECK(graph.add_vertex(Pose{}) == Status::ok);
  CHECK(graph.add_vertex(Pose{}) == Status::no_scan_capacity);
  CHECK(graph.vertex_count() == 2);
  CHECK(graph.add_edge(edge_between(0, 1)) == Status::ok);
  CHECK(graph.add_edge(edge_between(1, 0)) == Status::ok);
  CHECK(graph.add_edge(edge_between(0, 1)) == Status::no_edge_capacity);
  CHECK(graph.edge_count() == 2);
  CHECK(graph.degree(0) == 2);
  CHECK(graph.degree(1) == 2);
}

TEST_CASE("a graph takes no vertex or edge that would spoil the map") {
  Arena arena(block);
  PoseGraph graph(arena, capacity);
  Pose nowhere;
  nowhere.translation_m.x() = std::nan("");
  CHECK(graph.add_vertex(nowhere) == Status::bad_pose);
  REQUIRE(graph.add_vertex(Pose{}) == Status::ok);
  REQUIRE(graph.add_vertex(Pose{}) == Status::ok);

  CHECK(graph.add_edge(edge_between(0, 2)) == Status::no_such_vertex);
  CHECK(graph.add_edge(edge_between(2, 0)) == Status::no_such_vertex);
  CHECK(graph.add_edge(edge_between(1, 1)) == Status::bad_edge);
  for (const double variance : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    for (double EdgeVariance::*part :
         {&EdgeVariance::x_m2, &EdgeVariance::y_m2, &EdgeVariance::z_m2, &EdgeVariance::rotation_rad2}) {
      Edge edge = edge_between(0, 1);
      edge.variance.*part = variance;
      CHECK(graph.add_edge(edge) == Status::bad_edge);
    }
  }
  Edge edge = edge_between(0, 1);
  edge.from_from_to = nowhere;
  CHECK(graph.add_edge(edge) == Status::bad_pose);
  CHECK(graph.edge_count() == 0);
  CHECK(graph.degree(0) == 0);
  CHECK(graph.first_half_edge(0) == no_index);
}

TEST_CASE("an edge can be asked for beforehand: the answer is that of adding it, and nothing is added") {
  Arena arena(block);
  PoseGraph graph(arena, {2, 1});
  REQUIRE(graph.add_vertex(Pose{}) == Status::ok);
  REQUIRE(graph.add_vertex(Pose{}) == Status::ok);
  Edge no_variance = edge_between(0, 1);
  no_variance.variance.rotation_rad2 = 0;
  Edge nowhere = edge_between(0, 1);
  nowhere.from_from_to.translation_m.y() = std::nan("");
  const auto check = [&](const Edge& edge, Status expected) {
    const std::uint32_t edges = graph.edge_count();
    const std::uint32_t first = graph.first_half_edge(0);
    CHECK(graph.check_edge(edge) == expected);
    CHECK(graph.edge_count() == edges);
    CHECK(graph.degree(0) == edges);
    CHECK(graph.first_half_edge(0) == first);
    CHECK(graph.add_edge(edge) == expected);
  };
  check(edge_between(0, 2), Status::no_such_vertex);
  check(edge_between(1, 1), Status::bad_edge);
  check(no_variance, Status::bad_edge);
  check(nowhere, Status::bad_pose);
  check(edge_between(0, 1), Status::ok);
  check(edge_between(0, 1), Status::no_edge_capacity);
  check(nowhere, Status::bad_pose);
}

TEST_CASE("poses are written through the graph's span") {
  Arena arena(block);
  PoseGraph graph(arena, capacity);
  REQUIRE(graph.add_vertex(Pose{}) == Status::ok);
  graph.poses()[0].translation_m.x() = 3;
  const PoseGraph& same = graph;
  CHECK(same.poses().size() == 1);
  CHECK(same.poses()[0].translation_m.x() == 3);
}
