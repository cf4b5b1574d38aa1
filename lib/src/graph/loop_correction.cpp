#include "alces/loop_correction.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "alces/portable_math.h"
#include "alces/symmetric_solve.h"

namespace alces {
namespace {

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// A chain of edges whose end is to move by (translation, rotation vector). Edge j may move what follows by
// tau_j, covariance T_j = Q diag(x, y, z) Q^T with the matched scan's Q, and turn it by theta_j, covariance
// R_j = Q diag(r_x, r_y, r_z) Q^T, about c_j, the place of the scan that was matched: its label already says
// how sure that place is, the match's own lever included. With the lever b_j = end - c_j the most likely
// parts are
//   tau_j = T_j lambda_t,   theta_j = R_j (lambda_r + b_j x lambda_t),
// where (lambda_t, lambda_r) solves  S lambda = (translation, rotation)  and S is the end's covariance.
struct ChainCovariance {
  Matrix6d s = Matrix6d::Zero();

  void add(const EdgeVariance& variance, const Eigen::Quaterniond& map_from_to,
           const Eigen::Vector3d& lever) {
    const Eigen::Matrix3d rotation_rad2 = rotation_covariance(variance, map_from_to);
    const Eigen::Matrix3d arm = skew(lever);
    const Eigen::Matrix3d cross = arm * rotation_rad2;
    s.topLeftCorner<3, 3>() += translation_covariance(variance, map_from_to) + cross * arm.transpose();
    s.topRightCorner<3, 3>() -= cross;
    s.bottomLeftCorner<3, 3>() -= cross.transpose();
    s.bottomRightCorner<3, 3>() += rotation_rad2;
  }
  [[nodiscard]] SymmetricSolver<6> solver() const { return SymmetricSolver<6>(s); }
};

// (translation of the pose's origin, rotation vector) that takes `from` to `to`, both map_from_something.
Vector6d offset_between(const Pose& from, const Pose& to) {
  Vector6d offset;
  offset.head<3>() = to.translation_m - from.translation_m;
  offset.tail<3>() = log_so3(to.rotation * from.rotation.conjugate());
  return offset;
}

// A pose may turn by what the offset turns, and by a degree for each metre of it. On real drives trails stay
// below half of that; where every pose is in several loops, they do not, and the next loop finds a larger
// offset.
constexpr double turn_rad_per_m = std::numbers::pi / 180;

constexpr int most_rounds = 6;        // the chain is bent by linear steps; each round squares the error
constexpr double good_enough = 1e-7;  // m and rad

}  // namespace

Status LoopCorrection::prepare(const PoseGraph& graph, std::uint32_t f, std::uint32_t l) {
  f_ = f;
  l_ = l;
  const Status status = optimizer_.prepare(graph, f, l);
  if (status != Status::ok) return status;
  return optimizer_.decompose(LoopCost::rotation);
}

Matrix6d LoopCorrection::covariance(const PoseGraph& graph) const {
  const std::span<const Pose> poses = graph.poses();
  const LoopOptimizer::Trail& trail = optimizer_.trails().front();  // the shortest way between f and l
  ChainCovariance covariance;
  const Eigen::Vector3d end =
      poses[l_].translation_m;  // the map is known from f, whichever way the trail runs
  for (const LoopOptimizer::TrailStep& step : optimizer_.steps(trail)) {
    const Edge& edge = graph.edges()[step.half_edge / 2];
    covariance.add(edge.variance, poses[edge.to].rotation, end - poses[edge.to].translation_m);
  }
  return covariance.s;
}

double LoopCorrection::mahalanobis2(const PoseGraph& graph, const Pose& map_from_l,
                                    const EdgeVariance& match) const {
  ChainCovariance both{covariance(graph)};
  both.add(match, map_from_l.rotation, Eigen::Vector3d::Zero());
  const Vector6d offset = offset_between(graph.poses()[l_], map_from_l);
  const SymmetricSolver<6> solver = both.solver();
  if (!solver.is_definite())
    return std::numeric_limits<double>::infinity();  // nothing known explains nothing
  return offset.dot(solver.solve(offset));
}

Status LoopCorrection::share(PoseGraph& graph, const Pose& map_from_l, CorrectionRule rule) {
  const std::span<Pose> poses = graph.poses();
  if (optimizer_.trails().empty()) return Status::disconnected;
  if (!is_valid(map_from_l)) return Status::bad_pose;
  const Pose map_from_first = poses[0];
  if (rule == CorrectionRule::trails) share_along_trails(graph, map_from_l);
  if (rule == CorrectionRule::paper || is_swung(poses, map_from_l)) {
    const Status status = share_as_the_paper(poses, map_from_l);
    if (status != Status::ok) return status;
  }
  // Appendix B, equation 7: the origin stays.
  const Pose map_from_bent = map_from_first * bent_[0].inverse();
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i] = map_from_bent * bent_[i];
  poses[0] = map_from_first;  // to the last bit
  return Status::ok;
}

