#include "alces/pose.h"

#include <cmath>

#include "alces/portable_math.h"

namespace alces {
namespace {

// Columns: where 3DTK's axes (x right, y up, z forward) lie in ours (x forward, y left, z up).
Eigen::Matrix3d axes_from_3dtk() {
  Eigen::Matrix3d axes;
  axes << 0, 0, 1,  //
      -1, 0, 0,     //
      0, 1, 0;
  return axes;
}

constexpr double cm_per_m = 100.0;

// Rotation matrix as slam6d writes it: R = R_x(theta_x) R_y(theta_y) R_z(theta_z).
Eigen::Matrix3d euler_matrix_3dtk(const Eigen::Vector3d& euler_rad) {
  return (exp_so3({euler_rad.x(), 0, 0}) * exp_so3({0, euler_rad.y(), 0}) * exp_so3({0, 0, euler_rad.z()}))
      .toRotationMatrix();
}

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace

Pose Pose::inverse() const {
  Pose inverted;
  inverted.rotation = rotation.conjugate();
  inverted.translation_m = -(inverted.rotation * translation_m);
  return inverted;
}

Eigen::Matrix4d Pose::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation_m;
  return m;
}

Pose Pose::from_matrix(const Eigen::Matrix4d& matrix) {
  Pose pose;
  pose.rotation = Eigen::Quaterniond(Eigen::Matrix3d(matrix.topLeftCorner<3, 3>())).normalized();
  pose.translation_m = matrix.topRightCorner<3, 1>();
  return pose;
}

Pose operator*(const Pose& a_from_b, const Pose& b_from_c) {
  Pose a_from_c;
  a_from_c.rotation = (a_from_b.rotation * b_from_c.rotation).normalized();
  a_from_c.translation_m = a_from_b.rotation * b_from_c.translation_m + a_from_b.translation_m;
  return a_from_c;
}

Eigen::Vector3d operator*(const Pose& a_from_b, const Eigen::Vector3d& point_b) {
  return a_from_b.rotation * point_b + a_from_b.translation_m;
}

bool is_valid(const Pose& pose) {
  return pose.translation_m.allFinite() && pose.translation_m.cwiseAbs().maxCoeff() <= farthest_place_m &&
         pose.rotation.coeffs().allFinite() && std::abs(pose.rotation.norm() - 1.0) < 1e-3;
}

double angle_between_rad(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond difference = a.conjugate() * b;
  return 2.0 * portable::atan2(difference.vec().norm(), std::abs(difference.w()));
}

Eigen::Quaterniond exp_so3(const Eigen::Vector3d& rotation_vector_rad) {
  const double squared_rad2 = rotation_vector_rad.squaredNorm();
  double cosine = 1.0 - squared_rad2 / 8.0 + squared_rad2 * squared_rad2 / 384.0;
  double scale = 0.5 - squared_rad2 / 48.0 + squared_rad2 * squared_rad2 / 3840.0;  // sin(a/2) / a
  if (squared_rad2 > 1e-4) {  // below, the series are exact to the last bit, and need no root
    const double angle_rad = std::sqrt(squared_rad2);
    const auto half = portable::sine_cosine(0.5 * angle_rad);
    cosine = half.cosine;
    scale = half.sine / angle_rad;
  }
  const Eigen::Vector3d v = scale * rotation_vector_rad;
  return Eigen::Quaterniond(cosine, v.x(), v.y(), v.z());
}

Eigen::Vector3d log_so3(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * rotation.vec();
  const double sine = v.norm();
  const double angle_rad = 2.0 * portable::atan2(sine, sign * rotation.w());
  return sine > 1e-9 ? Eigen::Vector3d(angle_rad / sine * v) : Eigen::Vector3d(2.0 * v);
}

Eigen::Quaterniond slerp_from_identity(double fraction, const Eigen::Quaterniond& rotation) {
  return exp_so3(fraction * log_so3(rotation));
}

Pose interpolate(const Pose& from, const Pose& to, double fraction) {
  Pose between;
  between.rotation =
      (from.rotation * slerp_from_identity(fraction, from.rotation.conjugate() * to.rotation)).normalized();
  between.translation_m = (1.0 - fraction) * from.translation_m + fraction * to.translation_m;
  return between;
}

Pose exp_se3(const Vector6d& twist) {
  const Eigen::Vector3d rotation_vector_rad = twist.tail<3>();
  const double angle_rad = rotation_vector_rad.norm();
  const Eigen::Matrix3d w = skew(rotation_vector_rad);
  double b = 0.5 - angle_rad * angle_rad / 24.0;         // (1 - cos a) / a^2
  double c = 1.0 / 6.0 - angle_rad * angle_rad / 120.0;  // (a - sin a) / a^3
  if (angle_rad > 1e-4) {
    const auto [sine, cosine] = portable::sine_cosine(angle_rad);
    b = (1.0 - cosine) / (angle_rad * angle_rad);
    c = (angle_rad - sine) / (angle_rad * angle_rad * angle_rad);
  }
  Pose pose;
  pose.rotation = exp_so3(rotation_vector_rad);
  pose.translation_m = (Eigen::Matrix3d::Identity() + b * w + c * w * w) * twist.head<3>();
  return pose;
}

Vector6d log_se3(const Pose& pose) {
  const Eigen::Vector3d rotation_vector_rad = log_so3(pose.rotation);
  const double angle_rad = rotation_vector_rad.norm();
  const Eigen::Matrix3d w = skew(rotation_vector_rad);
  // (1 - a sin a / (2 (1 - cos a))) / a^2
  double d = 1.0 / 12.0 + angle_rad * angle_rad / 720.0;
  if (angle_rad > 1e-4) {
    const double half = 0.5 * angle_rad;
    const auto [sine, cosine] = portable::sine_cosine(half);
    d = (1.0 - half * cosine / sine) / (angle_rad * angle_rad);
  }
  Vector6d twist;
  twist.head<3>() = (Eigen::Matrix3d::Identity() - 0.5 * w + d * w * w) * pose.translation_m;
  twist.tail<3>() = rotation_vector_rad;
  return twist;
}

Eigen::Matrix4d matrix_3dtk(const Pose& pose) {
  const Eigen::Matrix3d axes = axes_from_3dtk();
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = axes.transpose() * pose.rotation.toRotationMatrix() * axes;
  m.topRightCorner<3, 1>() = cm_per_m * (axes.transpose() * pose.translation_m);
  return m;
}

Pose from_matrix_3dtk(const Eigen::Matrix4d& matrix_cm) {
  const Eigen::Matrix3d axes = axes_from_3dtk();
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = axes * matrix_cm.topLeftCorner<3, 3>() * axes.transpose();
  m.topRightCorner<3, 1>() = axes * matrix_cm.topRightCorner<3, 1>() / cm_per_m;
  return Pose::from_matrix(m);
}

Pose from_3dtk(const Pose3dtk& pose) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = euler_matrix_3dtk(pose.euler_rad);
  m.topRightCorner<3, 1>() = pose.position_cm;
  return from_matrix_3dtk(m);
}

Pose3dtk to_3dtk(const Pose& pose) {
  const Eigen::Matrix4d m = matrix_3dtk(pose);
  Pose3dtk converted;
  converted.position_cm = m.topRightCorner<3, 1>();
  // R = R_x R_y R_z: m02 = sin y, m12 = -sin x cos y, m22 = cos x cos y, m01 = -cos y sin z, m00 = cos y cos
  // z
  const double cos_y = portable::hypot(m(0, 0), m(0, 1));
  converted.euler_rad.y() = portable::atan2(m(0, 2), cos_y);
  if (cos_y > 1e-9) {
    converted.euler_rad.x() = portable::atan2(-m(1, 2), m(2, 2));
    converted.euler_rad.z() = portable::atan2(-m(0, 1), m(0, 0));
  } else {  // gimbal lock: the first angle carries both
    converted.euler_rad.x() = portable::atan2(m(2, 1), m(1, 1));
    converted.euler_rad.z() = 0;
  }
  return converted;
}

}  // namespace alces
