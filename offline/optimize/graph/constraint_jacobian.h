// Derivatives of constraint_error() by small motions of its two vertices, in closed form.
//
// A vertex moves in its own frame: map_from_body becomes map_from_body * (translation, exp(rotation vector)),
// and for a planar graph * (x, y, turn about z). Checked against differences in the tests.
#pragma once

#include <Eigen/Core>

#include "constraint_graph.h"

namespace alces::offline {

/// dimension is 6 for 3D and 3 for planar graphs.
template <int dimension>
struct LinearizedConstraint {
  Eigen::Matrix<double, dimension, 1> error;
  Eigen::Matrix<double, dimension, dimension> by_from;
  Eigen::Matrix<double, dimension, dimension> by_to;
};

void linearize(const ConstraintGraph& graph, const Constraint& constraint, LinearizedConstraint<6>& result);
void linearize(const ConstraintGraph& graph, const Constraint& constraint, LinearizedConstraint<3>& result);

/// The motion that the derivatives are taken by.
[[nodiscard]] Pose moved(const Pose& map_from_body, const Eigen::Matrix<double, 6, 1>& step);
[[nodiscard]] Pose moved(const Pose& map_from_body, const Eigen::Matrix<double, 3, 1>& step);

}  // namespace alces::offline
