#include "alces/loop_correction.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "support/in_block.h"
#include "support/plain_scene.h"
#include "support/plain_sharing.h"

using namespace alces;
using namespace alces::test;
using alces::sim::Random;

namespace {

constexpr PoseGraph::Capacity capacity{64, 96};
constexpr CorrectionRule rules[] = {CorrectionRule::trails, CorrectionRule::paper};

bool is_same(const Pose& a, const Pose& b) {
  return a.translation_m == b.translation_m && a.rotation.coeffs() == b.rotation.coeffs();
}

Pose random_pose(Random& random, double reach_m, double most_rad) {
  Pose pose;
  pose.translation_m = {random.uniform(-reach_m, reach_m), random.uniform(-reach_m, reach_m),
                        random.uniform(-reach_m, reach_m)};
  pose.rotation = exp_so3({random.uniform(-most_rad, most_rad), random.uniform(-most_rad, most_rad),
                           random.uniform(-most_rad, most_rad)});
  return pose;
}

void join(PoseGraph& graph, std::uint32_t from, std::uint32_t to, Random& random) {
  Edge edge;
  edge.from = from;
  edge.to = to;
  edge.from_from_to = graph.poses()[from].inverse() * graph.poses()[to];
  edge.variance = {random.uniform(1e-4, 1e-3), random.uniform(1e-4, 1e-3), random.uniform(1e-4, 1e-3),
                   random.uniform(1e-5, 1e-4)};
  REQUIRE(graph.add_edge(edge) == Status::ok);
}

// A drive once around a circle of `count` vertices, ways 2 m long; scan 0 lies anywhere.
void add_ring(PoseGraph& graph, std::uint32_t count, Random& random) {
  const double radius_m = 2 * count / (2 * std::numbers::pi);
  const Pose start = random_pose(random, 5, 1);
  const std::uint32_t first = graph.vertex_count();
  for (std::uint32_t i = 0; i < count; ++i) {
    const double way = 360.0 * i / count;
    const Pose ring =
        pose_at(radius_m * std::cos(way / 57.29578), radius_m * std::sin(way / 57.29578), 0.05 * i, way + 90);
    REQUIRE(graph.add_vertex(start * ring) == Status::ok);
    if (i > 0) join(graph, first + i - 1, first + i, random);
  }
}

struct Bench {
  InBlock<PoseGraph> graph{capacity};
  InBlock<LoopCorrection> correction{capacity};

  [[nodiscard]] std::vector<Pose> poses() const { return {graph->poses().begin(), graph->poses().end()}; }
  Status share(std::uint32_t f, std::uint32_t l, const Pose& map_from_l, CorrectionRule rule) {
    const Status status = correction->prepare(*graph, f, l);
    return status == Status::ok ? correction->share(*graph, map_from_l, rule) : status;
  }
};

void check_closed(const Bench& bench, const std::vector<Pose>& before, std::uint32_t f, std::uint32_t l,
                  const Pose& map_from_l) {
  const auto after = bench.graph->poses();
  CHECK(is_same(after[0], before[0]));
  const Pose matched = before[f].inverse() * map_from_l;
  const Pose closed = after[f].inverse() * after[l];
  CHECK(distance_m(closed, matched) < 1e-9);
  CHECK(distance_rad(closed, matched) < 1e-9);
  for (const Pose& pose : after) CHECK(is_valid(pose));
}

}  // namespace

TEST_CASE("after a loop scan 0 is where it was to the bit, and l lies where the match put it, seen from f") {
  for (const CorrectionRule rule : rules) {
    Random random(1);
    for (int round = 0; round < 20; ++round) {
      Bench bench;
      add_ring(*bench.graph, 40, random);
      const std::uint32_t f = round % 2 == 0 ? 0 : 3 + static_cast<std::uint32_t>(round);
      const std::uint32_t l = 39 - static_cast<std::uint32_t>(round) / 4;
      const std::vector<Pose> before = bench.poses();
      const Pose map_from_l = random_pose(random, 1, 0.05) * before[l];
      CAPTURE(static_cast<int>(rule), f, l);
      REQUIRE(bench.share(f, l, map_from_l, rule) == Status::ok);
      check_closed(bench, before, f, l, map_from_l);
    }
  }
}

