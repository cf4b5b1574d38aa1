// The one rigid transform of the project: unit quaternion and translation, double precision, metres.
//
// Name variables by what they map: `map_from_body` takes body coordinates to map coordinates, and
// `map_from_a * a_from_b == map_from_b`. Frames are REP 103's: right-handed, x forward, y left, z up.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "alces/point.h"

namespace alces {

struct Pose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();

  [[nodiscard]] Pose inverse() const;
  [[nodiscard]] Eigen::Matrix4d matrix() const;

  /// From the upper 3x4 part, whose rotation may carry the rounding of a text file (it is renormalised).
  [[nodiscard]] static Pose from_matrix(const Eigen::Matrix4d& matrix);
};

/// a_from_c = a_from_b * b_from_c; the result's quaternion is normalised.
[[nodiscard]] Pose operator*(const Pose& a_from_b, const Pose& b_from_c);
[[nodiscard]] Eigen::Vector3d operator*(const Pose& a_from_b, const Eigen::Vector3d& point_b);

/// Farther from its frame's origin is no place on Earth: what a pose with such a translation is made of is
/// broken, and arithmetic with it would lose the millimetres or overflow.
inline constexpr double farthest_place_m = 1e9;

/// Finite, no farther than farthest_place_m, and a quaternion within 1e-3 of unit length.
[[nodiscard]] bool is_valid(const Pose& pose);

/// Angle of the rotation that takes one orientation to the other, in [0, pi].
[[nodiscard]] double angle_between_rad(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

/// The fraction of the shorter rotation from identity to `rotation`; `fraction` may leave [0, 1].
[[nodiscard]] Eigen::Quaterniond slerp_from_identity(double fraction, const Eigen::Quaterniond& rotation);

/// Between two poses of one body in one frame: translation linear, rotation by slerp along the shorter way.
/// fraction 0: `from`, 1: `to`; beyond, it goes on.
[[nodiscard]] Pose interpolate(const Pose& from, const Pose& to, double fraction);

/// Exponential map of SE(3), twist = (translation part, rotation vector), and its inverse.
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
[[nodiscard]] Pose exp_se3(const Vector6d& twist);
[[nodiscard]] Vector6d log_se3(const Pose& pose);
[[nodiscard]] Eigen::Quaterniond exp_so3(const Eigen::Vector3d& rotation_vector_rad);
[[nodiscard]] Eigen::Vector3d log_so3(const Eigen::Quaterniond& rotation);

/// 3DTK's pose: left-handed frame (x right, y up, z forward), cm, Euler angles in rad with
/// R = R_x R_y R_z as slam6d's EulerToMatrix4 writes it; to and from our right-handed metres.
/// A point (x, y, z) of 3DTK is (z, -x, y) / 100 here.
struct Pose3dtk {
  Eigen::Vector3d position_cm = Eigen::Vector3d::Zero();
  Eigen::Vector3d euler_rad = Eigen::Vector3d::Zero();
};
[[nodiscard]] Pose from_3dtk(const Pose3dtk& pose);
[[nodiscard]] Pose3dtk to_3dtk(const Pose& pose);

/// The 4x4 matrix of 3DTK's left-handed frame in centimetres (its .frames files hold it column by column).
[[nodiscard]] Eigen::Matrix4d matrix_3dtk(const Pose& pose);
[[nodiscard]] Pose from_matrix_3dtk(const Eigen::Matrix4d& matrix_cm);

}  // namespace alces
