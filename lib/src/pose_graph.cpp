#include "alces/pose_graph.h"

#include <algorithm>
#include <cmath>

namespace alces {
namespace {

bool is_variance(double value) {
  return std::isfinite(value) && value > 0;
}

}  // namespace

Eigen::Matrix3d translation_covariance(const EdgeVariance& variance, const Eigen::Quaterniond& axes_from_to) {
  // What all axes have in common is not turned: where they are alike costs stay so to the last bit, and LOA's
  // shortest ways are the same for x, y and z.
  const double common_m2 = std::min({variance.x_m2, variance.y_m2, variance.z_m2});
  const Eigen::Vector3d beyond_m2(variance.x_m2 - common_m2, variance.y_m2 - common_m2,
                                  variance.z_m2 - common_m2);
  const Eigen::Matrix3d turn = axes_from_to.toRotationMatrix();
  Eigen::Matrix3d covariance_m2 = turn * beyond_m2.asDiagonal() * turn.transpose();
  covariance_m2.diagonal().array() += common_m2;
  return covariance_m2;
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
