// Three sweeps of a hand-held lidar (Newer College, by gtsam_points' tests) beside what another program made
// of them. Its points lie in the IMU's frame at the time of the first point: turned by 180 deg about z and
// shifted. The motion did not come with them: it is that which the pairs of points give.
#include <Eigen/Cholesky>
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "alces/deskew.h"
#include "alces/horn.h"
#include "support/in_block.h"
#include "support/packed_data.h"

using namespace alces;
using namespace alces::test;

namespace {

struct NewerSweep {
  std::vector<Point> raw;
  std::vector<float> time_s;
  std::vector<Eigen::Vector3d> expected;  ///< in the lidar's frame at the first point's time
};

std::vector<float> floats(const std::filesystem::path& file) {
  std::vector<float> numbers(std::filesystem::file_size(file) / sizeof(float));
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(numbers.data()),
              static_cast<std::streamsize>(numbers.size() * sizeof(float)));
  REQUIRE(stream);
  return numbers;
}

NewerSweep read_sweep(const std::filesystem::path& folder, const std::string& number) {
  NewerSweep sweep;
  sweep.time_s = floats(folder / ("times_" + number + ".bin"));
  const std::vector<float> raw = floats(folder / ("raw_" + number + ".bin"));
  const std::vector<float> deskewed = floats(folder / ("deskewed_" + number + ".bin"));
  REQUIRE(raw.size() == 3 * sweep.time_s.size());
  REQUIRE(deskewed.size() == raw.size());
  const float first_s = *std::ranges::min_element(sweep.time_s);
  for (std::size_t i = 0; i < sweep.time_s.size(); ++i) {
    sweep.time_s[i] -= first_s;
    sweep.raw.push_back({raw[3 * i], raw[3 * i + 1], raw[3 * i + 2]});
    const Eigen::Vector3d p =
        Eigen::Vector3f(&deskewed[3 * i]).cast<double>() - Eigen::Vector3d(-0.006, 0.012, -0.029);
    sweep.expected.emplace_back(-p.x(), -p.y(), p.z());
  }
  return sweep;
}

Eigen::Vector3d vector(const Point& p) {
  return Eigen::Vector3f(p.x, p.y, p.z).cast<double>();
}

double median_error_m(const std::vector<Point>& points, const NewerSweep& sweep) {
  std::vector<double> errors_m;
  for (std::size_t i = 0; i < points.size(); ++i)
    errors_m.push_back((vector(points[i]) - sweep.expected[i]).norm());
  std::ranges::nth_element(errors_m, errors_m.begin() + static_cast<std::ptrdiff_t>(errors_m.size() / 2));
  return errors_m[errors_m.size() / 2];
}

/// Where the sensor was in the middle of each of `parts` equal times.
std::vector<std::pair<double, Pose>> motion_of_pairs(const NewerSweep& sweep, std::size_t parts) {
  const double last_s = static_cast<double>(*std::ranges::max_element(sweep.time_s)) + 1e-6;
  std::vector<HornSums> sums(parts);
  std::vector<double> time_sums(parts);
  for (std::size_t i = 0; i < sweep.raw.size(); ++i) {
    const auto part =
        static_cast<std::size_t>(static_cast<double>(sweep.time_s[i]) / last_s * static_cast<double>(parts));
    sums[part].add(sweep.expected[i], vector(sweep.raw[i]), 1);
    time_sums[part] += static_cast<double>(sweep.time_s[i]);
  }
  std::vector<std::pair<double, Pose>> motion;
  for (std::size_t part = 0; part < parts; ++part) {
    if (sums[part].weight > 50) motion.emplace_back(time_sums[part] / sums[part].weight, horn(sums[part]));
  }
  return motion;
}

double error_with_motion_m(const NewerSweep& sweep, const std::vector<std::pair<double, Pose>>& motion) {
  InBlock<Deskew> deskew(DeskewConfig{});
  for (const auto& [time_s, pose] : motion) REQUIRE(deskew->add_pose(time_s, pose) == DeskewStatus::ok);
  std::vector<Point> points = sweep.raw;
  REQUIRE(deskew->apply(points, sweep.time_s, 0) == DeskewStatus::ok);
  return median_error_m(points, sweep);
}

/// The constant motion that brings the points nearest to the expected ones, by Gauss and Newton.
Vector6d best_twist(const NewerSweep& sweep) {
  Vector6d twist = Vector6d::Zero();
  for (int iteration = 0; iteration < 10; ++iteration) {
    Matrix6d hessian = Matrix6d::Zero();
    Vector6d gradient = Vector6d::Zero();
    for (std::size_t i = 0; i < sweep.raw.size(); i += 10) {
      const double t = static_cast<double>(sweep.time_s[i]);
      const auto moved = [&](const Vector6d& per_s) { return exp_se3(per_s * t) * vector(sweep.raw[i]); };
      Eigen::Matrix<double, 3, 6> jacobian;
      constexpr double little = 1e-6;
      for (int k = 0; k < 6; ++k)
        jacobian.col(k) = (moved(twist + little * Vector6d::Unit(k)) - moved(twist)) / little;
      hessian += jacobian.transpose() * jacobian;
      gradient += jacobian.transpose() * (moved(twist) - sweep.expected[i]);
    }
    twist -= hessian.ldlt().solve(gradient);
  }
  return twist;
}

double error_with_twist_m(const NewerSweep& sweep, const Vector6d& twist_per_s) {
  InBlock<Deskew> deskew(DeskewConfig{});
  REQUIRE(deskew->set_twist(twist_per_s) == DeskewStatus::ok);
  std::vector<Point> points = sweep.raw;
  REQUIRE(deskew->apply(points, sweep.time_s, 0) == DeskewStatus::ok);
  return median_error_m(points, sweep);
}

}  // namespace

TEST_CASE("three sweeps of a hand-held lidar come out as another program deskewed them") {
  if (!has_packed_data("deskew")) return;
  const UnpackedData data("deskew");
  const std::filesystem::path folder = data.path() / "gtsam_points" / "newer_06";
  for (const char* number : {"00", "01", "02"}) {
    CAPTURE(number);
    const NewerSweep sweep = read_sweep(folder, number);
    const double skewed_m = median_error_m(sweep.raw, sweep);
    const double in_parts_m = error_with_motion_m(sweep, motion_of_pairs(sweep, 32));
    const double constant_m = error_with_twist_m(sweep, best_twist(sweep));
    CHECK(skewed_m > 2 * constant_m);
    CHECK(constant_m < 0.15);
    CHECK(in_parts_m < 0.03);
  }
}
