// ELCH's sharing out with 4x4 matrices, as algorithms.md section 3, items 3 to 6, puts it, and the
// uncertainty of a chain by numerical differentiation: slow and on the heap, for the tests.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "alces/pose.h"
#include "alces/pose_graph.h"
#include "support/plain_loop_optimizer.h"

namespace alces::test {

/// Every vertex's pose after the loop f..l was closed with l at `map_from_l`.
inline std::vector<Eigen::Matrix4d> plain_share(const PoseGraph& graph, std::uint32_t f, std::uint32_t l,
                                                const Eigen::Matrix4d& map_from_l) {
  std::vector<Eigen::Matrix4d> poses;
  for (const Pose& pose : graph.poses()) poses.push_back(pose.matrix());
  const Eigen::Matrix4d p_f = poses[f];
  const Eigen::Matrix4d delta = p_f.inverse() * map_from_l * poses[l].inverse() * p_f;  // item 3

  std::array<std::vector<double>, 4> w;  // item 4, along the axes of f, as delta is
  for (std::size_t cost = 0; cost < 4; ++cost) {
    std::vector<PlainEdge> edges;
    for (const Edge& edge : graph.edges()) {
      const EdgeVariance& v = edge.variance;
      const Eigen::Matrix3d turn =
          p_f.topLeftCorner<3, 3>().transpose() * poses[edge.to].topLeftCorner<3, 3>();
      double along_f = 0;
      if (cost < 3) {
        const Eigen::RowVector3d axis = turn.row(static_cast<Eigen::Index>(cost));
        along_f = axis.x() * axis.x() * v.x_m2 + axis.y() * axis.y() * v.y_m2 + axis.z() * axis.z() * v.z_m2;
      }
      edges.push_back({edge.from, edge.to, cost < 3 ? along_f : v.rotation_rad2});
    }
    w[cost] = PlainLoopOptimizer(graph.vertex_count(), edges).weights(f, l);
  }

  std::vector<Eigen::Matrix4d> shares;  // item 5
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(delta.topLeftCorner<3, 3>()));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Eigen::Matrix4d share = Eigen::Matrix4d::Identity();
    share.topLeftCorner<3, 3>() = Eigen::AngleAxisd(w[3][i] * turn.angle(), turn.axis()).toRotationMatrix();
    for (int axis = 0; axis < 3; ++axis) {
      share(axis, 3) = w[static_cast<std::size_t>(axis)][i] * delta(axis, 3);
    }
    shares.push_back(share);
  }
  std::vector<Eigen::Matrix4d> bent;  // item 6
  for (std::size_t i = 0; i < poses.size(); ++i) {
    bent.push_back(p_f * shares[0].inverse() * shares[i] * p_f.inverse() * poses[i]);
  }
  return bent;
}

/// A chain of places, each edge of which may shift what follows by (x, y, z), along the axes of the place it
/// leads to, and turn it about that place: six numbers an edge. Edge j leads from places[j] to places[j + 1].
struct PlainChain {
  std::vector<Pose> places;
  std::vector<EdgeVariance> variances;

  [[nodiscard]] std::vector<Pose> bend(const Eigen::VectorXd& parts) const {
    std::vector<Pose> bent = places;
    for (std::size_t j = 0; j < variances.size(); ++j) {
      const auto at = static_cast<Eigen::Index>(6 * j);
      const Eigen::Quaterniond turn = exp_so3(parts.segment<3>(at + 3));
      const Eigen::Vector3d pivot = bent[j + 1].translation_m;
      const Eigen::Vector3d shift = bent[j + 1].rotation * Eigen::Vector3d(parts.segment<3>(at));
      for (std::size_t i = j + 1; i < bent.size(); ++i) {
        bent[i].translation_m = turn * (bent[i].translation_m - pivot) + pivot + shift;
        bent[i].rotation = (turn * bent[i].rotation).normalized();
      }
    }
    return bent;
  }

  [[nodiscard]] Eigen::VectorXd variance() const {
    Eigen::VectorXd all(6 * static_cast<Eigen::Index>(variances.size()));
    for (std::size_t j = 0; j < variances.size(); ++j) {
      const EdgeVariance& v = variances[j];
      const double r = v.rotation_rad2 / 3;
      all.segment<6>(static_cast<Eigen::Index>(6 * j)) << v.x_m2, v.y_m2, v.z_m2, r, r, r;
    }
    return all;
  }

  /// (translation, rotation vector) that takes `from` to `to`.
  [[nodiscard]] static Vector6d offset(const Pose& from, const Pose& to) {
    Vector6d result;
    result << to.translation_m - from.translation_m, log_so3(to.rotation * from.rotation.conjugate());
    return result;
  }

  /// How the end moves with the parts, by central differences about `parts`.
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::VectorXd& parts) const {
    constexpr double step = 1e-5;
    const Pose end = bend(parts).back();
    Eigen::MatrixXd result(6, parts.size());
    for (Eigen::Index i = 0; i < parts.size(); ++i) {
      Eigen::VectorXd up = parts;
      Eigen::VectorXd down = parts;
      up[i] += step;
      down[i] -= step;
      result.col(i) = (offset(end, bend(up).back()) - offset(end, bend(down).back())) / (2 * step);
    }
    return result;
  }

  /// Of the end against the beginning: (translation, rotation vector).
  [[nodiscard]] Matrix6d covariance() const {
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(6 * static_cast<Eigen::Index>(variances.size()));
    const Eigen::MatrixXd j = jacobian(zero);
    return j * variance().asDiagonal() * j.transpose();
  }

  /// Squared Mahalanobis length of moving the end to `goal`, where a match says that it lies.
  [[nodiscard]] double mahalanobis2(const Pose& goal, const EdgeVariance& match) const {
    Matrix6d both = covariance();
    const double r = match.rotation_rad2 / 3;
    const Eigen::Matrix3d axes = goal.rotation.toRotationMatrix();
    both.topLeftCorner<3, 3>() +=
        axes * Eigen::Vector3d(match.x_m2, match.y_m2, match.z_m2).asDiagonal() * axes.transpose();
    both.diagonal().tail<3>().array() += r;
    const Vector6d e = offset(places.back(), goal);
    return e.dot(both.ldlt().solve(e));
  }

  /// The most likely parts that bring the end to `goal`: Gauss-Newton on the constrained weighted least
  /// squares.
  [[nodiscard]] Eigen::VectorXd most_likely(const Pose& goal) const {
    const Eigen::VectorXd w = variance();
    Eigen::VectorXd parts = Eigen::VectorXd::Zero(w.size());
    for (int round = 0; round < 20; ++round) {
      const Eigen::MatrixXd j = jacobian(parts);
      const Vector6d missing = offset(bend(parts).back(), goal) + Vector6d(j * parts);
      const Matrix6d s = j * w.asDiagonal() * j.transpose();
      parts = w.asDiagonal() * j.transpose() * s.ldlt().solve(missing);
    }
    return parts;
  }
};

}  // namespace alces::test