Status LoopCorrection::share_as_the_paper(std::span<const Pose> poses, const Pose& map_from_l) {
  for (std::uint32_t cost = 0; cost < 4; ++cost) {
    const Status status = optimizer_.weights(static_cast<LoopCost>(cost), weights_[cost]);
    if (status != Status::ok) return status;
  }
  const Pose& map_from_f = poses[f_];
  const Pose f_from_map = map_from_f.inverse();
  const Pose offset = f_from_map * map_from_l * poses[l_].inverse() * map_from_f;
  const Eigen::Vector3d rotation_vector_rad = log_so3(offset.rotation);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Pose share;
    share.translation_m = {weights_[0][i] * offset.translation_m.x(),
                           weights_[1][i] * offset.translation_m.y(),
                           weights_[2][i] * offset.translation_m.z()};
    share.rotation = exp_so3(weights_[3][i] * rotation_vector_rad);  // slerp from the identity
    bent_[i] = map_from_f * share * f_from_map * poses[i];
  }
  return Status::ok;
}

bool LoopCorrection::is_swung(std::span<const Pose> poses, const Pose& map_from_l) const {
  const Vector6d offset = offset_between(poses[l_], map_from_l);
  const double most_rad = offset.tail<3>().norm() + turn_rad_per_m * offset.head<3>().norm();
  const double least_cosine = portable::sine_cosine(std::min(most_rad, std::numbers::pi) / 2).cosine;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double cosine = std::abs(poses[i].rotation.dot(bent_[i].rotation));  // of half the turn
    if (!(cosine >= least_cosine - 1e-12)) return true;
  }
  return false;
}

void LoopCorrection::share_along_trails(const PoseGraph& graph, const Pose& map_from_l) {
  const std::span<const Pose> poses = graph.poses();
  std::copy(poses.begin(), poses.end(), bent_.begin());
  bent_[l_] = map_from_l;
  for (const LoopOptimizer::Trail& trail : optimizer_.trails()) bend_trail(graph, trail);
  for (const LoopOptimizer::BranchVertex& branch : optimizer_.branches()) {
    bent_[branch.vertex] = bent_[branch.parent] * (poses[branch.parent].inverse() * poses[branch.vertex]);
  }
}

// The ends of the trail lie where they belong in bent_; lays its inner vertices between them.
void LoopCorrection::bend_trail(const PoseGraph& graph, const LoopOptimizer::Trail& trail) {
  const std::span<const Pose> poses = graph.poses();
  const std::span<const LoopOptimizer::TrailStep> steps = optimizer_.steps(trail);
  const Pose goal = bent_[trail.end];

  // As it was, moved rigidly with its start.
  const Pose bent_from_map = bent_[trail.start] * poses[trail.start].inverse();
  for (const LoopOptimizer::TrailStep& step : steps) bent_[step.vertex] = bent_from_map * poses[step.vertex];

  for (int round = 0; round < most_rounds; ++round) {
    const Vector6d offset = offset_between(bent_[trail.end], goal);
    if (std::max(offset.head<3>().norm(), offset.tail<3>().norm()) < good_enough) break;
    const Eigen::Vector3d end = bent_[trail.end].translation_m;
    ChainCovariance covariance;
    for (const LoopOptimizer::TrailStep& step : steps) {
      const Edge& edge = graph.edges()[step.half_edge / 2];
      covariance.add(edge.variance, bent_[edge.to].rotation, end - bent_[edge.to].translation_m);
    }
    const Vector6d lambda = covariance.solver().solve(offset);
    const Eigen::Vector3d lambda_t = lambda.head<3>();
    const Eigen::Vector3d lambda_r = lambda.tail<3>();

    Pose follow;                     // what the edges so far did to everything after them
    Pose from = bent_[trail.start];  // where the step begins, before this round
    for (const LoopOptimizer::TrailStep& step : steps) {
      const Edge& edge = graph.edges()[step.half_edge / 2];
      const Pose to = bent_[step.vertex];
      const Pose& matched = edge.to == step.vertex ? to : from;
      const Eigen::Vector3d& place = matched.translation_m;
      const Eigen::Vector3d tau_m = translation_covariance(edge.variance, matched.rotation) * lambda_t;
      const Eigen::Vector3d theta_rad =
          rotation_covariance(edge.variance, matched.rotation) * (lambda_r + (end - place).cross(lambda_t));
      const Eigen::Vector3d pivot = follow * place;
      const Eigen::Quaterniond turn = exp_so3(theta_rad);
      follow.translation_m = turn * (follow.translation_m - pivot) + pivot + tau_m;
      follow.rotation = (turn * follow.rotation).normalized();
      from = to;
      bent_[step.vertex] = follow * bent_[step.vertex];
    }
  }
  bent_[trail.end] = goal;
}

}  // namespace alces
