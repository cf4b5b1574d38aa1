// Solves small symmetric positive definite systems by L D L^T: fixed size, no pivoting, no allocation
// (Eigen's general decompositions drag in its heap-backed kernels). The matrix is scaled to a unit diagonal
// first, so that metres and radians may share it.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace alces {

template <int Size>
class SymmetricSolver {
 public:
  using Matrix = Eigen::Matrix<double, Size, Size>;
  using Vector = Eigen::Matrix<double, Size, 1>;

  explicit SymmetricSolver(const Matrix& matrix, double smallest_pivot = 1e-12) {
    for (int i = 0; i < Size; ++i) {
      if (!(matrix(i, i) > 0)) return;
      scale_[i] = 1.0 / std::sqrt(matrix(i, i));
    }
    l_.setIdentity();
    for (int c = 0; c < Size; ++c) {
      double pivot = 1.0;  // the scaled diagonal
      for (int k = 0; k < c; ++k) pivot -= l_(c, k) * l_(c, k) * d_[k];
      if (!(pivot > smallest_pivot)) return;
      d_[c] = pivot;
      for (int r = c + 1; r < Size; ++r) {
        double sum = matrix(r, c) * scale_[r] * scale_[c];
        for (int k = 0; k < c; ++k) sum -= l_(r, k) * l_(c, k) * d_[k];
        l_(r, c) = sum / pivot;
      }
    }
    is_definite_ = true;
  }

  /// False: a diagonal entry or a pivot is not above its limit; solve() and inverse() then give zeros.
  [[nodiscard]] bool is_definite() const { return is_definite_; }

  [[nodiscard]] Vector solve(const Vector& right_side) const {
    if (!is_definite_) return Vector::Zero();
    Vector x;
    for (int r = 0; r < Size; ++r) {
      x[r] = right_side[r] * scale_[r];
      for (int k = 0; k < r; ++k) x[r] -= l_(r, k) * x[k];
    }
    for (int r = Size - 1; r >= 0; --r) {
      x[r] /= d_[r];
      for (int k = r + 1; k < Size; ++k) x[r] -= l_(k, r) * x[k];
    }
    return x.cwiseProduct(scale_);
  }

  [[nodiscard]] Matrix inverse() const {
    Matrix inverted;
    for (int c = 0; c < Size; ++c) inverted.col(c) = solve(Vector::Unit(c));
    return 0.5 * (inverted + inverted.transpose());
  }

 private:
  Matrix l_;
  Vector d_;
  Vector scale_;
  bool is_definite_ = false;
};

}  // namespace alces
