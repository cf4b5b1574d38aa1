// Sums over the correspondences of one iteration of ICP: what is minimised, and what Appendix A needs.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "alces/horn.h"
#include "alces/icp.h"
#include "geometry/float_transform.h"

namespace alces {

// Normal equations J^T W J x = J^T W e, x = (translation, rotation vector), J = [ I | -[q]x ] or its part
// along a normal. Rows are summed in float, four lanes at a time, and carried into double before float loses
// digits.
class NormalEquations {
 public:
  void add_plane(const Point& q, const Point& n, float error_m, float weight) {
    const Point turn = cross(q, n);
    const Lanes low = {n.x, n.y, n.z, turn.x};
    const Lanes high = {turn.y, turn.z, error_m, 0};
    const Lanes weighted_low = weight * low;
    const Lanes weighted_high = weight * high;
    for (int row = 0; row < 4; ++row) {
      low_[row] += weighted_low[row] * low;
      high_[row] += weighted_low[row] * high;
    }
    for (int row = 4; row < 6; ++row) {
      low_[row] += weighted_high[row - 4] * low;
      high_[row] += weighted_high[row - 4] * high;
    }
    if (++pending_ == carry_after) carry();
  }
  void add_point(const Point& q, const Point& error_m, float weight) {
    add_plane(q, {1, 0, 0}, error_m.x, weight);
    add_plane(q, {0, 1, 0}, error_m.y, weight);
    add_plane(q, {0, 0, 1}, error_m.z, weight);
  }
  void carry() {
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column < 4; ++column) h_(row, column) += static_cast<double>(low_[row][column]);
      for (int column = 4; column < 6; ++column)
        h_(row, column) += static_cast<double>(high_[row][column - 4]);
      b_[row] += static_cast<double>(high_[row][2]);
      low_[row] = Lanes{};
      high_[row] = Lanes{};
    }
    pending_ = 0;
  }
  /// Both after carry().
  [[nodiscard]] Matrix6d matrix() const { return 0.5 * (h_ + h_.transpose()); }
  [[nodiscard]] const Vector6d& right_side() const { return b_; }

 private:
  typedef float Lanes __attribute__((vector_size(16)));
  static constexpr std::uint32_t carry_after = 32;
  Lanes low_[6] = {};   // of each row: columns 0 to 3
  Lanes high_[6] = {};  // columns 4, 5 and the right side
  std::uint32_t pending_ = 0;
  Matrix6d h_ = Matrix6d::Zero();
  Vector6d b_ = Vector6d::Zero();
};

// Weighted sums over correspondences of whole points: what Horn's closed form needs, and the same normal
// equations as rows of points would give, in the time of one row instead of three. Summed as there.
class PointSums {
 public:
  void add(const Point& q, const Point& error_m, float weight) {
    const Lanes place = {q.x, q.y, q.z, 1};
    const Lanes error = {error_m.x, error_m.y, error_m.z, 0};
    const Lanes weighted = weight * place;
    for (int row = 0; row < 4; ++row) {
      place_[row] += weighted[row] * place;
      error_[row] += weighted[row] * error;
    }
    if (++pending_ == carry_after) carry();
  }
  void carry() {
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column)
        places_(row, column) += static_cast<double>(place_[row][column]);
      for (int column = 0; column < 3; ++column)
        errors_(row, column) += static_cast<double>(error_[row][column]);
      place_[row] = Lanes{};
      error_[row] = Lanes{};
    }
    pending_ = 0;
  }
  /// All after carry(). Sums of w (target, q); target = q + error.
  [[nodiscard]] HornSums pairs() const {
    const Eigen::Vector3d place = places_.bottomLeftCorner<1, 3>().transpose();
    return {places_(3, 3), place + errors_.row(3).transpose(), place,
            places_.topLeftCorner<3, 3>() + errors_.topRows<3>()};
  }
  [[nodiscard]] Matrix6d matrix() const {  // rows [ I | -[q]x ]
    const Eigen::Matrix3d products = places_.topLeftCorner<3, 3>();
    const double x = places_(3, 0);
    const double y = places_(3, 1);
    const double z = places_(3, 2);
    Eigen::Matrix3d cross_sum;
    cross_sum << 0, -z, y, z, 0, -x, -y, x, 0;
    Matrix6d h;
    h.topLeftCorner<3, 3>() = places_(3, 3) * Eigen::Matrix3d::Identity();
    h.bottomLeftCorner<3, 3>() = cross_sum;
    h.topRightCorner<3, 3>() = -cross_sum;
    h.bottomRightCorner<3, 3>() = products.trace() * Eigen::Matrix3d::Identity() - products;
    return h;
  }
  [[nodiscard]] Vector6d right_side() const {  // the torque q x e is the antisymmetric part of q e^T
    Vector6d b;
    b << errors_.row(3).transpose(), errors_(1, 2) - errors_(2, 1), errors_(2, 0) - errors_(0, 2),
        errors_(0, 1) - errors_(1, 0);
    return b;
  }

 private:
  typedef float Lanes __attribute__((vector_size(16)));
  static constexpr std::uint32_t carry_after = 32;
  Lanes place_[4] = {};  // of w (q, 1) (q, 1)^T
  Lanes error_[4] = {};  // of w (q, 1) (error, 0)^T
  std::uint32_t pending_ = 0;
  Eigen::Matrix4d places_ = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 4, 3> errors_ = Eigen::Matrix<double, 4, 3>::Zero();
};

// Moments of the correspondences, from which Appendix A's sums follow.
struct Moments {
  std::uint32_t count = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  double products[6] = {};  // xx xy xz yy yz zz of the points
  double squared_m2 = 0;

  void add(const Point& q, const Point& error_m) {
    ++count;
    point += as_vector(q);
    residual += as_vector(error_m);
    torque += as_vector(cross(q, error_m));
    const float terms[6] = {q.x * q.x, q.x * q.y, q.x * q.z, q.y * q.y, q.y * q.z, q.z * q.z};
    for (int i = 0; i < 6; ++i) products[i] += static_cast<double>(terms[i]);
    squared_m2 += static_cast<double>(dot(error_m, error_m));
  }
  [[nodiscard]] IcpSums sums() const {  // rows M_i = [ I | -[q]x ]
    IcpSums sums;
    sums.count = count;
    sums.mtz << residual, torque;
    sums.ztz_m2 = squared_m2;
    Eigen::Matrix3d cross_sum;
    cross_sum << 0, -point.z(), point.y(), point.z(), 0, -point.x(), -point.y(), point.x(), 0;
    Eigen::Matrix3d product_sum;
    product_sum << products[0], products[1], products[2], products[1], products[3], products[4], products[2],
        products[4], products[5];
    sums.mtm.topLeftCorner<3, 3>() = count * Eigen::Matrix3d::Identity();
    sums.mtm.bottomLeftCorner<3, 3>() = cross_sum;
    sums.mtm.topRightCorner<3, 3>() = -cross_sum;
    sums.mtm.bottomRightCorner<3, 3>() = product_sum.trace() * Eigen::Matrix3d::Identity() - product_sum;
    return sums;
  }
};

}  // namespace alces
