#include "alces/held_directions.h"

#include <Eigen/Core>

#include "alces/symmetric_eigen.h"

namespace alces {

HeldDirections held_directions(const IcpResult& match) {
  HeldDirections held;
  if (match.correspondences == 0 || !(match.lever_m > 0)) return held;
  // A small motion in the body's axes about its place, as one in the model's about the model's origin.
  const Eigen::Matrix3d axes = match.model_from_data.rotation.toRotationMatrix();
  const Eigen::Vector3d& p = match.model_from_data.translation_m;
  Eigen::Matrix3d lever;
  lever << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0;
  Matrix6d model_from_body = Matrix6d::Zero();
  model_from_body.topLeftCorner<3, 3>() = axes;
  model_from_body.topRightCorner<3, 3>() = -lever * axes / match.lever_m;
  model_from_body.bottomRightCorner<3, 3>() = axes / match.lever_m;
  const double variance_m2 = std::max(1e-6, match.rms_m * match.rms_m);  // as in IcpResult::information
  const Matrix6d squares = variance_m2 / match.correspondences *
                           (model_from_body.transpose() * match.information * model_from_body);
  // Share i is 1 over entry i,i of the inverse. By eigenvalues: a direction that is not held takes only those
  // with it that lie along it.
  const SymmetricEigen<6> directions = symmetric_eigen<6>(squares);
  constexpr double least = 1e-9;
  Vector6d inverse = Vector6d::Zero();
  for (int k = 0; k < 6; ++k)
    inverse += directions.vectors.col(k).cwiseAbs2() / std::max(least, directions.values[k]);
  const auto share = [&inverse](int i) { return static_cast<float>(std::min(1.0, 1.0 / inverse[i])); };
  held = {share(0), share(1), share(2), share(3), share(4), share(5)};
  return held;
}

}  // namespace alces