TEST_CASE("a match that moves nothing bends nothing") {
  for (const CorrectionRule rule : rules) {
    Random random(2);
    Bench bench;
    add_ring(*bench.graph, 30, random);
    const std::vector<Pose> before = bench.poses();
    REQUIRE(bench.share(2, 28, before[28], rule) == Status::ok);
    for (std::uint32_t i = 0; i < 30; ++i) {
      CHECK(distance_m(bench.graph->poses()[i], before[i]) < 1e-9);
      CHECK(distance_rad(bench.graph->poses()[i], before[i]) < 1e-9);
    }
  }
}

TEST_CASE("branches follow the loop rigidly, and what is not connected stays") {
  for (const CorrectionRule rule : rules) {
    Random random(3);
    Bench bench;
    PoseGraph& graph = *bench.graph;
    add_ring(graph, 20, random);
    // 20, 21, 22 hang on 10; 23, 24, 25 are a cycle that hangs on 5
    const auto hang = [&](std::uint32_t on) {
      const std::uint32_t vertex = graph.vertex_count();
      REQUIRE(graph.add_vertex(graph.poses()[on] * random_pose(random, 2, 0.5)) == Status::ok);
      join(graph, on, vertex, random);
      return vertex;
    };
    hang(hang(hang(10)));
    hang(hang(hang(5)));
    join(graph, 25, 23, random);
    add_ring(graph, 10, random);  // 26..35: another drive
    const std::vector<Pose> before = bench.poses();
    const Pose map_from_l = random_pose(random, 0.5, 0.05) * before[19];
    REQUIRE(bench.share(1, 19, map_from_l, rule) == Status::ok);
    check_closed(bench, before, 1, 19, map_from_l);
    const auto after = graph.poses();
    const auto check_rigid = [&](std::uint32_t root, std::uint32_t vertex) {
      const Pose was = before[root].inverse() * before[vertex];
      const Pose is = after[root].inverse() * after[vertex];
      CAPTURE(static_cast<int>(rule), root, vertex);
      CHECK(distance_m(was, is) < 1e-9);
      CHECK(distance_rad(was, is) < 1e-9);
    };
    for (const std::uint32_t v : {20U, 21U, 22U}) check_rigid(10, v);
    for (const std::uint32_t v : {23U, 24U, 25U}) check_rigid(5, v);
    check_rigid(1, 0);  // before the loop
    for (std::uint32_t v = 26; v < 36; ++v) {
      CAPTURE(static_cast<int>(rule), v);
      CHECK(distance_m(after[v], before[v]) < 1e-9);
      CHECK(distance_rad(after[v], before[v]) < 1e-9);
    }
  }
}

TEST_CASE("the paper's rule is the paper's, matrix for matrix") {
  Random random(4);
  for (int round = 0; round < 30; ++round) {
    Bench bench;
    PoseGraph& graph = *bench.graph;
    add_ring(graph, 30, random);
    if (round % 3 == 1) join(graph, 4, 17, random);  // a loop within
    if (round % 3 == 2) {
      join(graph, 8, 25, random);
      join(graph, 12, 20, random);
    }
    const std::uint32_t f = round % 2 == 0 ? 0 : 6;
    const double turn_rad = round < 24 ? 0.1 : 0.9;
    const Pose map_from_l = random_pose(random, 2, turn_rad) * graph.poses()[29];
    const std::vector<Eigen::Matrix4d> expected = plain_share(graph, f, 29, map_from_l.matrix());
    REQUIRE(bench.share(f, 29, map_from_l, CorrectionRule::paper) == Status::ok);
    for (std::uint32_t i = 0; i < 30; ++i) {
      CAPTURE(round, i);
      CHECK((graph.poses()[i].matrix() - expected[i]).cwiseAbs().maxCoeff() < 1e-9);
    }
  }
}

