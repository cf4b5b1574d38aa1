// TORO on graphs whose truth is known, on those that are none, and beside the optimum on published ones.
#include "experiments/back_ends/toro.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <limits>

#include "offline/io/files/error.h"
#include "offline/optimize/graph/graph_file.h"
#include "support/ring_graph.h"
#include "support/test_data.h"

using namespace alces;
using namespace alces::offline;
using namespace alces::test;
using Catch::Contains;

namespace {

bool same_bits(const ConstraintGraph& a, const ConstraintGraph& b) {
  for (std::size_t i = 0; i < a.vertices.size(); ++i) {
    const Pose& pose = a.vertices[i].map_from_body;
    const Pose& other = b.vertices[i].map_from_body;
    if (pose.translation_m != other.translation_m || pose.rotation.coeffs() != other.rotation.coeffs())
      return false;
  }
  return true;
}

bool all_valid(const ConstraintGraph& graph) {
  return std::all_of(graph.vertices.begin(), graph.vertices.end(),
                     [](const ConstraintVertex& vertex) { return is_valid(vertex.map_from_body); });
}

// Of what the measurements leave open: about dimension * (constraints - vertices) at the optimum.
double expected_chi_squared(const ConstraintGraph& graph) {
  const double dimension = graph.is_planar ? 3 : 6;
  return dimension * static_cast<double>(graph.constraints.size() + 1 - graph.vertices.size());
}

}  // namespace

TEST_CASE("TORO brings a drive of four laps from odometry near to the truth, planar or not") {
  const bool is_planar = GENERATE(true, false);
  RingGraph ring = ring_graph({.is_planar = is_planar, .seed = 3});
  const double before_m = mean_error_m(ring.graph, ring.truth);
  const ToroResult result = optimize_toro(ring.graph);
  CAPTURE(is_planar, before_m, result.chi_squared_before, result.chi_squared);
  CHECK(result.iterations == 100);
  CHECK_FALSE(result.stopped);
  CHECK(result.chi_squared == chi_squared(ring.graph));
  CHECK(result.chi_squared < 1e-2 * result.chi_squared_before);
  CHECK(result.chi_squared < 3 * expected_chi_squared(ring.graph));
  CHECK(mean_error_m(ring.graph, ring.truth) < 0.4 * before_m);
}

TEST_CASE("TORO finds the poses of measurements without noise, from a first guess that is noise alone") {
  RingGraph ring =
      ring_graph({.poses = 60, .poses_a_lap = 20, .translation_sigma_m = 1e-9, .rotation_sigma_rad = 1e-9});
  for (Constraint& constraint : ring.graph.constraints) constraint.information.setIdentity();
  sim::Random random(7);
  for (std::size_t i = 1; i < ring.graph.vertices.size(); ++i) {
    Pose& pose = ring.graph.vertices[i].map_from_body;
    pose.translation_m = {10 * random.normal(), 10 * random.normal(), 10 * random.normal()};
    pose.rotation = exp_so3({2 * random.normal(), 2 * random.normal(), 2 * random.normal()});
  }
  optimize_toro(ring.graph, {.iterations = 300});
  CHECK(mean_error_m(ring.graph, ring.truth) < 1e-3);
}

TEST_CASE("TORO leaves a planar graph planar") {
  RingGraph ring = ring_graph({.poses = 80, .poses_a_lap = 20, .is_planar = true});
  optimize_toro(ring.graph);
  for (const ConstraintVertex& vertex : ring.graph.vertices) {
    REQUIRE(vertex.map_from_body.translation_m.z() == 0);
    REQUIRE(vertex.map_from_body.rotation.x() == 0);
    REQUIRE(vertex.map_from_body.rotation.y() == 0);
  }
}

TEST_CASE("TORO keeps fixed vertices to the bit, or else the first") {
  RingGraph ring = ring_graph({.poses = 80, .poses_a_lap = 20});
  ConstraintGraph none_fixed = ring.graph;
  optimize_toro(none_fixed);
  CHECK(none_fixed.vertices[0].map_from_body.translation_m ==
        ring.graph.vertices[0].map_from_body.translation_m);
  CHECK(none_fixed.vertices[30].map_from_body.translation_m !=
        ring.graph.vertices[30].map_from_body.translation_m);

  ConstraintGraph two_fixed = ring.graph;
  for (const std::size_t i : {30U, 31U}) two_fixed.vertices[i].is_fixed = true;
  optimize_toro(two_fixed);
  for (const std::size_t i : {30U, 31U}) {
    CHECK(two_fixed.vertices[i].map_from_body.translation_m ==
          ring.graph.vertices[i].map_from_body.translation_m);
    CHECK(two_fixed.vertices[i].map_from_body.rotation.coeffs() ==
          ring.graph.vertices[i].map_from_body.rotation.coeffs());
  }
  CHECK(two_fixed.vertices[0].map_from_body.translation_m !=
        ring.graph.vertices[0].map_from_body.translation_m);
}

TEST_CASE("TORO gives the same bits again") {
  const RingGraph ring = ring_graph({});
  ConstraintGraph first = ring.graph;
  ConstraintGraph second = ring.graph;
  optimize_toro(first);
  optimize_toro(second);
  CHECK(same_bits(first, second));
}

