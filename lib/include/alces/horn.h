// The best rigid transform between paired points in closed form, from sums alone (Horn, 1987: unit
// quaternions; paper, appendix A.1). Cost: a 4x4 eigenvalue problem.
#pragma once

#include <Eigen/Core>

#include "alces/pose.h"

namespace alces {

/// The rigid transform that minimises sum w ||m - (R d + t)||^2 from weighted sums (Horn, 1987): the largest
/// eigenvector of the 4x4 matrix built from the cross-covariance.
struct HornSums {
  double weight = 0;
  Eigen::Vector3d model = Eigen::Vector3d::Zero();
  Eigen::Vector3d data = Eigen::Vector3d::Zero();
  Eigen::Matrix3d data_model = Eigen::Matrix3d::Zero();  ///< sum w d m^T
  void add(const Eigen::Vector3d& m, const Eigen::Vector3d& d, double w) {
    weight += w;
    model += w * m;
    data += w * d;
    data_model += w * d * m.transpose();
  }
};
[[nodiscard]] Pose horn(const HornSums& sums);

}  // namespace alces