TEST_CASE("along a simple loop the error goes where it most likely arose") {
  Random random(5);
  for (int round = 0; round < 5; ++round) {
    Bench bench;
    PoseGraph& graph = *bench.graph;
    add_ring(graph, 20, random);
    PlainChain chain;
    const std::vector<Pose> before = bench.poses();
    chain.places = before;
    for (const Edge& edge : graph.edges()) chain.variances.push_back(edge.variance);
    const Pose goal = [&] {
      Pose moved = before[19];
      moved.translation_m += 0.02 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      moved.rotation = exp_so3(0.002 * Eigen::Vector3d(random.normal(), random.normal(), random.normal())) *
                       moved.rotation;
      return moved;
    }();
    const std::vector<Pose> expected = chain.bend(chain.most_likely(goal));
    REQUIRE(distance_m(expected.back(), goal) < 1e-8);
    REQUIRE(bench.share(0, 19, goal, CorrectionRule::trails) == Status::ok);
    for (std::uint32_t i = 0; i < 20; ++i) {
      CAPTURE(round, i);
      CHECK(distance_m(graph.poses()[i], expected[i]) < 1e-4);
      CHECK(distance_rad(graph.poses()[i], expected[i]) < 2e-5);
    }
  }
}

TEST_CASE("wherever the map lies and however it is turned, each rule gives the same map, moved with it") {
  for (const CorrectionRule rule : rules) {
    Random random(12);
    for (int round = 0; round < 20; ++round) {
      Bench bench;
      add_ring(*bench.graph, 40, random);
      join(*bench.graph, 4, 17, random);
      join(*bench.graph, 35, 22, random);  // against the drive
      const std::uint32_t f = round % 2 == 0 ? 0 : 3;
      const Pose map_from_l = random_pose(random, 1, 0.05) * bench.poses()[39];
      const Pose quarter_turn = pose_at(0, 0, 0, 90);
      const Pose moved = round < 4 ? quarter_turn : random_pose(random, 100, 3);
      Bench other;
      for (const Pose& pose : bench.poses()) REQUIRE(other.graph->add_vertex(moved * pose) == Status::ok);
      for (const Edge& edge : bench.graph->edges()) REQUIRE(other.graph->add_edge(edge) == Status::ok);
      CAPTURE(static_cast<int>(rule), round);
      const EdgeVariance match{4e-3, 1e-3, 1e-4, 3e-5};
      REQUIRE(bench.correction->prepare(*bench.graph, f, 39) == Status::ok);
      REQUIRE(other.correction->prepare(*other.graph, f, 39) == Status::ok);
      CHECK(other.correction->mahalanobis2(*other.graph, moved * map_from_l, match) ==
            Approx(bench.correction->mahalanobis2(*bench.graph, map_from_l, match)).epsilon(1e-6));
      REQUIRE(bench.share(f, 39, map_from_l, rule) == Status::ok);
      REQUIRE(other.share(f, 39, moved * map_from_l, rule) == Status::ok);
      for (std::uint32_t i = 0; i < 40; ++i) {
        CHECK(distance_m(moved * bench.poses()[i], other.poses()[i]) < 1e-6);
        CHECK(distance_rad(moved * bench.poses()[i], other.poses()[i]) < 1e-6);
      }
    }
  }
}

TEST_CASE("an edge that is much less sure than the others takes the error") {
  Bench bench;
  PoseGraph& graph = *bench.graph;
  for (std::uint32_t i = 0; i < 10; ++i) {
    REQUIRE(graph.add_vertex(pose_at(2.0 * i, 0, 0, 0)) == Status::ok);
    if (i == 0) continue;
    Edge edge;
    edge.from = i - 1;
    edge.to = i;
    const double v = i == 5 ? 1.0 : 1e-9;
    edge.variance = {v, v, v, 1e-12};
    REQUIRE(graph.add_edge(edge) == Status::ok);
  }
  const std::vector<Pose> before = bench.poses();
  Pose goal = before[9];
  goal.translation_m += Eigen::Vector3d(0.3, -0.2, 0.1);
  REQUIRE(bench.share(0, 9, goal, CorrectionRule::trails) == Status::ok);
  for (std::uint32_t i = 0; i < 10; ++i) {
    const Eigen::Vector3d moved = graph.poses()[i].translation_m - before[i].translation_m;
    const Eigen::Vector3d expected = i < 5 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(0.3, -0.2, 0.1);
    CHECK((moved - expected).norm() < 1e-4);
  }
}

