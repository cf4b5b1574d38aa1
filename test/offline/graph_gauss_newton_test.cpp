#include "offline/optimize/graph/gauss_newton.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <vector>

#include "alces_platform/sim/random.h"
#include "offline/optimize/graph/constraint_jacobian.h"
#include "offline/optimize/graph/graph_file.h"
#include "support/sample_graph.h"
#include "support/test_data.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using alces::test::sample_graph;
using alces::test::SampleGraph;
using Catch::Contains;

namespace {

constexpr GraphStart starts[] = {GraphStart::file, GraphStart::odometry, GraphStart::spanning_tree,
                                 GraphStart::chordal, GraphStart::best};

double worst_distance_m(const ConstraintGraph& graph, const std::vector<Pose>& truth) {
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    worst = std::max(worst, (graph.vertices[i].map_from_body.translation_m - truth[i].translation_m).norm());
  return worst;
}

bool same_bits(const Pose& a, const Pose& b) {
  return a.translation_m == b.translation_m && a.rotation.coeffs() == b.rotation.coeffs();
}

// The optimum that SE-Sync certifies (Rosen, Carlone, Bandeira, Leonard, IJRR 2019) is of an objective of its
// own: one weight for all of a translation, 3 / trace(C_t), and kappa |R - R'|_F^2 for a rotation,
// kappa = 3 / (2 trace(C_r)), where |R - R'|_F^2 = 8 |q_v|^2. In 2D 2 / trace(C_t) and kappa = I33; its
// chords are those of the same graph lying in space, and so it is lifted.
void weigh_as_se_sync(ConstraintGraph& graph) {
  for (Constraint& c : graph.constraints) {
    if (graph.is_planar) {
      const double tau = 2 / c.planar_information.topLeftCorner<2, 2>().inverse().trace();
      const double kappa = c.planar_information(2, 2);
      c.information.setZero();
      c.information.diagonal() << tau, tau, tau, 8 * kappa, 8 * kappa, 8 * kappa;
      continue;
    }
    const double tau = 3 / c.information.topLeftCorner<3, 3>().inverse().trace();
    const double kappa = 3 / (2 * c.information.bottomRightCorner<3, 3>().inverse().trace());
    c.information.setZero();
    c.information.diagonal() << tau, tau, tau, 8 * kappa, 8 * kappa, 8 * kappa;
  }
  graph.is_planar = false;
}

template <int dimension>
double worst_jacobian_error(bool is_planar) {
  using Vector = Eigen::Matrix<double, dimension, 1>;
  sim::Random random(7);
  double worst = 0;
  for (int round = 0; round < 50; ++round) {
    ConstraintGraph graph;
    graph.is_planar = is_planar;
    const auto any_pose = [&] {
      Pose pose = planar_pose(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-3, 3));
      if (!is_planar) {
        pose.translation_m.z() = random.uniform(-5, 5);
        pose.rotation = exp_so3({random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)});
      }
      return pose;
    };
    graph.vertices = {{.id = 0, .map_from_body = any_pose()}, {.id = 1, .map_from_body = any_pose()}};
    Constraint c;
    c.to = 1;
    c.from_from_to = any_pose();
    LinearizedConstraint<dimension> linear;
    linearize(graph, c, linear);
    for (std::size_t vertex = 0; vertex < 2; ++vertex) {
      for (int k = 0; k < dimension; ++k) {
        const auto error_at = [&](double step) {
          ConstraintGraph other = graph;
          other.vertices[vertex].map_from_body =
              moved(graph.vertices[vertex].map_from_body, Vector(step * Vector::Unit(k)));
          return Vector(constraint_error(other, c).template head<dimension>());
        };
        const Vector numeric = (error_at(1e-6) - error_at(-1e-6)) / 2e-6;
        const Vector analytic = vertex == 0 ? linear.by_from.col(k) : linear.by_to.col(k);
        worst = std::max(worst, (numeric - analytic).cwiseAbs().maxCoeff());
      }
    }
  }
  return worst;
}

}  // namespace

TEST_CASE("gauss-newton: derivatives of a constraint's error are those that differences show") {
  CHECK(worst_jacobian_error<6>(false) < 1e-7);
  CHECK(worst_jacobian_error<3>(true) < 1e-7);
}

