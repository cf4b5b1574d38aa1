#include "constraint_graph.h"

#include <cmath>

namespace alces::offline {

Vector6d constraint_error(const ConstraintGraph& graph, const Constraint& constraint) {
  const Pose& from = graph.vertices[constraint.from].map_from_body;
  const Pose& to = graph.vertices[constraint.to].map_from_body;
  const Pose error = constraint.from_from_to.inverse() * (from.inverse() * to);
  const double sign = error.rotation.w() < 0 ? -1 : 1;
  Vector6d e = Vector6d::Zero();
  if (graph.is_planar) {
    e.head<2>() = error.translation_m.head<2>();
    e[2] = 2 * std::atan2(sign * error.rotation.z(), sign * error.rotation.w());
  } else {
    e << error.translation_m, sign * error.rotation.vec();
  }
  return e;
}

double chi_squared(const ConstraintGraph& graph, const Constraint& constraint) {
  const Vector6d e = constraint_error(graph, constraint);
  if (graph.is_planar) return e.head<3>().dot(constraint.planar_information * e.head<3>());
  return e.dot(constraint.information * e);
}

double chi_squared(const ConstraintGraph& graph) {
  double sum = 0;
  for (const Constraint& constraint : graph.constraints) sum += chi_squared(graph, constraint);
  return sum;
}

}  // namespace alces::offline
