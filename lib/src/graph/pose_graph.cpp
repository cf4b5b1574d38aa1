#include "alces/pose_graph.h"

#include <algorithm>
#include <cmath>

namespace alces {
namespace {

bool is_variance(double value) {
  return std::isfinite(value) && value > 0;
}

// What all axes have in common is not turned: where they are alike costs stay so to the last bit, and LOA's
// shortest ways are the same for x, y and z.
Eigen::Matrix3d turned(const Eigen::Vector3d& along_axes, const Eigen::Quaterniond& turn) {
  const double common = along_axes.minCoeff();
  const Eigen::Vector3d beyond = along_axes - Eigen::Vector3d::Constant(common);
  const Eigen::Matrix3d axes = turn.toRotationMatrix();
  Eigen::Matrix3d covariance = axes * beyond.asDiagonal() * axes.transpose();
  covariance.diagonal().array() += common;
  return covariance;
}

}  // namespace

Eigen::Matrix3d translation_covariance(const EdgeVariance& variance, const Eigen::Quaterniond& axes_from_to) {
  return turned({variance.x_m2, variance.y_m2, variance.z_m2}, axes_from_to);
}

Eigen::Matrix3d rotation_covariance(const EdgeVariance& variance, const Eigen::Quaterniond& axes_from_to) {
  const std::array<double, 3>& share = variance.rotation_shares;
  return turned(variance.rotation_rad2 * Eigen::Vector3d(share[0], share[1], share[2]), axes_from_to);
}

Status PoseGraph::add_vertex(const Pose& map_from_body) {
  if (!is_valid(map_from_body)) return Status::bad_pose;
  if (vertex_count_ == poses_.size()) return Status::no_scan_capacity;
  poses_[vertex_count_] = map_from_body;
  first_half_edge_[vertex_count_] = no_index;
  degree_[vertex_count_] = 0;
  ++vertex_count_;
  return Status::ok;
}

Status PoseGraph::check_edge(const Edge& edge) const {
  if (edge.from >= vertex_count_ || edge.to >= vertex_count_) return Status::no_such_vertex;
  const EdgeVariance& v = edge.variance;
  const bool usable =
      is_variance(v.x_m2) && is_variance(v.y_m2) && is_variance(v.z_m2) && is_variance(v.rotation_rad2);
  if (edge.from == edge.to || !usable) return Status::bad_edge;
  if (!is_valid(edge.from_from_to)) return Status::bad_pose;
  if (edge_count_ == edges_.size()) return Status::no_edge_capacity;
  return Status::ok;
}

Status PoseGraph::add_edge(const Edge& edge) {
  const Status status = check_edge(edge);
  if (status != Status::ok) return status;
  edges_[edge_count_] = edge;
  const std::uint32_t ends[2] = {edge.from, edge.to};
  for (std::uint32_t side = 0; side < 2; ++side) {
    const std::uint32_t half_edge = 2 * edge_count_ + side;
    next_half_edge_[half_edge] = first_half_edge_[ends[side]];
    first_half_edge_[ends[side]] = half_edge;
    ++degree_[ends[side]];
  }
  ++edge_count_;
  return Status::ok;
}

}  // namespace alces
