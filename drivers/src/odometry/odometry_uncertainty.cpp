#include "alces_drivers/odometry/odometry_uncertainty.h"

#include <algorithm>
#include <cmath>

namespace alces {
namespace {

constexpr int place = 0;
constexpr int turned = 3;
constexpr int way_scale = 6;
constexpr int turn_scale = 7;
constexpr int bias = 8;

constexpr double slip_s = 3;    ///< wheels slip alike for so long
constexpr double slope_m = 10;  ///< and the ground rises alike

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

double square(double value) {
  return value * value;
}

}  // namespace

OdometryUncertainty::OdometryUncertainty(const OdometryErrors& errors, const Eigen::Array3i& measures_rate)
    : errors_(errors), measures_rate_(measures_rate) {
  covariance_(way_scale, way_scale) = square(errors.way);
  covariance_(turn_scale, turn_scale) = square(errors.turn);
  for (int axis = 0; axis < 3; ++axis) {
    if (measures_rate[axis] != 0) covariance_(bias + axis, bias + axis) = square(errors.bias_rad_s);
  }
}

void OdometryUncertainty::add(const Pose& before, const Pose& after, const Eigen::Vector3d& rotation_rad,
                              double duration_s) {
  if (!(duration_s > 0)) return;
  const Eigen::Vector3d way_m = after.translation_m - before.translation_m;
  const Eigen::Matrix3d axes = before.rotation.toRotationMatrix();
  State step = State::Identity();
  step.block<3, 3>(place, turned) = -skew(way_m);
  step.block<3, 1>(place, way_scale) = way_m;
  step.block<3, 1>(turned, turn_scale) = axes * rotation_rad;
  step.block<3, 3>(turned, bias) = axes * duration_s;
  // Lazy: matrices of this size would go through Eigen's blocked product, which takes memory from the heap.
  const State carried = step.lazyProduct(covariance_);
  covariance_ = carried.lazyProduct(step.transpose());

  covariance_.block<3, 3>(place, place) +=
      square(errors_.slip) * 2 * slip_s / duration_s * (way_m * way_m.transpose());
  const double noise_rad2 = square(errors_.noise_rad_per_sqrt_s) * duration_s;
  for (int axis = 0; axis < 3; ++axis) {
    if (measures_rate_[axis] != 0)
      covariance_.block<3, 3>(turned, turned) += noise_rad2 * axes.col(axis) * axes.col(axis).transpose();
  }
  way_m_ += way_m.norm();
}

void OdometryUncertainty::learn_bias(double duration_s) {
  const double learned_rad_s = errors_.noise_rad_per_sqrt_s / std::sqrt(std::max(duration_s, 1e-3));
  for (int axis = 0; axis < 3; ++axis) {
    const int i = bias + axis;
    if (measures_rate_[axis] == 0 || covariance_(i, i) <= square(learned_rad_s)) continue;
    covariance_.row(i).setZero();
    covariance_.col(i).setZero();
    covariance_(i, i) = square(learned_rad_s);
  }
}

Matrix6d OdometryUncertainty::covariance() const {
  Matrix6d covariance = covariance_.topLeftCorner<6, 6>();
  if (measures_rate_[0] == 0 || measures_rate_[1] == 0) {
    const double tilt_rad2 = square(errors_.tilt_rad);
    covariance(2, 2) += tilt_rad2 * way_m_ * slope_m;
    covariance(3, 3) += tilt_rad2;
    covariance(4, 4) += tilt_rad2;
  }
  return covariance;
}

double OdometryUncertainty::bias_rad_s() const {
  return std::sqrt(covariance_(bias + 2, bias + 2));
}

}  // namespace alces
