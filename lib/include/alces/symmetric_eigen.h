// Eigenvalues and eigenvectors of a small symmetric matrix by cyclic Jacobi rotations: fixed size, no
// allocation, bounded sweeps, exact to rounding (Eigen's general solver drags in its heap-backed kernels).
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace alces {

template <int Size>
struct SymmetricEigen {
  Eigen::Matrix<double, Size, 1> values;      ///< ascending
  Eigen::Matrix<double, Size, Size> vectors;  ///< columns, in the order of the values
};

template <int Size>
[[nodiscard]] SymmetricEigen<Size> symmetric_eigen(Eigen::Matrix<double, Size, Size> a) {
  SymmetricEigen<Size> result;
  result.vectors.setIdentity();
  constexpr int most_sweeps = 30;  // convergence is quadratic: a handful is enough
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    double off_diagonal = 0;
    double diagonal = 0;
    for (int c = 0; c < Size; ++c) {
      diagonal += a(c, c) * a(c, c);
      for (int r = c + 1; r < Size; ++r) off_diagonal += a(r, c) * a(r, c);
    }
    if (!(off_diagonal > 1e-30 * diagonal)) break;
    for (int p = 0; p < Size; ++p) {
      for (int q = p + 1; q < Size; ++q) {
        if (a(q, p) == 0) continue;
        const double theta = (a(q, q) - a(p, p)) / (2 * a(q, p));
        const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double cosine = 1 / std::sqrt(t * t + 1);
        const double sine = t * cosine;
        for (int k = 0; k < Size; ++k) {  // columns p and q
          const double kp = a(k, p);
          const double kq = a(k, q);
          a(k, p) = cosine * kp - sine * kq;
          a(k, q) = sine * kp + cosine * kq;
        }
        for (int k = 0; k < Size; ++k) {  // rows p and q
          const double pk = a(p, k);
          const double qk = a(q, k);
          a(p, k) = cosine * pk - sine * qk;
          a(q, k) = sine * pk + cosine * qk;
        }
        for (int k = 0; k < Size; ++k) {
          const double kp = result.vectors(k, p);
          const double kq = result.vectors(k, q);
          result.vectors(k, p) = cosine * kp - sine * kq;
          result.vectors(k, q) = sine * kp + cosine * kq;
        }
      }
    }
  }
  result.values = a.diagonal();
  for (int i = 1; i < Size; ++i) {  // insertion sort
    for (int j = i; j > 0 && result.values[j] < result.values[j - 1]; --j) {
      std::swap(result.values[j], result.values[j - 1]);
      result.vectors.col(j).swap(result.vectors.col(j - 1));
    }
  }
  return result;
}

}  // namespace alces
