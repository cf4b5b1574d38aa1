#include "gauss_newton.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <type_traits>
#include <utility>

#include "alces/pose_graph.h"
#include "block_system.h"
#include "constraint_jacobian.h"
#include "graph_parts.h"

namespace alces::offline {
namespace {

constexpr double first_lambda = 1e-6;  // as good as none: the first step is Gauss-Newton's
constexpr double least_lambda = 1e-12;
constexpr double largest_lambda = 1e8;  // steps this short are lost in rounding

RobustCost cost_of(const Constraint& constraint, const GaussNewtonSettings& settings, double chi_squared) {
  return robust_cost(is_loop(constraint) ? settings.kernel : RobustKernel::none, settings.kernel_width,
                     chi_squared);
}

double total_cost(const ConstraintGraph& graph, const GaussNewtonSettings& settings) {
  double sum = 0;
  for (const Constraint& c : graph.constraints) sum += cost_of(c, settings, chi_squared(graph, c)).cost;
  return sum;
}

void choose_start(ConstraintGraph& graph, const GaussNewtonSettings& settings, GaussNewtonResult& result) {
  result.start = settings.start;
  switch (settings.start) {
    case GraphStart::file:
      break;
    case GraphStart::odometry:
      start_from_odometry(graph);
      break;
    case GraphStart::spanning_tree:
      start_from_spanning_tree(graph);
      break;
    case GraphStart::chordal:
      start_from_chordal(graph);
      break;
    case GraphStart::best: {
      ConstraintGraph chordal = graph;
      start_from_chordal(chordal);
      const bool chordal_is_better = total_cost(chordal, settings) < total_cost(graph, settings);
      if (chordal_is_better) graph.vertices = std::move(chordal.vertices);
      result.start = chordal_is_better ? GraphStart::chordal : GraphStart::file;
      break;
    }
  }
}

const Matrix6d& information_of(const Constraint& c, std::integral_constant<int, 6>) {
  return c.information;
}
const Eigen::Matrix3d& information_of(const Constraint& c, std::integral_constant<int, 3>) {
  return c.planar_information;
}

// One problem; dimension is that of a vertex's motion, 6 or 3.
template <int dimension>
class Problem {
 public:
  Problem(ConstraintGraph& graph, const GaussNewtonSettings& settings) : graph_(graph), settings_(settings) {
    unknown_.assign(graph.vertices.size(), no_index);
    for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
      if (!graph.vertices[i].is_fixed) unknown_[i] = count_++;
    }
    std::vector<BlockSystem::Pair> pairs;
    pairs.reserve(graph.constraints.size());
    for (const Constraint& c : graph.constraints) {
      if (unknown_[c.from] != no_index && unknown_[c.to] != no_index)
        pairs.emplace_back(unknown_[c.from], unknown_[c.to]);
    }
    if (count_ > 0) system_ = std::make_unique<BlockSystem>(count_, dimension, pairs);
  }

  void run(const GaussNewtonCallbacks& callbacks, GaussNewtonResult& result) {
    double cost = total_cost(graph_, settings_);
    const double rounding_cost = cost_of_rounding();
    double lambda = first_lambda;
    double growth = 2;
    bool is_linearized = false;
    const auto report = [&](bool was_accepted) {
      if (callbacks.progress)
        callbacks.progress(
            {.iteration = result.iterations, .cost = cost, .lambda = lambda, .was_accepted = was_accepted});
    };
    report(true);
    result.end = GaussNewtonEnd::converged;
    while (count_ > 0 && cost > rounding_cost && lambda < largest_lambda) {
      if (result.iterations == settings_.most_iterations) {
        result.end = GaussNewtonEnd::iteration_limit;
        break;
      }
      if (callbacks.stop_requested && callbacks.stop_requested()) {
        result.end = GaussNewtonEnd::stopped;
        break;
      }
      if (!is_linearized) linearize_all();
      is_linearized = true;
      ++result.iterations;

      double new_cost = std::numeric_limits<double>::infinity();
      double expected_decrease = 0;
      if (system_->factorize(lambda)) {
        result.factor_numbers = system_->factor_numbers();
        const Eigen::VectorXd step = system_->solve(-gradient_);
        expected_decrease = -gradient_.dot(step) + lambda * step.cwiseAbs2().dot(system_->diagonal());
        take(step);
        new_cost = total_cost(graph_, settings_);
      }
      const double decrease = cost - new_cost;
      if (std::isfinite(new_cost) && decrease >= 0) {
        const double gain = expected_decrease > 0 ? decrease / expected_decrease : 1;
        const bool is_done = decrease <= settings_.least_decrease * cost && lambda < 1;
        cost = new_cost;
        lambda = std::max(least_lambda, lambda * std::clamp(1 - std::pow(2 * gain - 1, 3), 1.0 / 10, 1.0));
        growth = 2;
        is_linearized = false;
        report(true);
        if (is_done) break;
      } else {
        if (!before_.empty()) take_back();
        const bool is_rounding = expected_decrease <= settings_.least_decrease * cost && lambda < 1;
        lambda *= growth;
        growth *= 2;
        report(false);
        if (is_rounding && expected_decrease > 0) break;
      }
      before_.clear();
    }
    result.cost = cost;
  }