TEST_CASE("TORO takes a constraint either way round") {
  const RingGraph ring = ring_graph({.poses = 100, .poses_a_lap = 25});
  ConstraintGraph forward = ring.graph;
  ConstraintGraph backward = ring.graph;
  for (Constraint& constraint : backward.constraints) {
    std::swap(constraint.from, constraint.to);
    constraint.from_from_to = constraint.from_from_to.inverse();
  }
  optimize_toro(forward);
  optimize_toro(backward);
  for (std::size_t i = 0; i < forward.vertices.size(); ++i)
    CHECK((forward.vertices[i].map_from_body.translation_m - backward.vertices[i].map_from_body.translation_m)
              .norm() < 0.05);
}

TEST_CASE("TORO stops when it is told to, between two iterations, with the poses so far") {
  RingGraph ring = ring_graph({});
  std::uint32_t done = 0;
  ToroCallbacks callbacks;
  callbacks.progress = [&done](std::uint32_t iterations, std::uint32_t) { done = iterations; };
  callbacks.stop_requested = [&done] { return done == 20; };
  const ToroResult result = optimize_toro(ring.graph, {}, callbacks);
  CHECK(result.stopped);
  CHECK(result.iterations == 20);
  CHECK(result.chi_squared < result.chi_squared_before);
  CHECK(all_valid(ring.graph));
}

TEST_CASE(
    "TORO refuses a graph that falls apart, NaN, and constraints without information, and changes nothing") {
  const RingGraph ring = ring_graph({.poses = 40, .poses_a_lap = 10});
  ConstraintGraph graph = ring.graph;
  SECTION("falls apart") {
    graph.vertices.push_back(graph.vertices.back());
    graph.vertices.back().id = 77;
    CHECK_THROWS_WITH(optimize_toro(graph), Contains("falls into 2 parts") && Contains("77"));
  }
  SECTION("a pose that is NaN") {
    graph.vertices[5].map_from_body.translation_m.x() = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_WITH(optimize_toro(graph), Contains("NaN"));
    graph.vertices[5] = ring.graph.vertices[5];
  }
  SECTION("a measurement at 1e200") {
    graph.constraints[5].from_from_to.translation_m.x() = 1e200;
    CHECK_THROWS_WITH(optimize_toro(graph), Contains("too large"));
  }
  SECTION("information that is zero") {
    graph.constraints[5].information.setZero();
    CHECK_THROWS_WITH(optimize_toro(graph),
                      Contains("from vertex 5 to 6") && Contains("no positive information"));
  }
  SECTION("a rate that is none") {
    CHECK_THROWS_AS(optimize_toro(graph, {.last_rate = 0}), UsageError);
  }
  CHECK(same_bits(ring.graph, graph));
}

TEST_CASE("TORO has nothing to do for no vertex, one vertex, or no iteration") {
  ConstraintGraph graph;
  CHECK(optimize_toro(graph).iterations == 0);
  graph.vertices.emplace_back();
  CHECK(optimize_toro(graph).chi_squared == 0);
  RingGraph ring = ring_graph({.poses = 40, .poses_a_lap = 10});
  const ConstraintGraph before = ring.graph;
  CHECK(optimize_toro(ring.graph, {.iterations = 0}).chi_squared == chi_squared(before));
  CHECK(same_bits(before, ring.graph));
}

TEST_CASE("TORO stays finite where information differs by 24 orders of magnitude and half turns contradict") {
  RingGraph ring = ring_graph({.poses = 60, .poses_a_lap = 20});
  sim::Random random(2);
  for (Constraint& constraint : ring.graph.constraints) {
    constraint.information *= std::pow(10.0, random.integer(-12, 12));
    if (random.chance(0.2)) constraint.from_from_to.rotation = Eigen::Quaterniond(0, 0, 0, 1);
  }
  const ToroResult result = optimize_toro(ring.graph);
  CHECK(std::isfinite(result.chi_squared));
  CHECK(all_valid(ring.graph));
}

// The optimum of each is Gauss-Newton's (docs/back-ends.md). TORO takes covariances as spheres and does not
// let positions correct rotations, so that it ends above it.
TEST_CASE("TORO comes near the optimum of published graphs") {
  struct Published {
    const char* file;
    double optimum;
    double at_most;  // times the optimum
  };
  const auto [file, optimum, at_most] =
      GENERATE(Published{"intel.g2o", 45.0, 1.1}, Published{"MIT.g2o", 41.2, 1.6},
               Published{"input_M3500_g2o.g2o", 137.9, 1.4}, Published{"parking-garage.g2o", 1.24, 1.2});
  const std::string name = std::string("pose_graphs/") + file;
  if (!test::has_test_data(name)) return;
  ConstraintGraph graph = read_graph(test::test_data(name)).graph;
  const ToroResult result = optimize_toro(graph);
  CAPTURE(file, result.chi_squared_before);
  CHECK(result.chi_squared < at_most * optimum);
  CHECK(result.chi_squared > 0.99 * optimum);
}
