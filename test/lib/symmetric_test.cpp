#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "alces/symmetric_eigen.h"
#include "alces/symmetric_solve.h"
#include "alces_platform/sim/random.h"

using namespace alces;
using alces::sim::Random;

namespace {

template <int Size>
using Matrix = Eigen::Matrix<double, Size, Size>;
template <int Size>
using Vector = Eigen::Matrix<double, Size, 1>;

template <int Size>
Matrix<Size> random_matrix(Random& random) {
  Matrix<Size> m;
  for (int i = 0; i < Size * Size; ++i) m(i / Size, i % Size) = random.uniform(-1, 1);
  return m;
}

template <int Size>
Matrix<Size> with_spectrum(Random& random, const Vector<Size>& values) {
  const Matrix<Size> q = Eigen::HouseholderQR<Matrix<Size>>(random_matrix<Size>(random)).householderQ();
  const Matrix<Size> a = q * values.asDiagonal() * q.transpose();
  return 0.5 * (a + a.transpose());
}

template <int Size>
void check_eigen(const Matrix<Size>& a) {
  const SymmetricEigen<Size> ours = symmetric_eigen<Size>(a);
  const Eigen::SelfAdjointEigenSolver<Matrix<Size>> theirs(a);
  const double scale = std::max(a.cwiseAbs().maxCoeff(), 1e-300);
  CAPTURE(a);
  CHECK((ours.values - theirs.eigenvalues()).cwiseAbs().maxCoeff() < 1e-13 * Size * scale);
  CHECK((ours.vectors.transpose() * ours.vectors - Matrix<Size>::Identity()).cwiseAbs().maxCoeff() < 1e-13);
  const Matrix<Size> residual = a * ours.vectors - ours.vectors * ours.values.asDiagonal();
  CHECK(residual.cwiseAbs().maxCoeff() < 1e-13 * Size * scale);
  for (int i = 1; i < Size; ++i) CHECK(ours.values[i - 1] <= ours.values[i]);
}

template <int Size>
Matrix<Size> positive(Random& random, double condition) {
  Vector<Size> values;
  for (int i = 0; i < Size; ++i) values[i] = std::pow(condition, -random.uniform());
  return with_spectrum<Size>(random, values);
}

}  // namespace

TEST_CASE("in single precision eigenvalues and eigenvectors are those of double precision, to rounding") {
  Random random(4);
  for (int round = 0; round < 300; ++round) {
    // As of a plane's points: wide, narrower, nearly flat.
    const Matrix<3> exact =
        with_spectrum<3>(random, {1e-6 * random.uniform(), random.uniform(0.01, 0.1), 1.0});
    const Eigen::Matrix3f a = exact.cast<float>();
    const SymmetricEigen<3, float> ours = symmetric_eigen<3, float>(a);
    const SymmetricEigen<3> same = symmetric_eigen<3>(a.cast<double>());
    CAPTURE(a);
    CHECK((ours.values.cast<double>() - same.values).cwiseAbs().maxCoeff() < 1e-6);
    CHECK((ours.vectors.transpose() * ours.vectors - Eigen::Matrix3f::Identity()).cwiseAbs().maxCoeff() <
          1e-6F);
    CHECK(1 - std::abs(ours.vectors.col(0).cast<double>().dot(same.vectors.col(0))) < 1e-6);
  }
}

TEST_CASE("eigenvalues and eigenvectors are those of Eigen's solver") {
  Random random(1);
  for (int round = 0; round < 300; ++round) {
    const Matrix<3> a = random_matrix<3>(random);
    const Matrix<4> b = random_matrix<4>(random);
    const Matrix<6> c = random_matrix<6>(random);
    check_eigen<3>(a + a.transpose());
    check_eigen<4>(b + b.transpose());
    check_eigen<6>(std::pow(10.0, random.uniform(-12, 12)) * (c + c.transpose()));
  }
}

