#include "alces/pair_covariance.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "support/plain_scene.h"

using namespace alces;
using namespace alces::test;
using alces::sim::Random;

namespace {

struct Pairs {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> residuals;
};

Pairs pairs(std::uint64_t seed, int count, double spread_m) {
  Random random(seed);
  Pairs result;
  for (int i = 0; i < count; ++i) {
    result.points.emplace_back(random.uniform(-spread_m, spread_m), random.uniform(-spread_m, spread_m),
                               random.uniform(-1, 3));
    result.residuals.emplace_back(0.02 + 0.03 * random.normal(), 0.03 * random.normal(),
                                  0.001 * result.points.back().x() + 0.03 * random.normal());
  }
  return result;
}

Eigen::Matrix<double, 3, 6> row(const Eigen::Vector3d& p) {  // [ I | -[p]x ]
  Eigen::Matrix<double, 3, 6> m;
  m << 1, 0, 0, 0, p.z(), -p.y(),  //
      0, 1, 0, -p.z(), 0, p.x(),   //
      0, 0, 1, p.y(), -p.x(), 0;
  return m;
}

IcpSums sums_of(const Pairs& pairs) {
  IcpSums sums;
  for (std::size_t i = 0; i < pairs.points.size(); ++i) {
    ++sums.count;
    sums.mtm += row(pairs.points[i]).transpose() * row(pairs.points[i]);
    sums.mtz += row(pairs.points[i]).transpose() * pairs.residuals[i];
    sums.ztz_m2 += pairs.residuals[i].squaredNorm();
  }
  return sums;
}

Matrix6d random_covariance(std::uint64_t seed) {
  Random random(seed);
  Matrix6d a;
  for (int i = 0; i < 36; ++i) a(i / 6, i % 6) = random.uniform(-0.1, 0.1);
  a.bottomRows<3>() *= 0.05;
  return a * a.transpose() + 1e-8 * Matrix6d::Identity();
}

}  // namespace

TEST_CASE("Appendix A from sums equals the stacked computation") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Pairs given = pairs(seed, 50 + 40 * static_cast<int>(seed), 20);
    const auto m = static_cast<Eigen::Index>(given.points.size());
    Eigen::MatrixXd stacked(3 * m, 6);
    Eigen::VectorXd z(3 * m);
    for (Eigen::Index i = 0; i < m; ++i) {
      stacked.middleRows<3>(3 * i) = row(given.points[static_cast<std::size_t>(i)]);
      z.segment<3>(3 * i) = given.residuals[static_cast<std::size_t>(i)];
    }
    const Eigen::VectorXd e = stacked.colPivHouseholderQr().solve(z);
    const double variance_m2 = (z - stacked * e).squaredNorm() / (2.0 * static_cast<double>(m) - 3.0);
    const Matrix6d covariance = variance_m2 * (stacked.transpose() * stacked).inverse();

    const PairCovariance pair = appendix_a(sums_of(given));
    REQUIRE(pair.is_known);
    CHECK((pair.residual - e).norm() < 1e-9 * e.norm());
    CHECK(pair.variance_m2 == Approx(variance_m2).epsilon(1e-9));
    CHECK((pair.covariance - covariance).norm() < 1e-9 * covariance.norm());
    for (int i = 0; i < 6; ++i) CHECK(pair.covariance(i, i) == Approx(covariance(i, i)).epsilon(1e-9));
  }
}

TEST_CASE("residuals that one motion explains leave no variance") {
  Pairs given = pairs(3, 100, 10);
  Vector6d motion;
  motion << 0.1, -0.2, 0.05, 0.01, 0.02, -0.015;
  for (std::size_t i = 0; i < given.points.size(); ++i) given.residuals[i] = row(given.points[i]) * motion;
  const PairCovariance pair = appendix_a(sums_of(given));
  REQUIRE(pair.is_known);
  CHECK((pair.residual - motion).norm() < 1e-12);
  CHECK(pair.variance_m2 >= 0);
  CHECK(pair.variance_m2 < 1e-15);
}

