// HOG-Man in one go and while the graph grows.
#include "experiments/back_ends/hogman.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <limits>

#include "offline/io/files/error.h"
#include "offline/optimize/graph/gauss_newton.h"
#include "offline/optimize/graph/graph_file.h"
#include "support/ring_graph.h"
#include "support/test_data.h"

using namespace alces;
using namespace alces::offline;
using namespace alces::test;
using Catch::Contains;

namespace {

// Small graphs are to have a hierarchy, too.
HogManSettings deep() {
  return {.top_vertices = 12};
}

bool same_pose_bits(const ConstraintVertex& a, const ConstraintVertex& b) {
  return a.map_from_body.translation_m == b.map_from_body.translation_m &&
         a.map_from_body.rotation.coeffs() == b.map_from_body.rotation.coeffs();
}

double optimum(ConstraintGraph graph) {
  return optimize_gauss_newton(graph).chi_squared;
}

// As a front end would: each vertex where odometry puts it from where the one before is now; an update after
// every loop. Returns the number of updates.
std::size_t grow(HogMan& hogman, const ConstraintGraph& graph) {
  std::size_t next = 0;
  std::size_t updates = 0;
  for (std::uint32_t i = 0; i < graph.vertices.size(); ++i) {
    ConstraintVertex vertex = graph.vertices[i];
    bool closes_loop = false;
    std::vector<Constraint> arriving;
    for (; next < graph.constraints.size() && graph.constraints[next].to == i; ++next)
      arriving.push_back(graph.constraints[next]);
    for (const Constraint& constraint : arriving) {
      if (constraint.from + 1 == i)
        vertex.map_from_body = hogman.graph().vertices[i - 1].map_from_body * constraint.from_from_to;
      else
        closes_loop = true;
    }
    hogman.add_vertex(vertex);
    for (const Constraint& constraint : arriving) hogman.add_constraint(constraint);
    if (!closes_loop) continue;
    hogman.update();
    ++updates;
  }
  return updates;
}

}  // namespace

TEST_CASE("HOG-Man in one go reaches the optimum, planar or not, from odometry or from noise") {
  const bool is_planar = GENERATE(true, false);
  const bool from_noise = GENERATE(true, false);
  RingGraph ring = ring_graph({.is_planar = is_planar, .seed = 5});
  const double best = optimum(ring.graph);
  if (from_noise) {
    sim::Random random(9);
    for (std::size_t i = 1; i < ring.graph.vertices.size(); ++i)
      ring.graph.vertices[i].map_from_body.translation_m.head<2>() +=
          Eigen::Vector2d(30 * random.normal(), 30 * random.normal());
  }
  const HogManResult result = optimize_hogman(ring.graph, deep());
  CAPTURE(is_planar, from_noise, result.chi_squared_before);
  REQUIRE(result.level_vertices.size() >= 3);
  CHECK(result.level_vertices.front() == 200);
  CHECK(result.level_vertices.back() <= 12);
  CHECK(result.chi_squared == chi_squared(ring.graph));
  CHECK(result.chi_squared == Approx(best).epsilon(1e-4));
}

TEST_CASE("HOG-Man over a growing graph is near the optimum after each loop, and reaches it when refined") {
  const bool is_planar = GENERATE(true, false);
  const RingGraph ring = ring_graph({.is_planar = is_planar, .seed = 6});
  HogMan hogman(is_planar, deep());
  CHECK(grow(hogman, ring.graph) >= 15);
  const double best = optimum(ring.graph);
  const double odometry = chi_squared(ring.graph);
  const double online = chi_squared(hogman.graph());
  CAPTURE(is_planar, best, odometry);
  CHECK(hogman.level_vertices().size() >= 3);
  CHECK(online >= 0.999 * best);
  CHECK(online < 2 * best);
  CHECK(hogman.refine() > 0);
  CHECK(chi_squared(hogman.graph()) == Approx(best).epsilon(1e-4));
  CHECK(mean_error_m(hogman.graph(), ring.truth) < 0.5 * mean_error_m(ring.graph, ring.truth));
}

TEST_CASE("an update of HOG-Man leaves alone what it does not move") {
  const RingGraph ring = ring_graph({.poses = 150, .poses_a_lap = 50, .loops = 1});
  HogMan hogman(false, deep());
  grow(hogman, ring.graph);
  hogman.update();  // what the last one has moved is now where it belongs
  const ConstraintGraph before = hogman.graph();
  // another measurement of a step, that says what is already so
  Constraint again = ring.graph.constraints[99];
  again.from_from_to =
      before.vertices[again.from].map_from_body.inverse() * before.vertices[again.to].map_from_body;
  hogman.add_constraint(again);
  hogman.update();
  std::size_t untouched = 0;
  for (std::size_t i = 0; i < before.vertices.size(); ++i) {
    if (same_pose_bits(before.vertices[i], hogman.graph().vertices[i])) ++untouched;
    CHECK((before.vertices[i].map_from_body.translation_m -
           hogman.graph().vertices[i].map_from_body.translation_m)
              .norm() < 0.05);
  }
  CHECK(untouched > 100);
  CHECK(untouched < 150);
}

TEST_CASE("HOG-Man of one level is Gauss-Newton") {
  RingGraph ring = ring_graph({});
  const double best = optimum(ring.graph);
  const HogManResult result = optimize_hogman(ring.graph, {.most_levels = 1});
  CHECK(result.level_vertices == std::vector<std::uint32_t>{200});
  CHECK(result.chi_squared == Approx(best).epsilon(1e-6));
}