TEST_CASE("gauss-newton: without noise the truth is found from every start, in 3D and planar") {
  for (const bool is_planar : {false, true}) {
    for (const GraphStart start : starts) {
      CAPTURE(is_planar, static_cast<int>(start));
      std::vector<Pose> truth;
      ConstraintGraph graph = sample_graph(
          {.is_planar = is_planar, .translation_sigma_m = 1e-12, .rotation_sigma_rad = 1e-12}, &truth);
      for (Constraint& c : graph.constraints) {  // the noise is gone, not its weights
        c.information = Matrix6d::Identity();
        c.planar_information = Eigen::Matrix3d::Identity();
      }
      sim::Random random(3);
      for (std::size_t i = 1; i < graph.vertices.size(); ++i) {
        Pose& pose = graph.vertices[i].map_from_body;
        pose = pose *
               planar_pose(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.3, 0.3));
      }
      const GaussNewtonResult result = optimize_gauss_newton(graph, {.start = start});
      CHECK(result.end == GaussNewtonEnd::converged);
      CHECK(result.chi_squared < 1e-12);
      CHECK(worst_distance_m(graph, truth) < 1e-5);
      CHECK(result.chi_squared == chi_squared(graph));
    }
  }
}

TEST_CASE("gauss-newton: chi-squared at the optimum is what the noise explains") {
  for (const bool is_planar : {false, true}) {
    ConstraintGraph graph = sample_graph({.poses = 400, .loops = 25, .seed = 5, .is_planar = is_planar});
    const double numbers = is_planar ? 3 : 6;
    const double freedom =
        numbers * static_cast<double>(graph.constraints.size() + 1 - graph.vertices.size());
    const GaussNewtonResult result = optimize_gauss_newton(graph);
    // mean `freedom`, standard deviation sqrt(2 freedom)
    CHECK(result.chi_squared > freedom - 4 * std::sqrt(2 * freedom));
    CHECK(result.chi_squared < freedom + 4 * std::sqrt(2 * freedom));
    CHECK(result.chi_squared_before > 3 * result.chi_squared);
  }
}

TEST_CASE("gauss-newton: planar graphs stay planar") {
  ConstraintGraph graph = sample_graph({.is_planar = true});
  optimize_gauss_newton(graph);
  for (const ConstraintVertex& vertex : graph.vertices) {
    REQUIRE(vertex.map_from_body.translation_m.z() == 0);
    REQUIRE(vertex.map_from_body.rotation.x() == 0);
    REQUIRE(vertex.map_from_body.rotation.y() == 0);
  }
}

TEST_CASE("gauss-newton: fixed vertices stay to the bit, the first one where none is fixed") {
  for (const GraphStart start : starts) {
    ConstraintGraph graph = sample_graph({});
    const ConstraintGraph before = graph;
    optimize_gauss_newton(graph, {.start = start});
    CHECK(same_bits(graph.vertices[0].map_from_body, before.vertices[0].map_from_body));
    CHECK_FALSE(graph.vertices[0].is_fixed);

    graph = before;
    graph.vertices[7].is_fixed = graph.vertices[150].is_fixed = true;
    optimize_gauss_newton(graph, {.start = start});
    CHECK(same_bits(graph.vertices[7].map_from_body, before.vertices[7].map_from_body));
    CHECK(same_bits(graph.vertices[150].map_from_body, before.vertices[150].map_from_body));
    CHECK_FALSE(same_bits(graph.vertices[0].map_from_body, before.vertices[0].map_from_body));
  }
}

TEST_CASE("gauss-newton: all vertices fixed, or only one there, is done at once") {
  ConstraintGraph graph = sample_graph({});
  for (ConstraintVertex& vertex : graph.vertices) vertex.is_fixed = true;
  for (const GraphStart start : starts) CHECK(optimize_gauss_newton(graph, {.start = start}).iterations == 0);
  ConstraintGraph one;
  one.vertices.resize(1);
  CHECK(optimize_gauss_newton(one).chi_squared == 0);
}

TEST_CASE("gauss-newton: equal input gives equal bits") {
  ConstraintGraph a = sample_graph({.poses = 300, .loops = 15});
  ConstraintGraph b = a;
  optimize_gauss_newton(a);
  optimize_gauss_newton(b);
  for (std::size_t i = 0; i < a.vertices.size(); ++i)
    REQUIRE(same_bits(a.vertices[i].map_from_body, b.vertices[i].map_from_body));
}

TEST_CASE("gauss-newton: wrong loops bend the map unless a kernel holds them, and are named") {
  std::vector<Pose> truth;
  const ConstraintGraph good = sample_graph({.poses = 400, .loops = 25, .seed = 9}, &truth);
  ConstraintGraph wrong = good;
  std::vector<std::uint32_t> false_loops;
  for (const std::uint32_t vertex : {40U, 160U, 250U}) {
    Constraint c = good.constraints.back();
    c.from = vertex;
    c.to = vertex + 100;
    c.from_from_to = planar_pose(0.5, 0, 0.2);
    false_loops.push_back(static_cast<std::uint32_t>(wrong.constraints.size()));
    wrong.constraints.push_back(c);
  }
  ConstraintGraph plain = wrong;
  optimize_gauss_newton(plain, {.start = GraphStart::odometry});
  ConstraintGraph trusted = good;
  optimize_gauss_newton(trusted);
  const double best_m = worst_distance_m(trusted, truth);
  CHECK(worst_distance_m(plain, truth) > 5 * best_m);

  for (const RobustKernel kernel : {RobustKernel::cauchy, RobustKernel::dcs}) {
    ConstraintGraph robust = wrong;
    const GaussNewtonResult result =
        optimize_gauss_newton(robust, {.start = GraphStart::odometry, .kernel = kernel});
    CAPTURE(static_cast<int>(kernel), best_m);
    CHECK(result.distrusted == false_loops);
    CHECK(worst_distance_m(robust, truth) < 1.2 * best_m + 0.01);
    CHECK(result.cost < result.chi_squared);
  }
  ConstraintGraph huber = wrong;
  optimize_gauss_newton(huber, {.start = GraphStart::odometry, .kernel = RobustKernel::huber});
  CHECK(worst_distance_m(huber, truth) < worst_distance_m(plain, truth));
}