TEST_CASE(
    "a trail that would swing its poses out further than the offset is shared out by the paper's rule") {
  std::vector<Pose> shared[2];
  double most_rad[2] = {};
  for (const double step_m : {0.2, 20.0}) {  // the same offset, along two metres or along two hundred
    for (const CorrectionRule rule : rules) {
      Bench bench;
      PoseGraph& graph = *bench.graph;
      for (std::uint32_t i = 0; i < 10; ++i) {
        REQUIRE(graph.add_vertex(pose_at(step_m * i, 0, 0, 0)) == Status::ok);
        Edge edge;
        edge.from = i - 1;
        edge.to = i;
        edge.variance = {1e-8, 1e-8, 1e-8, 1e-4};
        if (i > 0) REQUIRE(graph.add_edge(edge) == Status::ok);
      }
      const std::vector<Pose> before = bench.poses();
      Pose goal = before[9];
      goal.translation_m.y() += 0.5;
      REQUIRE(bench.share(0, 9, goal, rule) == Status::ok);
      check_closed(bench, before, 0, 9, goal);
      const auto number = static_cast<std::size_t>(rule);
      shared[number] = bench.poses();
      most_rad[number] = 0;
      for (const Pose& pose : shared[number])
        most_rad[number] = std::max(most_rad[number], log_so3(pose.rotation).norm());
    }
    const bool is_same_all = std::equal(shared[0].begin(), shared[0].end(), shared[1].begin(), is_same);
    CAPTURE(step_m, most_rad[0]);
    CHECK(is_same_all == (step_m < 1));
    CHECK(most_rad[0] <= 0.5 * std::numbers::pi / 180);
    CHECK((most_rad[0] > 1e-3) == (step_m > 1));  // turns where there is way enough
  }
}

TEST_CASE("nested and repeated loops are closed one after the other") {
  for (const CorrectionRule rule : rules) {
    Random random(7);
    Bench bench;
    PoseGraph& graph = *bench.graph;
    add_ring(graph, 50, random);
    for (const auto& [f, l] : std::vector<std::pair<std::uint32_t, std::uint32_t>>{
             {5, 30}, {10, 25}, {0, 49}, {5, 30}, {2, 48}, {12, 40}, {29, 30}, {0, 1}, {20, 45}}) {
      const std::vector<Pose> before = bench.poses();
      const Pose map_from_l = random_pose(random, 0.1, 0.01) * before[l];
      CAPTURE(static_cast<int>(rule), f, l);
      REQUIRE(bench.share(f, l, map_from_l, rule) == Status::ok);
      check_closed(bench, before, f, l, map_from_l);
      join(graph, f, l, random);
    }
  }
}

TEST_CASE("rotations of a quarter turn and more are shared out") {
  for (const CorrectionRule rule : rules) {
    for (const double turn_rad : {0.5, 1.0, std::numbers::pi / 2, 2.5}) {
      for (const std::uint32_t f : {0U, 7U}) {
        Random random(8);
        Bench bench;
        add_ring(*bench.graph, 40, random);
        const std::vector<Pose> before = bench.poses();
        Pose map_from_l = before[39];
        map_from_l.rotation =
            exp_so3(turn_rad * Eigen::Vector3d(0.2, 0.1, 1).normalized()) * map_from_l.rotation;
        map_from_l.translation_m += Eigen::Vector3d(3, -2, 1);
        CAPTURE(static_cast<int>(rule), turn_rad, f);
        REQUIRE(bench.share(f, 39, map_from_l, rule) == Status::ok);
        check_closed(bench, before, f, 39, map_from_l);
        // nothing breaks: no edge takes more than its fair part
        if (rule == CorrectionRule::trails) {
          for (std::uint32_t i = f + 1; i < 40; ++i) {
            const Pose was = before[i - 1].inverse() * before[i];
            const Pose is = bench.graph->poses()[i - 1].inverse() * bench.graph->poses()[i];
            CHECK(distance_rad(was, is) < 0.5 * turn_rad);
            CHECK(distance_m(was, is) < 1.5);
          }
        }
      }
    }
  }
}

