#include "condense.h"

#include <Eigen/Cholesky>
#include <limits>
#include <string>
#include <vector>

#include "offline/io/files/error.h"
#include "offline/optimize/graph/constraint_jacobian.h"
#include "offline/optimize/graph/graph_start.h"

namespace alces::offline {
namespace {

constexpr int most_iterations = 15;
constexpr double least_decrease = 1e-9;  // of chi-squared, as a fraction

template <int dimension>
using Square = Eigen::Matrix<double, dimension, dimension>;

const Matrix6d& information_of(const Constraint& constraint, const Square<6>*) {
  return constraint.information;
}
const Eigen::Matrix3d& information_of(const Constraint& constraint, const Square<3>*) {
  return constraint.planar_information;
}

// The normal equations of all vertices; those of the fixed one keep it where it is.
template <int dimension>
class NormalEquations {
 public:
  NormalEquations(const ConstraintGraph& graph, std::uint32_t fixed) {
    const Eigen::Index size = dimension * static_cast<Eigen::Index>(graph.vertices.size());
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd right_side = Eigen::VectorXd::Zero(size);
    LinearizedConstraint<dimension> linear;
    for (const Constraint& constraint : graph.constraints) {
      linearize(graph, constraint, linear);
      const Square<dimension>& information =
          information_of(constraint, static_cast<const Square<dimension>*>(nullptr));
      const Square<dimension> from_weighted = linear.by_from.transpose() * information;
      const Square<dimension> to_weighted = linear.by_to.transpose() * information;
      const Eigen::Index i = row(constraint.from);
      const Eigen::Index j = row(constraint.to);
      matrix.block<dimension, dimension>(i, i) += from_weighted * linear.by_from;
      matrix.block<dimension, dimension>(j, j) += to_weighted * linear.by_to;
      const Square<dimension> between = from_weighted * linear.by_to;
      matrix.block<dimension, dimension>(i, j) += between;
      matrix.block<dimension, dimension>(j, i) += between.transpose();
      right_side.segment<dimension>(i) -= from_weighted * linear.error;
      right_side.segment<dimension>(j) -= to_weighted * linear.error;
    }
    matrix.middleRows<dimension>(row(fixed)).setZero();
    matrix.middleCols<dimension>(row(fixed)).setZero();
    matrix.block<dimension, dimension>(row(fixed), row(fixed)).setIdentity();
    right_side.segment<dimension>(row(fixed)).setZero();
    factor_.compute(matrix);
    right_side_ = std::move(right_side);
  }

  [[nodiscard]] bool are_solvable() const { return factor_.info() == Eigen::Success; }
  [[nodiscard]] Eigen::VectorXd solve() const { return factor_.solve(right_side_); }

  [[nodiscard]] Square<dimension> covariance(std::uint32_t vertex) const {
    Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(right_side_.size(), dimension);
    unit.middleRows<dimension>(row(vertex)).setIdentity();
    const Square<dimension> covariance = factor_.solve(unit).template middleRows<dimension>(row(vertex));
    return 0.5 * (covariance + covariance.transpose());
  }

 private:
  [[nodiscard]] static Eigen::Index row(std::uint32_t vertex) { return dimension * Eigen::Index{vertex}; }

  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd right_side_;
};

// Gauss-Newton, with shorter steps where a whole one does not help. The information of the motion of `to` in
// its own frame; false: not determined.
template <int dimension>
bool optimize(ConstraintGraph& graph, std::uint32_t from, std::uint32_t to, Square<dimension>& information) {
  double cost = chi_squared(graph);
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    const NormalEquations<dimension> equations(graph, from);
    if (!equations.are_solvable()) return false;
    const Eigen::VectorXd step = equations.solve();
    const std::vector<ConstraintVertex> before = graph.vertices;
    double new_cost = std::numeric_limits<double>::infinity();
    for (double length = 1; length > 0.01 && !(new_cost <= cost); length /= 4) {
      for (std::size_t i = 0; i < before.size(); ++i) {
        const Eigen::Matrix<double, dimension, 1> part =
            length * step.segment<dimension>(dimension * static_cast<Eigen::Index>(i));
        if (i != from) graph.vertices[i].map_from_body = moved(before[i].map_from_body, part);
      }
      new_cost = chi_squared(graph);
    }
    if (!(new_cost <= cost)) {
      graph.vertices = before;
      break;
    }
    const bool is_done = cost - new_cost <= least_decrease * cost;
    cost = new_cost;
    if (is_done) break;
  }
  const NormalEquations<dimension> equations(graph, from);
  if (!equations.are_solvable()) return false;
  const Eigen::LLT<Square<dimension>> covariance(equations.covariance(to));
  if (covariance.info() != Eigen::Success) return false;
  const Square<dimension> inverse = covariance.solve(Square<dimension>::Identity());
  information = 0.5 * (inverse + inverse.transpose());
  return information.allFinite();
}

}  // namespace

void condense(ConstraintGraph& graph, std::uint32_t from, std::uint32_t to, Constraint& joint) {
  for (std::uint32_t i = 0; i < graph.vertices.size(); ++i) graph.vertices[i].is_fixed = i == from;
  start_from_spanning_tree(graph);
  const bool is_determined = graph.is_planar ? optimize<3>(graph, from, to, joint.planar_information)
                                             : optimize<6>(graph, from, to, joint.information);
  if (!is_determined)
    throw InputError("the constraints around vertex " + std::to_string(graph.vertices[to].id) +
                     " do not determine its pose: their information is singular or not finite");
  joint.from_from_to = graph.vertices[from].map_from_body.inverse() * graph.vertices[to].map_from_body;
  if (graph.is_planar) return;
  // A motion by (t, r) is an error of (t, r / 2).
  joint.information.rightCols<3>() *= 2;
  joint.information.bottomRows<3>() *= 2;
}

}  // namespace alces::offline