TEST_CASE("repeated, zero and widely spread eigenvalues are found") {
  Random random(2);
  check_eigen<6>(Matrix<6>::Identity());
  check_eigen<6>(Matrix<6>::Zero());
  check_eigen<6>(-3 * Matrix<6>::Identity());
  check_eigen<6>(Matrix<6>::Ones());
  check_eigen<4>(Eigen::Vector4d(3, -1, 2, -1).asDiagonal());
  for (int round = 0; round < 30; ++round) {
    check_eigen<6>(with_spectrum<6>(random, {0, 0, 0, 0, 0, 5}));
    check_eigen<6>(with_spectrum<6>(random, {1, 1, 1, 2, 2, 2}));
    check_eigen<6>(with_spectrum<6>(random, {-1, -1, 0, 0, 1, 1}));
    check_eigen<6>(with_spectrum<6>(random, {1e-12, 1e-6, 1, 1e3, 1e6, 1e9}));
    check_eigen<6>(with_spectrum<6>(random, {1, 1, 1, 1, 1, 1 + 1e-14}));
    check_eigen<4>(with_spectrum<4>(random, {-2, -2, -2, 6}));
  }
}

TEST_CASE("a definite system is solved as Eigen's LDLT solves it") {
  Random random(3);
  for (int round = 0; round < 300; ++round) {
    const Matrix<6> a = positive<6>(random, 1e4);
    const Vector<6> b = random_matrix<6>(random).col(0);
    const SymmetricSolver<6> solver(a);
    REQUIRE(solver.is_definite());
    const Vector<6> theirs = a.ldlt().solve(b);
    CHECK((solver.solve(b) - theirs).norm() < 1e-10 * theirs.norm());
    CHECK((solver.inverse() * a - Matrix<6>::Identity()).cwiseAbs().maxCoeff() < 1e-9);
    CHECK(solver.inverse() == solver.inverse().transpose());
  }
}

TEST_CASE("metres and radians of any size may share a system") {
  Random random(4);
  for (int round = 0; round < 100; ++round) {
    const Matrix<6> a = positive<6>(random, 100);
    Vector<6> unit;
    unit << 1e6, 1e6, 1e6, 1e-6, 1e-6, 1e-6;
    const Matrix<6> scaled = unit.asDiagonal() * a * unit.asDiagonal();
    const SymmetricSolver<6> solver(scaled);
    REQUIRE(solver.is_definite());
    const Vector<6> x = random_matrix<6>(random).col(0);
    const Vector<6> b = scaled * unit.cwiseInverse().cwiseProduct(x);
    CHECK((unit.cwiseProduct(solver.solve(b)) - x).norm() < 1e-9);
  }
}

TEST_CASE("a system that is singular, indefinite or no number is refused, and solved to zeros") {
  Random random(5);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Matrix<6> with_nan = Matrix<6>::Identity();
  with_nan(4, 2) = with_nan(2, 4) = nan;
  Matrix<6> nan_diagonal = Matrix<6>::Identity();
  nan_diagonal(3, 3) = nan;
  Matrix<6> zero_diagonal = Matrix<6>::Identity();
  zero_diagonal(5, 5) = 0;
  const std::vector<Matrix<6>> refused = {Matrix<6>::Zero(),
                                          Matrix<6>::Ones(),
                                          -Matrix<6>::Identity(),
                                          with_nan,
                                          nan_diagonal,
                                          zero_diagonal,
                                          with_spectrum<6>(random, {0, 1, 1, 2, 2, 3}),
                                          with_spectrum<6>(random, {-1, 1, 1, 2, 2, 3}),
                                          with_spectrum<6>(random, {1e-15, 1, 1, 2, 2, 3})};
  for (const Matrix<6>& a : refused) {
    CAPTURE(a);
    const SymmetricSolver<6> solver(a);
    CHECK_FALSE(solver.is_definite());
    CHECK(solver.solve(Vector<6>::Ones()).isZero(0));
    CHECK(solver.inverse().isZero(0));
  }
  const Matrix<6> weak = with_spectrum<6>(random, {1e-7, 1, 1, 2, 2, 3});
  CHECK(SymmetricSolver<6>(weak).is_definite());
  CHECK_FALSE(SymmetricSolver<6>(weak, 1e-5).is_definite());
}
