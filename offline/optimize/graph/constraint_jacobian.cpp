#include "constraint_jacobian.h"

#include <cmath>

#include "planar_pose.h"

namespace alces::offline {
namespace {

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Matrix2d turn(double angle_rad) {
  Eigen::Matrix2d m;
  m << std::cos(angle_rad), -std::sin(angle_rad), std::sin(angle_rad), std::cos(angle_rad);
  return m;
}

}  // namespace

// With the error's translation  R_z^T (R_i^T (t_j - t_i) - t_z)  and quaternion  q_z* q_i* q_j = (w, v):
// a turn of j by d multiplies the latter by (1, d/2) from the right, one of i by (1, -R_z^T d/2) from the
// left.
void linearize(const ConstraintGraph& graph, const Constraint& constraint, LinearizedConstraint<6>& result) {
  const Pose& from = graph.vertices[constraint.from].map_from_body;
  const Pose& to = graph.vertices[constraint.to].map_from_body;
  const Pose from_from_to = from.inverse() * to;
  const Pose error = constraint.from_from_to.inverse() * from_from_to;
  const double sign = error.rotation.w() < 0 ? -1 : 1;
  const double w = sign * error.rotation.w();
  const Eigen::Vector3d v = sign * error.rotation.vec();
  const Eigen::Matrix3d z = constraint.from_from_to.rotation.toRotationMatrix().transpose();
  const Eigen::Matrix3d upright = w * Eigen::Matrix3d::Identity();

  result.error << error.translation_m, v;
  result.by_from.topLeftCorner<3, 3>() = -z;
  result.by_from.topRightCorner<3, 3>() = z * skew(from_from_to.translation_m);
  result.by_from.bottomLeftCorner<3, 3>().setZero();
  result.by_from.bottomRightCorner<3, 3>() = 0.5 * (skew(v) - upright) * z;
  result.by_to.topLeftCorner<3, 3>() = error.rotation.toRotationMatrix();
  result.by_to.topRightCorner<3, 3>().setZero();
  result.by_to.bottomLeftCorner<3, 3>().setZero();
  result.by_to.bottomRightCorner<3, 3>() = 0.5 * (skew(v) + upright);
}

void linearize(const ConstraintGraph& graph, const Constraint& constraint, LinearizedConstraint<3>& result) {
  const Pose& from = graph.vertices[constraint.from].map_from_body;
  const Pose& to = graph.vertices[constraint.to].map_from_body;
  const Eigen::Matrix2d map_from_body = turn(heading_rad(from));
  const Eigen::Matrix2d z = turn(heading_rad(constraint.from_from_to)).transpose();
  const Eigen::Vector2d way =
      map_from_body.transpose() * (to.translation_m - from.translation_m).head<2>();  // seen from `from`

  result.error = constraint_error(graph, constraint).head<3>();
  result.by_from.setZero();
  result.by_from.topLeftCorner<2, 2>() = -z;
  result.by_from.topRightCorner<2, 1>() = z * Eigen::Vector2d(way.y(), -way.x());
  result.by_from(2, 2) = -1;
  result.by_to.setZero();
  result.by_to.topLeftCorner<2, 2>() = z * map_from_body.transpose() * turn(heading_rad(to));
  result.by_to(2, 2) = 1;
}

Pose moved(const Pose& map_from_body, const Eigen::Matrix<double, 6, 1>& step) {
  Pose motion;
  motion.translation_m = step.head<3>();
  motion.rotation = exp_so3(step.tail<3>());
  return map_from_body * motion;
}

Pose moved(const Pose& map_from_body, const Eigen::Matrix<double, 3, 1>& step) {
  const Pose result = map_from_body * planar_pose(step.x(), step.y(), step.z());
  return planar_pose(result.translation_m.x(), result.translation_m.y(), heading_rad(result));
}

}  // namespace alces::offline