TEST_CASE("HOG-Man keeps fixed vertices to the bit, or else the first") {
  const RingGraph ring = ring_graph({.poses = 80, .poses_a_lap = 20});
  ConstraintGraph none_fixed = ring.graph;
  optimize_hogman(none_fixed, deep());
  CHECK(same_pose_bits(none_fixed.vertices[0], ring.graph.vertices[0]));
  CHECK_FALSE(same_pose_bits(none_fixed.vertices[30], ring.graph.vertices[30]));
  CHECK_FALSE(none_fixed.vertices[0].is_fixed);

  ConstraintGraph two_fixed = ring.graph;
  for (const std::size_t i : {30U, 31U}) two_fixed.vertices[i].is_fixed = true;
  optimize_hogman(two_fixed, deep());
  for (const std::size_t i : {30U, 31U}) CHECK(same_pose_bits(two_fixed.vertices[i], ring.graph.vertices[i]));
  CHECK_FALSE(same_pose_bits(two_fixed.vertices[0], ring.graph.vertices[0]));
}

TEST_CASE("HOG-Man has nothing to put together where all vertices are fixed") {
  RingGraph ring = ring_graph({.poses = 40, .poses_a_lap = 10});
  for (ConstraintVertex& vertex : ring.graph.vertices) vertex.is_fixed = true;
  const ConstraintGraph before = ring.graph;
  const HogManResult result = optimize_hogman(ring.graph, deep());
  CHECK(result.level_vertices.size() == 1);
  CHECK(result.chi_squared == result.chi_squared_before);
  CHECK(same_pose_bits(ring.graph.vertices[20], before.vertices[20]));
}

TEST_CASE("HOG-Man gives the same bits again") {
  const RingGraph ring = ring_graph({});
  ConstraintGraph first = ring.graph;
  ConstraintGraph second = ring.graph;
  optimize_hogman(first, deep());
  optimize_hogman(second, deep());
  for (std::size_t i = 0; i < first.vertices.size(); ++i)
    REQUIRE(same_pose_bits(first.vertices[i], second.vertices[i]));
}

TEST_CASE("HOG-Man stops when it is told to, with the poses so far") {
  RingGraph ring = ring_graph({});
  HogManCallbacks callbacks;
  callbacks.stop_requested = [] { return true; };
  const HogManResult result = optimize_hogman(ring.graph, deep(), callbacks);
  CHECK(result.stopped);
  CHECK(result.iterations == 0);
  CHECK(std::isfinite(result.chi_squared));
}

TEST_CASE("HOG-Man refuses a graph that falls apart, and NaN, and changes nothing") {
  const RingGraph ring = ring_graph({.poses = 40, .poses_a_lap = 10});
  ConstraintGraph graph = ring.graph;
  SECTION("falls apart") {
    graph.vertices.push_back(graph.vertices.back());
    graph.vertices.back().id = 77;
    CHECK_THROWS_WITH(optimize_hogman(graph), Contains("falls into 2 parts") && Contains("77"));
  }
  SECTION("falls apart while it grows") {
    HogMan hogman(false, {});
    hogman.add_vertex(graph.vertices[0]);
    hogman.add_vertex(graph.vertices[1]);
    CHECK_THROWS_AS(hogman.update(), InputError);
    hogman.add_constraint(graph.constraints[0]);
    hogman.update();
    CHECK(chi_squared(hogman.graph()) < 1e-9);
  }
  SECTION("a measurement that is NaN") {
    graph.constraints[5].from_from_to.translation_m.x() = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_WITH(optimize_hogman(graph), Contains("NaN"));
  }
  SECTION("information that determines nothing") {
    for (Constraint& constraint : graph.constraints) constraint.information.setZero();
    CHECK_THROWS_WITH(optimize_hogman(graph, deep()), Contains("do not determine"));
  }
  SECTION("no level") {
    CHECK_THROWS_AS(optimize_hogman(graph, {.most_levels = 0}), UsageError);
  }
  for (std::size_t i = 0; i < ring.graph.vertices.size(); ++i)
    CHECK(same_pose_bits(ring.graph.vertices[i], graph.vertices[i]));
}

TEST_CASE("HOG-Man has nothing to do for no vertex and for one") {
  ConstraintGraph graph;
  CHECK(optimize_hogman(graph).iterations == 0);
  graph.vertices.emplace_back();
  CHECK(optimize_hogman(graph).chi_squared == 0);
  HogMan hogman(false, {});
  hogman.update();
  hogman.add_vertex({});
  hogman.update();
  CHECK(hogman.refine() == 0);
}

TEST_CASE("HOG-Man reaches the optimum of published graphs") {
  struct Published {
    const char* file;
    double optimum;
  };
  const auto [file, best] = GENERATE(Published{"intel.g2o", 45.0047}, Published{"MIT.g2o", 41.1633},
                                     Published{"input_M3500_g2o.g2o", 137.913});
  const std::string name = std::string("pose_graphs/") + file;
  if (!test::has_test_data(name)) return;
  ConstraintGraph graph = read_graph(test::test_data(name)).graph;
  CHECK(optimize_hogman(graph).chi_squared == Approx(best).epsilon(1e-3));
}
