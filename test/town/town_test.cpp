#include <Eigen/Eigenvalues>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "alces_platform/sim/drive.h"

using namespace alces;
using sim::Drive;
using sim::DriveSettings;

namespace {

DriveSettings small_drive(std::uint64_t seed = 1) {
  DriveSettings settings;
  settings.scans = 60;
  settings.seed = seed;
  return settings;
}

bool same(const std::vector<Point>& a, const std::vector<Point>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Point)) == 0);
}

double median(std::vector<double>& values) {
  REQUIRE(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Eigen::Vector3d vector(const Point& point) {
  return Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
}

// Pairs of scans at least 20 apart that are within 3 m of each other, counted once a run of neighbours.
std::size_t revisits(const Drive& drive) {
  std::size_t runs = 0;
  bool inside = false;
  for (std::size_t late = 20; late < drive.size(); ++late) {
    bool near = false;
    for (std::size_t early = 0; early + 20 <= late && !near; ++early)
      near = (drive.truth(late).translation_m - drive.truth(early).translation_m).norm() < 3;
    if (near && !inside) ++runs;
    inside = near;
  }
  return runs;
}

// Distances of points of `b` from planes through points of `a`, where `a` is flat. Brute force on a thinned
// scan.
std::vector<double> plane_residuals(const std::vector<Point>& a, const std::vector<Point>& b,
                                    const Pose& a_from_b) {
  std::vector<double> residuals;
  for (std::size_t i = 0; i < b.size(); i += 97) {
    const Eigen::Vector3d point = a_from_b * vector(b[i]);
    if (point.norm() > 15 || point.norm() < 2) continue;
    std::vector<Eigen::Vector3d> near;
    for (const Point& other : a) {
      const Eigen::Vector3d candidate = vector(other);
      if ((candidate - point).squaredNorm() < 0.4 * 0.4) near.push_back(candidate);
    }
    if (near.size() < 8) continue;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const auto& p : near) mean += p / static_cast<double>(near.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const auto& p : near) spread += (p - mean) * (p - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    if (solver.eigenvalues()(0) > 0.05 * solver.eigenvalues()(1)) continue;
    residuals.push_back(std::abs(solver.eigenvectors().col(0).dot(point - mean)));
  }
  return residuals;
}

}  // namespace

TEST_CASE("a drive is a function of its settings") {
  const Drive one = sim::drive(small_drive());
  const Drive again = sim::drive(small_drive());
  const Drive other = sim::drive(small_drive(2));
  REQUIRE(one.size() == 60);
  for (const std::size_t i : {std::size_t{41}, std::size_t{0}, std::size_t{17}}) {
    CHECK(same(one.points(i), again.points(i)));
    CHECK(one.truth(i).translation_m == again.truth(i).translation_m);
    CHECK(one.odometry(i).translation_m == again.odometry(i).translation_m);
    CHECK_FALSE(same(one.points(i), other.points(i)));
  }
}

TEST_CASE("truth and odometry start at the identity, the odometry is planar and drifts") {
  DriveSettings settings;
  settings.scans = 300;
  const Drive drive = sim::drive(settings);
  CHECK(drive.truth(0).translation_m.norm() == 0);
  CHECK(angle_between_rad(drive.truth(0).rotation, Eigen::Quaterniond::Identity()) < 1e-12);
  CHECK(drive.odometry(0).translation_m.norm() == 0);
  double worst_m = 0, tilt_rad = 0;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    CHECK(is_valid(drive.truth(i)));
    CHECK(drive.odometry(i).translation_m.z() == 0);
    worst_m = std::max(worst_m, (drive.odometry(i).translation_m - drive.truth(i).translation_m).norm());
    const Eigen::Vector3d up = drive.truth(i).rotation * Eigen::Vector3d::UnitZ();
    tilt_rad = std::max(tilt_rad, std::acos(std::clamp(up.z(), -1.0, 1.0)));
    if (i == 0) continue;
    const Pose step = drive.truth(i - 1).inverse() * drive.truth(i);
    CHECK(step.translation_m.norm() > 0.8);
    CHECK(step.translation_m.norm() < 1.9);
    const Pose odometry_step = drive.odometry(i - 1).inverse() * drive.odometry(i);
    CHECK((odometry_step.translation_m - step.translation_m).norm() < 0.3);
  }
  CHECK(worst_m > 1);
  CHECK(worst_m < 60);
  CHECK(tilt_rad > 0.03);
  CHECK(tilt_rad < 0.4);
}

TEST_CASE("drives of any length come back to where they were") {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    for (const std::size_t scans : {std::size_t{60}, std::size_t{300}, std::size_t{924}}) {
      DriveSettings settings;
      settings.seed = seed;
      settings.scans = scans;
      const Drive drive = sim::drive(settings);
      CAPTURE(seed, scans, drive.tour_length_m());
      REQUIRE(drive.size() == scans);
      CHECK(revisits(drive) >= (scans >= 924 ? 5u : 1u));
      if (scans == 924) {
        CHECK(drive.tour_length_m() > 1150);
        CHECK(drive.tour_length_m() < 1300);
      }
    }
  }
}

TEST_CASE("ranges are what the scanner can measure, and nothing stands in the vehicle's way") {
  DriveSettings settings;
  settings.scans = 924;
  const Drive drive = sim::drive(settings);
  std::vector<Point> points;
  for (std::size_t i = 0; i < drive.size(); i += 33) {
    drive.points(i, points);
    CAPTURE(i);
    CHECK(points.size() > drive.rays() / 4);
    CHECK(points.size() <= drive.rays());
    std::size_t in_the_way = 0;
    for (const Point& point : points) {
      REQUIRE(is_finite(point));
      const double range_m = (vector(point) - Eigen::Vector3d::UnitZ()).norm();
      REQUIRE(range_m < 40.01);
      REQUIRE(range_m > 0.2);
      if (std::hypot(point.x, point.y) < 0.6F && point.z > 0.3F && point.z < 1.8F) ++in_the_way;
    }
    CHECK(in_the_way < 5);
  }
}

TEST_CASE("scans agree at their true poses: walls and ground within the noise") {
  const Drive drive = sim::drive(small_drive());
  for (const std::size_t i : {std::size_t{5}, std::size_t{25}, std::size_t{40}}) {
    std::vector<double> residuals =
        plane_residuals(drive.points(i), drive.points(i + 1), drive.truth(i).inverse() * drive.truth(i + 1));
    CHECK(residuals.size() > 50);
    CHECK(median(residuals) < 0.015);  // noise of 15 mm along the ray
  }
}

TEST_CASE("two places that look alike, far from each other") {
  const sim::LookAlike alike = sim::look_alike_drive(4);
  const Drive& drive = alike.drive;
  const Pose& first = drive.truth(alike.first);
  const Pose& second = drive.truth(alike.second);
  CHECK((first.translation_m - second.translation_m).norm() > 300);
  CHECK(alike.first_from_second.translation_m.norm() < 1.5);
  CHECK(angle_between_rad(alike.first_from_second.rotation, Eigen::Quaterniond::Identity()) < 0.15);
  // They fit each other as well as neighbours do.
  std::vector<double> residuals =
      plane_residuals(drive.points(alike.first), drive.points(alike.second), alike.first_from_second);
  CHECK(residuals.size() > 50);
  CHECK(median(residuals) < 0.015);
}
