#include "offline/optimize/graph/elch_on_graph.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <vector>

#include "offline/optimize/graph/gauss_newton.h"
#include "offline/optimize/graph/graph_file.h"
#include "support/sample_graph.h"
#include "support/test_data.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using alces::test::sample_graph;
using Catch::Contains;

namespace {

constexpr CorrectionRule rules[] = {CorrectionRule::trails, CorrectionRule::paper};

double mean_distance_m(const ConstraintGraph& graph, const std::vector<Pose>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    sum += (graph.vertices[i].map_from_body.translation_m - truth[i].translation_m).norm();
  return sum / static_cast<double>(truth.size());
}

}  // namespace

TEST_CASE("elch on a graph: one loop is closed exactly, in 3D and planar, forwards and backwards") {
  for (const bool is_planar : {false, true}) {
    for (const bool backwards : {false, true}) {
      for (const CorrectionRule rule : rules) {
        ConstraintGraph graph = sample_graph({.loops = 0, .is_planar = is_planar});
        Constraint loop = graph.constraints.back();
        loop.from = backwards ? 180 : 20;
        loop.to = backwards ? 20 : 180;
        Pose l_from_f = graph.vertices[loop.from].map_from_body.inverse() *
                        graph.vertices[loop.to].map_from_body * planar_pose(0.4, -0.3, 0.05);
        loop.from_from_to = l_from_f;
        graph.constraints.push_back(loop);
        const ElchResult result = close_loops_with_elch(graph, {.rule = rule});
        CAPTURE(is_planar, backwards, static_cast<int>(rule));
        CHECK(result.loops == 1);
        CHECK(chi_squared(graph, graph.constraints.back()) < 1e-9);
        CHECK(result.chi_squared == chi_squared(graph));
        CHECK(result.chi_squared < result.chi_squared_odometry);
        if (is_planar) CHECK(graph.vertices[100].map_from_body.translation_m.z() == 0);
      }
    }
  }
}

TEST_CASE("elch on a graph: a drive through a town comes closer to the truth, and never beats the optimum") {
  for (const bool is_planar : {false, true}) {
    std::vector<Pose> truth;
    ConstraintGraph graph = sample_graph(
        {.poses = 600, .loops = 20, .seed = 4, .is_planar = is_planar, .rotation_sigma_rad = 0.01}, &truth);
    const double odometry_m = mean_distance_m(graph, truth);
    ConstraintGraph best = graph;
    const double optimum = optimize_gauss_newton(best).chi_squared;
    const ElchResult result = close_loops_with_elch(graph);
    CAPTURE(is_planar, odometry_m, optimum, result.chi_squared, result.chi_squared_odometry);
    CHECK(result.loops + result.parallel + graph.vertices.size() - 1 == graph.constraints.size());
    CHECK(result.chi_squared >= optimum);
    CHECK(result.chi_squared < result.chi_squared_odometry / 10);
    CHECK(mean_distance_m(graph, truth) < odometry_m / 2);
  }
}

TEST_CASE("elch on a graph: wherever it lies and however it is turned, the same comes out, moved with it") {
  for (const bool is_planar : {false, true}) {
    for (const CorrectionRule rule : rules) {
      ConstraintGraph graph = sample_graph({.poses = 200, .loops = 12, .seed = 3, .is_planar = is_planar});
      for (Constraint& c : graph.constraints) {  // some edges are less sure ahead, others to the side
        c.information.row(c.to % 2) /= 5;
        c.information.col(c.to % 2) /= 5;
        c.planar_information.row(c.to % 2) /= 5;
        c.planar_information.col(c.to % 2) /= 5;
      }
      for (const double turn_rad : {std::acos(-1.0) / 2, 0.7}) {
        const Pose moved = planar_pose(300, -40, turn_rad);
        ConstraintGraph other = graph;
        for (ConstraintVertex& vertex : other.vertices) vertex.map_from_body = moved * vertex.map_from_body;
        ConstraintGraph expected = graph;
        CHECK(close_loops_with_elch(expected, {.rule = rule}).loops > 5);
        close_loops_with_elch(other, {.rule = rule});
        CAPTURE(is_planar, static_cast<int>(rule), turn_rad);
        for (std::size_t i = 0; i < graph.vertices.size(); ++i)
          REQUIRE(
              same_pose(other.vertices[i].map_from_body, moved * expected.vertices[i].map_from_body, 1e-5));
      }
    }
  }
}