 private:
  using Vector = Eigen::Matrix<double, dimension, 1>;
  using Matrix = Eigen::Matrix<double, dimension, dimension>;

  /// What is left where every measurement is met to the last bits, as in a chain without loops: no step makes
  /// it less.
  [[nodiscard]] double cost_of_rounding() const {
    double farthest_m = 1;
    for (const ConstraintVertex& vertex : graph_.vertices)
      farthest_m = std::max(farthest_m, vertex.map_from_body.translation_m.cwiseAbs().maxCoeff());
    const double rounding = 16 * std::numeric_limits<double>::epsilon() * farthest_m;
    double sum = 0;
    for (const Constraint& c : graph_.constraints)
      sum += information_of(c, std::integral_constant<int, dimension>{}).trace() * rounding * rounding;
    return sum;
  }

  void linearize_all() {
    system_->set_zero();
    gradient_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(count_) * dimension);
    LinearizedConstraint<dimension> linear;
    for (const Constraint& c : graph_.constraints) {
      linearize(graph_, c, linear);
      const Matrix& information = information_of(c, std::integral_constant<int, dimension>{});
      const double chi_squared = linear.error.dot(information * linear.error);
      const Matrix weighted = cost_of(c, settings_, chi_squared).weight * information;
      const std::uint32_t i = unknown_[c.from];
      const std::uint32_t j = unknown_[c.to];
      const Matrix from_weighted = linear.by_from.transpose() * weighted;
      const Matrix to_weighted = linear.by_to.transpose() * weighted;
      if (i != no_index) {
        system_->add<dimension>(i, i, from_weighted * linear.by_from);
        gradient_.segment<dimension>(Eigen::Index{i} * dimension) += from_weighted * linear.error;
      }
      if (j != no_index) {
        system_->add<dimension>(j, j, to_weighted * linear.by_to);
        gradient_.segment<dimension>(Eigen::Index{j} * dimension) += to_weighted * linear.error;
      }
      if (i != no_index && j != no_index) system_->add<dimension>(i, j, from_weighted * linear.by_to);
    }
  }

  void take(const Eigen::VectorXd& step) {
    before_.resize(graph_.vertices.size());
    for (std::size_t i = 0; i < graph_.vertices.size(); ++i) {
      Pose& pose = graph_.vertices[i].map_from_body;
      before_[i] = pose;
      if (unknown_[i] != no_index)
        pose = moved(pose, Vector(step.segment<dimension>(Eigen::Index{unknown_[i]} * dimension)));
    }
  }

  void take_back() {
    for (std::size_t i = 0; i < graph_.vertices.size(); ++i) graph_.vertices[i].map_from_body = before_[i];
  }

  ConstraintGraph& graph_;
  const GaussNewtonSettings& settings_;
  std::uint32_t count_ = 0;
  std::vector<std::uint32_t> unknown_;  // of each vertex; no_index: fixed
  std::unique_ptr<BlockSystem> system_;
  Eigen::VectorXd gradient_;  // half of it
  std::vector<Pose> before_;
};

}  // namespace

GaussNewtonResult optimize_gauss_newton(ConstraintGraph& graph, const GaussNewtonSettings& settings,
                                        const GaussNewtonCallbacks& callbacks) {
  require_connected(graph);
  GaussNewtonResult result;
  result.chi_squared_before = chi_squared(graph);
  const std::vector<ConstraintVertex> as_given = graph.vertices;
  ensure_fixed(graph);
  choose_start(graph, settings, result);
  result.chi_squared_start = chi_squared(graph);
  if (graph.is_planar) {
    Problem<3>(graph, settings).run(callbacks, result);
  } else {
    Problem<6>(graph, settings).run(callbacks, result);
  }
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) graph.vertices[i].is_fixed = as_given[i].is_fixed;
  result.chi_squared = chi_squared(graph);
  for (std::uint32_t i = 0; i < graph.constraints.size(); ++i) {
    const Constraint& c = graph.constraints[i];
    if (cost_of(c, settings, chi_squared(graph, c)).weight < 0.5) result.distrusted.push_back(i);
  }
  return result;
}

}  // namespace alces::offline