TEST_CASE("a covariance is unknown with too few points or with all of them on a line") {
  CHECK_FALSE(appendix_a(IcpSums{}).is_known);
  CHECK_FALSE(appendix_a(sums_of(pairs(1, 2, 5))).is_known);
  CHECK(appendix_a(sums_of(pairs(1, 4, 5))).is_known);
  Pairs on_a_line = pairs(1, 50, 5);
  for (std::size_t i = 0; i < 50; ++i)
    on_a_line.points[i] = static_cast<double>(i) * Eigen::Vector3d(1, 2, -1);
  CHECK_FALSE(appendix_a(sums_of(on_a_line)).is_known);
}

TEST_CASE("from the curvature, the covariance of independent errors is its inverse") {
  const Matrix6d covariance = random_covariance(5);
  IcpResult result;
  result.verdict = IcpVerdict::converged;
  result.information = covariance.inverse();
  result.rms_m = 0.03;
  const IcpUncertainty independent{.noise = 1, .pull = 0};
  const PairCovariance pair = from_curvature(result, independent);
  REQUIRE(pair.is_known);
  CHECK((pair.covariance - covariance).norm() < 1e-8 * covariance.norm());
  CHECK(pair.variance_m2 == Approx(0.0009));

  result.verdict = IcpVerdict::too_few_correspondences;
  CHECK_FALSE(from_curvature(result, independent).is_known);
  result.verdict = IcpVerdict::converged;
  result.information.row(2).setZero();
  result.information.col(2).setZero();
  CHECK_FALSE(from_curvature(result, independent).is_known);
}

TEST_CASE("errors that pairs have in common widen a covariance, the more the fewer pairs hold a direction") {
  IcpResult result;
  result.verdict = IcpVerdict::converged;
  result.rms_m = 0.02;
  result.lever_m = 5;
  result.correspondences = 1000;
  Vector6d held;
  held << 800, 150, 10, 20000, 20000, 20000;  // of squares: m, m, m, rad, rad, rad
  const double variance_m2 = result.rms_m * result.rms_m;
  result.information = (held / variance_m2).asDiagonal();
  const PairCovariance alone = from_curvature(result, {.noise = 2, .pull = 0});
  const PairCovariance pulled = from_curvature(result, {.noise = 2, .pull = 0.1});
  REQUIRE(alone.is_known);
  REQUIRE(pulled.is_known);
  for (int i = 0; i < 6; ++i) {
    // C = s^2 H^-1 (noise H + pull n diag(1, 1, 1, L^2, L^2, L^2)) H^-1
    const double force = 0.1 * 1000 * (i < 3 ? 1 : 25);
    CHECK(alone.covariance(i, i) == Approx(2 * variance_m2 / held[i]));
    CHECK(pulled.covariance(i, i) == Approx(variance_m2 * (2 * held[i] + force) / (held[i] * held[i])));
  }
}

TEST_CASE(
    "a prior counts in a covariance beside the match, and alone where the match leaves a direction open") {
  IcpResult result;
  result.verdict = IcpVerdict::degenerate;
  result.rms_m = 0.02;
  result.correspondences = 1000;
  Vector6d held;
  held << 0, 300, 600, 20000, 20000, 20000;
  result.information = (held / (result.rms_m * result.rms_m)).asDiagonal();
  CHECK_FALSE(from_curvature(result, {}).is_known);
  IcpPrior prior;
  prior.covariance.diagonal() << 0.04, 0.04, 0.04, 0.01, 0.01, 0.01;
  const PairCovariance with = from_curvature(result, {}, &prior);
  REQUIRE(with.is_known);
  CHECK(with.covariance(0, 0) == Approx(0.04).epsilon(1e-3));
  CHECK(with.covariance(1, 1) < 0.01);

  SECTION("at the place of the data: a turn about the model's origin moves it by its lever") {
    result.model_from_data = pose_at(3, 4, 0, 0);
    result.information.setZero();
    const PairCovariance far = from_curvature(result, {}, &prior);
    REQUIRE(far.is_known);
    const EdgeUncertainty exact{1, 1e-9, 1e-9};
    const EdgeVariance edge = edge_variance(far, result.model_from_data, exact);
    CHECK(edge.x_m2 == Approx(0.04).epsilon(1e-6));
    CHECK(edge.y_m2 == Approx(0.04).epsilon(1e-6));
    CHECK(edge.rotation_rad2 == Approx(0.03).epsilon(1e-6));
  }
}

