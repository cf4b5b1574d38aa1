#include "alces/pair_covariance.h"

#include <algorithm>

#include "alces/symmetric_solve.h"

namespace alces {
namespace {

constexpr double singular = 1e-9;  // least pivot of the scaled matrix: below, a direction is not determined

}  // namespace

PairCovariance appendix_a(const IcpSums& sums) {
  PairCovariance pair;
  if (sums.count < 3) return pair;
  const SymmetricSolver<6> solver(sums.mtm, singular);
  if (!solver.is_definite()) return pair;
  const Matrix6d inverse = solver.inverse();
  pair.residual = inverse * sums.mtz;
  const double squared_m2 = std::max(0.0, sums.ztz_m2 - pair.residual.dot(sums.mtz));
  pair.variance_m2 = squared_m2 / (2.0 * sums.count - 3.0);
  pair.covariance = pair.variance_m2 * inverse;
  pair.is_known = true;
  return pair;
}

PairCovariance from_curvature(const IcpResult& result, const IcpUncertainty& uncertainty,
                              const IcpPrior* prior) {
  PairCovariance pair;
  if (result.verdict == IcpVerdict::too_few_correspondences) return pair;
  const double variance_m2 = std::max(1e-6, result.rms_m * result.rms_m);
  // Information of match and prior: H (noise H + F)^-1 H, with H and F in units of the residuals' variance.
  Vector6d force = Vector6d::Constant(uncertainty.pull * result.correspondences / variance_m2);
  force.tail<3>() *= result.lever_m * result.lever_m;
  Matrix6d spread = uncertainty.noise * result.information;
  spread.diagonal() += force;
  Matrix6d information = result.information * SymmetricSolver<6>(spread).inverse() * result.information;
  if (prior != nullptr) {
    const Eigen::Vector3d& p = result.model_from_data.translation_m;
    Matrix6d place = Matrix6d::Identity();
    place.topRightCorner<3, 3>() << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0;
    information += place.transpose() * SymmetricSolver<6>(prior->covariance).inverse() * place;
  }
  const SymmetricSolver<6> solver(0.5 * (information + information.transpose()), singular);
  pair.is_known = solver.is_definite();
  pair.covariance = solver.inverse();
  pair.variance_m2 = result.rms_m * result.rms_m;
  return pair;
}

EdgeVariance edge_variance(const PairCovariance& pair, const Pose& model_from_data,
                           const EdgeUncertainty& uncertainty, double unknown_m, double unknown_rad) {
  if (!pair.is_known) {
    return {unknown_m * unknown_m, unknown_m * unknown_m, unknown_m * unknown_m,
            3 * unknown_rad * unknown_rad};
  }
  // A small rotation about the model's origin also moves the data's place: d(p) = t + w x p.
  const Eigen::Vector3d& p = model_from_data.translation_m;
  Eigen::Matrix<double, 3, 6> place;
  place << 1, 0, 0, 0, p.z(), -p.y(),  //
      0, 1, 0, -p.z(), 0, p.x(),       //
      0, 0, 1, p.y(), -p.x(), 0;
  const Eigen::Matrix3d axes = model_from_data.rotation.conjugate().toRotationMatrix();
  const Eigen::Vector3d translation_m2 =
      (axes * place * pair.covariance * place.transpose() * axes.transpose()).diagonal() *
      uncertainty.inflation;
  Eigen::Vector3d rotation_rad2 =
      (axes * pair.covariance.bottomRightCorner<3, 3>() * axes.transpose()).diagonal() *
      uncertainty.inflation;
  const double floor_m2 = uncertainty.minimum_translation_m * uncertainty.minimum_translation_m;
  const double floor_rad2 = uncertainty.minimum_rotation_rad * uncertainty.minimum_rotation_rad;
  rotation_rad2.array() += floor_rad2;
  const double all_rad2 = rotation_rad2.sum();
  return {translation_m2.x() + floor_m2,
          translation_m2.y() + floor_m2,
          translation_m2.z() + floor_m2,
          all_rad2,
          {rotation_rad2.x() / all_rad2, rotation_rad2.y() / all_rad2, rotation_rad2.z() / all_rad2}};
}

}  // namespace alces
