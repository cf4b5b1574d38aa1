#include "marginal_information.h"

#include <Eigen/Cholesky>
#include <string>
#include <vector>

#include "alces/pose_graph.h"
#include "alces_offline/error.h"
#include "alces_offline/graph/block_system.h"
#include "alces_offline/graph/constraint_jacobian.h"

namespace alces::offline {
namespace {

template <int dimension>
using Square = Eigen::Matrix<double, dimension, dimension>;

const Matrix6d& information_of(const Constraint& constraint, const Square<6>&) {
  return constraint.information;
}
const Eigen::Matrix3d& information_of(const Constraint& constraint, const Square<3>&) {
  return constraint.planar_information;
}

// Of the vertex's motion in its own frame.
template <int dimension>
Square<dimension> marginal_information(const ConstraintGraph& graph, std::uint32_t vertex) {
  std::vector<std::uint32_t> unknown(graph.vertices.size(), no_index);
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < unknown.size(); ++i)
    if (!graph.vertices[i].is_fixed) unknown[i] = count++;
  std::vector<BlockSystem::Pair> pairs;
  for (const Constraint& constraint : graph.constraints) {
    const std::uint32_t i = unknown[constraint.from];
    const std::uint32_t j = unknown[constraint.to];
    if (i != no_index && j != no_index) pairs.emplace_back(i, j);
  }
  BlockSystem system(count, dimension, pairs);
  system.set_zero();
  LinearizedConstraint<dimension> linear;
  for (const Constraint& constraint : graph.constraints) {
    linearize(graph, constraint, linear);
    const Square<dimension>& information = information_of(constraint, Square<dimension>{});
    const Square<dimension> from_weighted = linear.by_from.transpose() * information;
    const std::uint32_t i = unknown[constraint.from];
    const std::uint32_t j = unknown[constraint.to];
    if (i != no_index) system.add<dimension>(i, i, from_weighted * linear.by_from);
    if (j != no_index) system.add<dimension>(j, j, linear.by_to.transpose() * information * linear.by_to);
    if (i != no_index && j != no_index) system.add<dimension>(i, j, from_weighted * linear.by_to);
  }
  const auto undetermined = [&graph, vertex] {
    return InputError("the constraints around vertex " + std::to_string(graph.vertices[vertex].id) +
                      " do not determine its pose: their information is singular or not finite");
  };
  if (!system.factorize(0)) throw undetermined();
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(count) * dimension, dimension);
  unit.template middleRows<dimension>(Eigen::Index{unknown[vertex]} * dimension).setIdentity();
  const Square<dimension> covariance =
      system.solve(unit).template middleRows<dimension>(Eigen::Index{unknown[vertex]} * dimension);
  const Square<dimension> symmetric = 0.5 * (covariance + covariance.transpose());
  const Eigen::LLT<Square<dimension>> factor(symmetric);
  if (factor.info() != Eigen::Success) throw undetermined();
  const Square<dimension> information = factor.solve(Square<dimension>::Identity());
  return 0.5 * (information + information.transpose());
}

}  // namespace

void condense(const ConstraintGraph& graph, std::uint32_t from, std::uint32_t to, Constraint& joint) {
  joint.from_from_to = graph.vertices[from].map_from_body.inverse() * graph.vertices[to].map_from_body;
  if (graph.is_planar) {
    joint.planar_information = marginal_information<3>(graph, to);
    return;
  }
  // A motion by (t, r) is an error of (t, r / 2).
  joint.information = marginal_information<6>(graph, to);
  joint.information.rightCols<3>() *= 2;
  joint.information.bottomRows<3>() *= 2;
}

}  // namespace alces::offline
