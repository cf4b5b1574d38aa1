// How far off the pose of an odometry can be: its covariance, carried along with it.
//
// What is wrong once is wrong all the way (scale of the way and of turns, bias of the rates), so it is part
// of the state: 11 numbers with the errors of the pose. Slip and a gyro's noise come anew. Where roll and
// pitch are not measured the vehicle is taken to stay level: it does not, by tilt_rad, and its height is off
// by what it has climbed.
//
// Cost: one product of 11 x 11 matrices a node.
#pragma once

#include <Eigen/Core>

#include "alces/pose.h"

namespace alces {

/// Standard deviations.
struct OdometryErrors {
  double way = 0.015;                        ///< share of the way: wheels that are larger than thought
  double slip = 0.01;                        ///< share of the way that comes and goes within seconds
  double turn = 0.005;                       ///< share of a turn: a gyro's scale, or the wheels' base
  double bias_rad_s = 5.235987755982989e-3;  ///< of the rates; while none was learned
  double noise_rad_per_sqrt_s = 3.490658503988659e-4;  ///< of the rates: 0.02 deg/s/sqrt(Hz)
  double tilt_rad = 5.235987755982989e-2;              ///< of the ground
};

class OdometryUncertainty {
 public:
  /// `measures_rate`: about the body's x, y, z; others are the wheels', or none.
  OdometryUncertainty(const OdometryErrors& errors, const Eigen::Array3i& measures_rate);

  /// The pose went on: by `way_m` along x and `rotation_rad`, in the body's axes of `before`.
  void add(const Pose& before, const Pose& after, const Eigen::Vector3d& rotation_rad, double duration_s);
  /// The rates' bias was measured for so long.
  void learn_bias(double duration_s);

  /// Of x, y, z, and the rotation about x, y, z, along the axes of the odometry's frame.
  [[nodiscard]] Matrix6d covariance() const;
  /// Of the bias about z.
  [[nodiscard]] double bias_rad_s() const;

 private:
  static constexpr int size = 11;  // place, rotation, scale of the way, of turns, bias about x, y, z
  using State = Eigen::Matrix<double, size, size>;

  OdometryErrors errors_;
  Eigen::Array3i measures_rate_;
  State covariance_ = State::Zero();
  double way_m_ = 0;
};

}  // namespace alces
