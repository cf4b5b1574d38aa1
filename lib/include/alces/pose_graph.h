// The pose graph as arrays: a vertex per scan, an edge per matched pair, adjacency as linked lists of
// half-edges. Capacity is fixed; inserting is O(1); nothing is ever removed (ELCH needs no removal).
//
// Half-edge 2e leaves the edge's `from`, half-edge 2e+1 its `to`: h ^ 1 is the other side of h.
// Memory: 72 bytes a vertex, 144 bytes an edge.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "alces/arena.h"
#include "alces/pose.h"
#include "alces/status.h"

namespace alces {

inline constexpr std::uint32_t no_index = UINT32_MAX;

/// How sure an edge is: three translation variances (m^2) of the place of its `to`, along the axes of that
/// scan's body, and the summed rotation variances (rad^2). All are positive and finite. Whichever way the map
/// lies or is turned later, they say the same.
struct EdgeVariance {
  double x_m2 = 1;
  double y_m2 = 1;
  double z_m2 = 1;
  double rotation_rad2 = 1;
  /// Of rotation_rad2, about each of these axes: what a chain of edges can be off by depends on it, for a
  /// scanner of few rings knows its heading ten times better than its tilt. LOA does not ask. They sum to 1.
  std::array<double, 3> rotation_shares = {1.0 / 3, 1.0 / 3, 1.0 / 3};
};

/// Covariance (m^2) of the translation along other axes; `axes_from_to` turns the body of `to` into them.
[[nodiscard]] Eigen::Matrix3d translation_covariance(const EdgeVariance& variance,
                                                     const Eigen::Quaterniond& axes_from_to);
/// The same of the rotation, rad^2.
[[nodiscard]] Eigen::Matrix3d rotation_covariance(const EdgeVariance& variance,
                                                  const Eigen::Quaterniond& axes_from_to);

struct Edge {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  bool closes_loop = false;
  EdgeVariance variance;
  Pose from_from_to;  ///< the match: pose of `to` seen from `from`
};

class PoseGraph {
 public:
  struct Capacity {
    std::uint32_t vertices = 0;
    std::uint32_t edges = 0;
  };

  constexpr PoseGraph(Arena& arena, const Capacity& capacity)
      : poses_(arena.allocate<Pose>(capacity.vertices)),
        first_half_edge_(arena.allocate<std::uint32_t>(capacity.vertices)),
        degree_(arena.allocate<std::uint32_t>(capacity.vertices)),
        edges_(arena.allocate<Edge>(capacity.edges)),
        next_half_edge_(arena.allocate<std::uint32_t>(2 * std::size_t{capacity.edges})) {}

  /// Appends a vertex. no_scan_capacity, bad_pose.
  [[nodiscard]] Status add_vertex(const Pose& map_from_body);

  /// Joins two existing vertices; several edges between the same two are allowed.
  /// no_such_vertex, bad_edge, bad_pose, no_edge_capacity.
  [[nodiscard]] Status add_edge(const Edge& edge);

  /// What add_edge() would answer; adds nothing.
  [[nodiscard]] Status check_edge(const Edge& edge) const;

  [[nodiscard]] std::uint32_t vertex_count() const { return vertex_count_; }
  [[nodiscard]] std::uint32_t edge_count() const { return edge_count_; }
  [[nodiscard]] std::uint32_t vertex_capacity() const { return static_cast<std::uint32_t>(poses_.size()); }
  [[nodiscard]] std::uint32_t edge_capacity() const { return static_cast<std::uint32_t>(edges_.size()); }

  /// map_from_body of every vertex, in order; writable, because closing a loop bends them all.
  [[nodiscard]] std::span<Pose> poses() { return poses_.first(vertex_count_); }
  [[nodiscard]] std::span<const Pose> poses() const { return poses_.first(vertex_count_); }
  [[nodiscard]] std::span<const Edge> edges() const { return edges_.first(edge_count_); }

  [[nodiscard]] std::uint32_t degree(std::uint32_t vertex) const { return degree_[vertex]; }

  /// First half-edge that leaves `vertex`, or no_index; then next_half_edge() until no_index.
  [[nodiscard]] std::uint32_t first_half_edge(std::uint32_t vertex) const { return first_half_edge_[vertex]; }
  [[nodiscard]] std::uint32_t next_half_edge(std::uint32_t half_edge) const {
    return next_half_edge_[half_edge];
  }
  /// The vertex that `half_edge` leads to; its edge is edges()[half_edge / 2].
  [[nodiscard]] std::uint32_t target(std::uint32_t half_edge) const {
    const Edge& edge = edges_[half_edge / 2];
    return (half_edge & 1) == 0 ? edge.to : edge.from;
  }

 private:
  std::span<Pose> poses_;
  std::span<std::uint32_t> first_half_edge_;
  std::span<std::uint32_t> degree_;
  std::span<Edge> edges_;
  std::span<std::uint32_t> next_half_edge_;
  std::uint32_t vertex_count_ = 0;
  std::uint32_t edge_count_ = 0;
};

}  // namespace alces