TEST_CASE(
    "the correction's Mahalanobis length is that of the covariance carried along the chain and of the "
    "match") {
  Random random(9);
  for (int round = 0; round < 10; ++round) {
    Bench bench;
    PoseGraph& graph = *bench.graph;
    add_ring(graph, 30, random);
    const std::uint32_t f = round % 2 == 0 ? 0 : 4;
    const std::uint32_t l = 29 - static_cast<std::uint32_t>(round % 3);
    PlainChain chain;
    for (std::uint32_t i = f; i <= l; ++i) chain.places.push_back(graph.poses()[i]);
    for (std::uint32_t i = f; i < l; ++i) chain.variances.push_back(graph.edges()[i].variance);
    Pose goal = graph.poses()[l];
    goal.translation_m += 0.1 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    goal.rotation =
        exp_so3(0.02 * Eigen::Vector3d(random.normal(), random.normal(), random.normal())) * goal.rotation;
    REQUIRE(bench.correction->prepare(graph, f, l) == Status::ok);
    CAPTURE(round, f, l);
    const Matrix6d covariance = chain.covariance();
    CHECK((bench.correction->covariance(graph) - covariance).norm() < 1e-5 * covariance.norm());
    const EdgeVariance exact{0, 0, 0, 0};
    const EdgeVariance unsure{4e-2, 1e-2, 1e-3, 3e-4};
    for (const EdgeVariance& match : {exact, unsure}) {
      const double squared = bench.correction->mahalanobis2(graph, goal, match);
      CHECK(squared == Approx(chain.mahalanobis2(goal, match)).epsilon(1e-5));
      CHECK(bench.correction->mahalanobis2(graph, graph.poses()[l], match) == Approx(0).margin(1e-12));
    }
    CHECK(bench.correction->mahalanobis2(graph, goal, unsure) <
          bench.correction->mahalanobis2(graph, goal, exact));
  }
}

TEST_CASE("where a chain's covariance leaves a direction without any, no correction is plausible") {
  struct Extreme {
    EdgeVariance variance;
    bool is_definite;
  };
  for (const Extreme& extreme :
       {Extreme{{1e-300, 1e-300, 1e-300, 1e-3}, false}, Extreme{{1e-300, 1e-300, 1e-300, 1e300}, false},
        Extreme{{5e-324, 5e-324, 5e-324, 1e-12}, false}, Extreme{{1e-300, 1e-300, 1e-300, 1e-300}, true},
        Extreme{{1e-4, 1e-4, 1e-4, 1e-6}, true}, Extreme{{1e300, 1e300, 1e300, 1e-300}, true}}) {
    Bench bench;
    PoseGraph& graph = *bench.graph;
    for (std::uint32_t i = 0; i < 8; ++i) {
      REQUIRE(graph.add_vertex(pose_at(2.0 * i, 1.0 * i, 0.5 * i, 0)) == Status::ok);  // straight on
      Edge edge;
      edge.from = i - 1;
      edge.to = i;
      edge.variance = extreme.variance;
      if (i > 0) REQUIRE(graph.add_edge(edge) == Status::ok);
    }
    REQUIRE(bench.correction->prepare(graph, 0, 7) == Status::ok);
    const Pose goal = pose_at(0.1, 0.1, 0.1, 1) * graph.poses()[7];
    const double squared = bench.correction->mahalanobis2(graph, goal, EdgeVariance{0, 0, 0, 0});
    CAPTURE(squared, extreme.variance.x_m2, extreme.variance.rotation_rad2);
    CHECK(squared > 0);
    CHECK(std::isinf(squared) != extreme.is_definite);
  }
}

TEST_CASE("what cannot be shared out is refused, and the map stays") {
  Random random(10);
  Bench bench;
  PoseGraph& graph = *bench.graph;
  add_ring(graph, 10, random);
  add_ring(graph, 5, random);
  const std::vector<Pose> before = bench.poses();
  CHECK(bench.share(3, 3, before[3], CorrectionRule::trails) == Status::no_loop);
  CHECK(bench.share(3, 12, before[3], CorrectionRule::trails) == Status::disconnected);
  CHECK(bench.share(3, 99, before[3], CorrectionRule::trails) == Status::no_such_vertex);
  Pose nowhere;
  nowhere.translation_m.x() = std::nan("");
  for (const CorrectionRule rule : rules) CHECK(bench.share(0, 9, nowhere, rule) == Status::bad_pose);
  for (std::uint32_t i = 0; i < before.size(); ++i) CHECK(is_same(graph.poses()[i], before[i]));
}
