// Eigenvalues and eigenvectors of a small symmetric matrix by cyclic Jacobi rotations: fixed size, no
// allocation, bounded sweeps, exact to rounding (Eigen's general solver drags in its heap-backed kernels).
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <type_traits>

namespace alces {

template <int Size, typename Scalar = double>
struct SymmetricEigen {
  Eigen::Matrix<Scalar, Size, 1> values;      ///< ascending
  Eigen::Matrix<Scalar, Size, Size> vectors;  ///< columns, in the order of the values
};

template <int Size, typename Scalar = double>
[[nodiscard]] SymmetricEigen<Size, Scalar> symmetric_eigen(
    std::type_identity_t<Eigen::Matrix<Scalar, Size, Size>> a) {
  SymmetricEigen<Size, Scalar> result;
  result.vectors.setIdentity();
  constexpr int most_sweeps = 30;  // convergence is quadratic: a handful is enough
  constexpr Scalar negligible =
      static_cast<Scalar>(sizeof(Scalar) == 8 ? 1e-30 : 1e-14);  // a share of squares
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    Scalar off_diagonal = 0;
    Scalar diagonal = 0;
    for (int c = 0; c < Size; ++c) {
      diagonal += a(c, c) * a(c, c);
      for (int r = c + 1; r < Size; ++r) off_diagonal += a(r, c) * a(r, c);
    }
    if (!(off_diagonal > negligible * diagonal)) break;
    for (int p = 0; p < Size; ++p) {
      for (int q = p + 1; q < Size; ++q) {
        if (a(q, p) == 0) continue;
        const Scalar theta = (a(q, q) - a(p, p)) / (2 * a(q, p));
        const Scalar t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const Scalar cosine = 1 / std::sqrt(t * t + 1);
        const Scalar sine = t * cosine;
        for (int k = 0; k < Size; ++k) {  // columns p and q
          const Scalar kp = a(k, p);
          const Scalar kq = a(k, q);
          a(k, p) = cosine * kp - sine * kq;
          a(k, q) = sine * kp + cosine * kq;
        }
        for (int k = 0; k < Size; ++k) {  // rows p and q
          const Scalar pk = a(p, k);
          const Scalar qk = a(q, k);
          a(p, k) = cosine * pk - sine * qk;
          a(q, k) = sine * pk + cosine * qk;
        }
        for (int k = 0; k < Size; ++k) {
          const Scalar kp = result.vectors(k, p);
          const Scalar kq = result.vectors(k, q);
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