TEST_CASE("elch on a graph: dense with loops, both rules stay bounded") {
  if (!test::has_test_data("pose_graphs/smallGrid3D.g2o")) return;
  for (const CorrectionRule rule : rules) {
    ConstraintGraph graph = read_graph(test::test_data("pose_graphs/smallGrid3D.g2o")).graph;
    const ElchResult result = close_loops_with_elch(graph, {.rule = rule});
    CHECK(result.loops == 173);
    CHECK(result.chi_squared < result.chi_squared_odometry / 5);
  }
}

TEST_CASE("elch on a graph: the poses of the file do not matter, nor do edges before their vertices' turn") {
  const ConstraintGraph graph = sample_graph({.loops = 8});
  ConstraintGraph expected = graph;
  close_loops_with_elch(expected);
  ConstraintGraph other = graph;
  for (std::size_t i = 1; i < other.vertices.size(); ++i) other.vertices[i].map_from_body = Pose{};
  std::reverse(other.constraints.begin(), other.constraints.end());
  close_loops_with_elch(other);
  for (std::size_t i = 0; i < graph.vertices.size(); ++i)
    REQUIRE(same_pose(other.vertices[i].map_from_body, expected.vertices[i].map_from_body, 1e-9));
}

TEST_CASE("elch on a graph: a vertex that only later ones are joined to waits for them") {
  ConstraintGraph graph;
  graph.vertices.resize(4);
  const auto join = [&](std::uint32_t from, std::uint32_t to) {
    Constraint c;
    c.from = from;
    c.to = to;
    c.from_from_to = planar_pose(1, 0, 0);
    graph.constraints.push_back(c);
  };
  join(1, 2);  // neither is placed when its turn comes
  join(0, 3);
  join(3, 2);
  const ElchResult result = close_loops_with_elch(graph);
  CHECK(result.loops == 0);
  CHECK(graph.vertices[3].map_from_body.translation_m.x() == Approx(1));
  CHECK(graph.vertices[2].map_from_body.translation_m.x() == Approx(2));
  CHECK(graph.vertices[1].map_from_body.translation_m.x() == Approx(1));
}

TEST_CASE("elch on a graph: a fixed vertex keeps its pose to the bit, edges beside others are counted") {
  ConstraintGraph graph = sample_graph({.loops = 8});
  graph.vertices[90].is_fixed = true;
  graph.constraints.push_back(graph.constraints[50]);
  const Pose before = graph.vertices[90].map_from_body;
  const ElchResult result = close_loops_with_elch(graph);
  CHECK(result.parallel == 1);
  CHECK(graph.vertices[90].map_from_body.translation_m == before.translation_m);
  graph.vertices[91].is_fixed = true;
  CHECK_THROWS_WITH(close_loops_with_elch(graph), Contains("the graph fixes 2"));
}

TEST_CASE("elch on a graph: a stop leaves every vertex placed and the loops so far closed") {
  const ConstraintGraph graph = sample_graph({.poses = 400, .loops = 20});
  ConstraintGraph stopped = graph;
  std::size_t seen = 0;
  const ElchResult result =
      close_loops_with_elch(stopped, {},
                            {.progress = [&](std::size_t done, std::size_t) { seen = done; },
                             .stop_requested = [&] { return seen > 300; }});
  CHECK(result.was_stopped);
  CHECK(result.loops < 20);
  CHECK(result.chi_squared == chi_squared(stopped));
  CHECK_THROWS_WITH(close_loops_with_elch([&]() -> ConstraintGraph& {
                      stopped.constraints.clear();
                      return stopped;
                    }()),
                    Contains("400 parts"));
}
