#include "alces/horn.h"

#include "alces/symmetric_eigen.h"

namespace alces {

Pose horn(const HornSums& sums) {
  const Eigen::Vector3d model_mean = sums.model / sums.weight;
  const Eigen::Vector3d data_mean = sums.data / sums.weight;
  const Eigen::Matrix3d s = sums.data_model / sums.weight - data_mean * model_mean.transpose();
  Eigen::Matrix4d n;
  n << s(0, 0) + s(1, 1) + s(2, 2), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0),  //
      0, s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2),                   //
      0, 0, -s(0, 0) + s(1, 1) - s(2, 2), s(1, 2) + s(2, 1),                                  //
      0, 0, 0, -s(0, 0) - s(1, 1) + s(2, 2);
  n.triangularView<Eigen::StrictlyLower>() = n.transpose();
  const Eigen::Vector4d q = symmetric_eigen<4>(n).vectors.col(3);
  Pose model_from_data;
  model_from_data.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
  model_from_data.translation_m = model_mean - model_from_data.rotation * data_mean;
  return model_from_data;
}

}  // namespace alces
