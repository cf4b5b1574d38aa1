// A pose graph as optimisers on the desk see it: poses, relative measurements, and their full information.
//
// One struct for 3D and for planar graphs: a planar graph has z = roll = pitch = 0 everywhere, and its
// optimisers keep it so. Errors and chi-squared are g2o's, so that figures compare with published ones:
//   3D:     e = (t, q_v) of measured^-1 * from_from_to, q_v the vector part of the unit quaternion with
//           q_w >= 0 (EDGE_SE3:QUAT); rows of `information` are x, y, z, qx, qy, qz.
//   planar: e = (x, y, theta) of the same (EDGE_SE2); `planar_information` has rows x, y, theta.
// chi-squared = sum of e^T information e.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "alces/pose.h"

namespace alces::offline {

struct ConstraintVertex {
  std::int64_t id = 0;  ///< the file's number; positions in `vertices` are what constraints speak of
  Pose map_from_body;
  bool is_fixed = false;
};

struct Constraint {
  std::uint32_t from = 0;  ///< positions in ConstraintGraph::vertices
  std::uint32_t to = 0;
  Pose from_from_to;  ///< the measurement
  Matrix6d information = Matrix6d::Identity();
  Eigen::Matrix3d planar_information = Eigen::Matrix3d::Identity();  ///< of a planar graph only
};

struct ConstraintGraph {
  bool is_planar = false;
  std::vector<ConstraintVertex> vertices;
  std::vector<Constraint> constraints;  ///< in the order of the file or the drive
};

/// The error of one constraint: 6 numbers, or 3 and three zeros of a planar graph (x, y, theta first).
[[nodiscard]] Vector6d constraint_error(const ConstraintGraph& graph, const Constraint& constraint);
/// e^T information e of one constraint, and of all.
[[nodiscard]] double chi_squared(const ConstraintGraph& graph, const Constraint& constraint);
[[nodiscard]] double chi_squared(const ConstraintGraph& graph);

}  // namespace alces::offline