TEST_CASE("an edge's variances are those of the data's place, along the axes of its body") {
  for (std::uint64_t seed = 1; seed < 10; ++seed) {
    Random random(seed);
    PairCovariance pair;
    pair.is_known = true;
    pair.covariance = random_covariance(seed);
    const Pose model_from_data = pose_at(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-1, 1),
                                         random.uniform(-180, 180), 10, -20);
    EdgeUncertainty uncertainty{2.5, 0.01, 0.002};
    const EdgeVariance edge = edge_variance(pair, model_from_data, uncertainty);

    // Numerically: where the data's place goes when the match is perturbed.
    Eigen::Matrix<double, 3, 6> jacobian;
    constexpr double step = 1e-6;
    for (int i = 0; i < 6; ++i) {
      Pose moved;
      moved.translation_m = step * Vector6d::Unit(i).head<3>();
      moved.rotation = exp_so3(step * Vector6d::Unit(i).tail<3>());
      jacobian.col(i) =
          model_from_data.rotation.conjugate() *
          ((moved * model_from_data.translation_m - model_from_data.translation_m) / step).eval();
    }
    const Eigen::Matrix3d translation = 2.5 * jacobian * pair.covariance * jacobian.transpose();
    CHECK(edge.x_m2 == Approx(translation(0, 0) + 1e-4).epsilon(1e-4));
    CHECK(edge.y_m2 == Approx(translation(1, 1) + 1e-4).epsilon(1e-4));
    CHECK(edge.z_m2 == Approx(translation(2, 2) + 1e-4).epsilon(1e-4));
    CHECK(edge.rotation_rad2 ==
          Approx(2.5 * pair.covariance.bottomRightCorner<3, 3>().trace() + 3 * 0.002 * 0.002).epsilon(1e-9));
  }
}

TEST_CASE("a quarter turn between two scans exchanges the axes of their edge") {
  PairCovariance pair;
  pair.is_known = true;
  Vector6d diagonal;
  diagonal << 1e-2, 1e-4, 1e-6, 0, 0, 0;
  pair.covariance = diagonal.asDiagonal();
  const EdgeUncertainty exact{1, 0, 0};
  const EdgeVariance edge = edge_variance(pair, pose_at(5, 0, 0, 90), exact);
  CHECK(edge.x_m2 == Approx(1e-4));
  CHECK(edge.y_m2 == Approx(1e-2));
  CHECK(edge.z_m2 == Approx(1e-6));
}

TEST_CASE("a small turn at a long lever is a shift across it") {
  PairCovariance pair;
  pair.is_known = true;
  Vector6d diagonal;
  diagonal << 0, 0, 0, 0, 0, 1e-4;
  pair.covariance = diagonal.asDiagonal();
  const EdgeUncertainty exact{1, 0, 0};
  const EdgeVariance edge = edge_variance(pair, pose_at(10, 0, 0, 0), exact);
  CHECK(edge.x_m2 == Approx(0).margin(1e-15));
  CHECK(edge.y_m2 == Approx(1e-2));
  CHECK(edge.rotation_rad2 == Approx(1e-4));
}

TEST_CASE("an edge is never surer than the floor, and an unknown one takes the unknown's variances") {
  PairCovariance sure;
  sure.is_known = true;
  const EdgeUncertainty uncertainty{1, 0.005, 0.001};
  const EdgeVariance floor = edge_variance(sure, Pose{}, uncertainty);
  CHECK(floor.x_m2 == Approx(25e-6));
  CHECK(floor.rotation_rad2 == Approx(3e-6));

  const EdgeVariance unknown = edge_variance({}, Pose{}, uncertainty, 2, 0.1);
  CHECK(unknown.x_m2 == Approx(4));
  CHECK(unknown.y_m2 == Approx(4));
  CHECK(unknown.z_m2 == Approx(4));
  CHECK(unknown.rotation_rad2 == Approx(0.03));
}