TEST_CASE("gauss-newton: a kernel's weight is the derivative of its cost") {
  for (const RobustKernel kernel :
       {RobustKernel::none, RobustKernel::huber, RobustKernel::cauchy, RobustKernel::dcs}) {
    for (const double s : {0.1, 3.9, 4.1, 30.0, 4000.0}) {
      const double numeric =
          (robust_cost(kernel, 2, s * (1 + 1e-6)).cost - robust_cost(kernel, 2, s * (1 - 1e-6)).cost) /
          (2e-6 * s);
      CHECK(robust_cost(kernel, 2, s).weight == Approx(numeric).epsilon(1e-5).margin(1e-9));
    }
    CHECK(robust_cost(kernel, 2, 0).cost == 0);
  }
}

TEST_CASE("gauss-newton: a stop and an iteration limit keep the best so far") {
  const ConstraintGraph graph = sample_graph({.poses = 400, .loops = 25});
  ConstraintGraph limited = graph;
  GaussNewtonResult result =
      optimize_gauss_newton(limited, {.start = GraphStart::file, .most_iterations = 1});
  CHECK(result.end == GaussNewtonEnd::iteration_limit);
  CHECK(result.iterations == 1);
  CHECK(result.chi_squared < result.chi_squared_before);

  ConstraintGraph stopped = graph;
  std::size_t steps = 0;
  result = optimize_gauss_newton(stopped, {.start = GraphStart::file},
                                 {.progress = [&](const GaussNewtonStep& step) { steps = step.iteration; },
                                  .stop_requested = [&] { return steps == 2; }});
  CHECK(result.end == GaussNewtonEnd::stopped);
  CHECK(result.iterations == 2);
  CHECK(chi_squared(stopped) == result.chi_squared);
  CHECK(result.chi_squared <= result.chi_squared_before);
}

TEST_CASE("gauss-newton: a graph in parts is turned away and left alone") {
  ConstraintGraph graph = sample_graph({.loops = 0});
  graph.constraints.erase(graph.constraints.begin() + 99);
  CHECK_THROWS_WITH(optimize_gauss_newton(graph), Contains("2 parts") && Contains("begins at vertex 100"));
}

TEST_CASE("gauss-newton: reaches the optimum that SE-Sync certifies") {
  struct Certified {
    const char* name;
    double objective;
  };
  // sphere2500 and torus3D take seconds: docs/graphs.md
  for (const Certified& known : {Certified{"tinyGrid3D.g2o", 18.5194},
                                 {"smallGrid3D.g2o", 1025.398},
                                 {"intel.g2o", 52.3482},
                                 {"MIT.g2o", 61.1541},
                                 {"CSAIL_P_toro.graph", 31.7037}}) {
    const std::string name = std::string("pose_graphs/") + known.name;
    if (!test::has_test_data(name)) return;
    for (const GraphStart start : {GraphStart::best, GraphStart::spanning_tree}) {
      ConstraintGraph graph = read_graph(test::test_data(name)).graph;
      weigh_as_se_sync(graph);
      CHECK(optimize_gauss_newton(graph, {.start = start}).chi_squared ==
            Approx(known.objective).epsilon(1e-5));
    }
  }
}

TEST_CASE("gauss-newton: planar data sets reach one optimum from chordal and tree starts") {
  struct Known {
    const char* name;
    double chi_squared;
  };
  for (const Known& known :
       {Known{"intel.g2o", 45.0047}, {"MIT.g2o", 41.1633}, {"CSAIL_P_toro.graph", 38.9563}}) {
    const std::string name = std::string("pose_graphs/") + known.name;
    if (!test::has_test_data(name)) return;
    for (const GraphStart start : {GraphStart::best, GraphStart::spanning_tree}) {
      ConstraintGraph graph = read_graph(test::test_data(name)).graph;
      CHECK(optimize_gauss_newton(graph, {.start = start}).chi_squared ==
            Approx(known.chi_squared).epsilon(1e-5));
    }
  }
}
