#include "alces/deskew.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

#include "support/in_block.h"

using namespace alces;
using namespace alces::test;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

struct Sweep {
  std::vector<Point> points;
  std::vector<float> time_s;
};

/// Points all around, over a tenth of a second.
Sweep sweep(std::size_t count = 2000) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-30, 30);
  Sweep made;
  for (std::size_t i = 0; i < count; ++i) {
    made.points.push_back({place(random), place(random), place(random)});
    made.time_s.push_back(0.1F * static_cast<float>(i) / static_cast<float>(count));
  }
  return made;
}

Eigen::Vector3d vector(const Point& p) {
  return Eigen::Vector3f(p.x, p.y, p.z).cast<double>();
}

/// What a body that moves so measures of a point that stands.
Sweep seen_in_motion(const Sweep& standing, const auto& fixed_from_body) {
  Sweep seen = standing;
  for (std::size_t i = 0; i < seen.points.size(); ++i) {
    const Pose at_time = fixed_from_body(static_cast<double>(seen.time_s[i]));
    const Eigen::Vector3f p = (at_time.inverse() * vector(standing.points[i])).cast<float>();
    seen.points[i] = {p.x(), p.y(), p.z()};
  }
  return seen;
}

double farthest_m(const Sweep& a, const Sweep& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.points.size(); ++i)
    most = std::max(most, (vector(a.points[i]) - vector(b.points[i])).norm());
  return most;
}

bool is_same(const Sweep& a, const Sweep& b) {
  return a.points.size() == b.points.size() &&
         std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof(Point)) == 0;
}

Pose turned(double rad) {
  return {exp_so3({0, 0, rad}), Eigen::Vector3d::Zero()};
}

Vector6d twist(const Eigen::Vector3d& m_s, const Eigen::Vector3d& rad_s) {
  Vector6d t;
  t << m_s, rad_s;
  return t;
}

InBlock<Deskew> deskew_of(std::uint32_t poses = 64, double extrapolation_s = 0.25) {
  return InBlock<Deskew>(DeskewConfig{poses, extrapolation_s});
}

}  // namespace

TEST_CASE("a body that stands leaves every bit of a scan, wherever it stands") {
  auto deskew = deskew_of();
  const Pose somewhere{exp_so3({0.3, -0.2, 1.7}), {512'345.678, -17.5, 3.25}};
  for (const double t : {-0.1, 0.0, 0.05, 0.2}) REQUIRE(deskew->add_pose(t, somewhere) == DeskewStatus::ok);
  const Sweep before = sweep();
  Sweep scan = before;
  REQUIRE(deskew->apply(scan.points, scan.time_s, 0.03) == DeskewStatus::ok);
  CHECK(is_same(scan, before));
  REQUIRE(deskew->set_twist(Vector6d::Zero()) == DeskewStatus::ok);
  REQUIRE(deskew->apply(scan.points, scan.time_s, 0.03) == DeskewStatus::ok);
  CHECK(is_same(scan, before));
}

TEST_CASE("a straight drive shifts each point by the way since the reference time") {
  auto deskew = deskew_of();
  REQUIRE(deskew->add_pose(0, Pose{}) == DeskewStatus::ok);
  REQUIRE(deskew->add_pose(0.1, {Eigen::Quaterniond::Identity(), {2, 0, 0}}) == DeskewStatus::ok);
  const Sweep before = sweep();
  Sweep scan = before;
  REQUIRE(deskew->apply(scan.points, scan.time_s, 0.05) == DeskewStatus::ok);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const double expected =
        static_cast<double>(before.points[i].x) + 20 * (static_cast<double>(scan.time_s[i]) - 0.05);
    CHECK(static_cast<double>(scan.points[i].x) == Approx(expected).margin(1e-5));
    CHECK(scan.points[i].y == before.points[i].y);
    CHECK(scan.points[i].z == before.points[i].z);
  }
}

TEST_CASE("a turn on the spot turns each point by the angle since the reference time") {
  auto deskew = deskew_of();
  REQUIRE(deskew->add_pose(-0.05, turned(1.0)) == DeskewStatus::ok);
  REQUIRE(deskew->add_pose(0.15, turned(1.4)) == DeskewStatus::ok);
  const Sweep before = sweep();
  Sweep scan = before;
  REQUIRE(deskew->apply(scan.points, scan.time_s, 0) == DeskewStatus::ok);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const double angle = 2.0 * static_cast<double>(scan.time_s[i]);
    const Eigen::Vector3d expected = turned(angle) * vector(before.points[i]);
    CHECK((vector(scan.points[i]) - expected).norm() < 1e-5);
  }
}

TEST_CASE("a bend is a screw: from the two poses at its ends, and from its twist, the same still world") {
  const Vector6d bend = twist({10, 0.5, -0.2}, {0.1, -0.3, 2.0});
  const auto fixed_from_body = [&](double t) { return exp_se3(bend * t); };
  const Sweep world = sweep();
  const Sweep seen = seen_in_motion(world, fixed_from_body);
  CHECK(farthest_m(world, seen) > 3);
  auto deskew = deskew_of();
  REQUIRE(deskew->add_pose(-0.1, fixed_from_body(-0.1)) == DeskewStatus::ok);
  REQUIRE(deskew->add_pose(0.2, fixed_from_body(0.2)) == DeskewStatus::ok);
  Sweep scan = seen;
  REQUIRE(deskew->apply(scan.points, scan.time_s, 0) == DeskewStatus::ok);
  CHECK(farthest_m(world, scan) < 2e-5);
  // beyond the last pose it goes on
  REQUIRE((deskew->clear(), deskew->add_pose(-0.1, fixed_from_body(-0.1))) == DeskewStatus::ok);
  REQUIRE(deskew->add_pose(0, fixed_from_body(0)) == DeskewStatus::ok);
  scan = seen;
  REQUIRE(deskew->apply(scan.points, scan.time_s, 0) == DeskewStatus::ok);
  CHECK(farthest_m(world, scan) < 2e-5);
  REQUIRE(deskew->set_twist(bend) == DeskewStatus::ok);
  scan = seen;
  REQUIRE(deskew->apply(scan.points, scan.time_s, 0) == DeskewStatus::ok);
  CHECK(farthest_m(world, scan) < 2e-5);
}

TEST_CASE("the frame of the poses and their origin are of no matter") {
  const Vector6d bend = twist({8, 0, 0}, {0, 0.2, 1.0});
  const Pose elsewhere{exp_so3({0.5, 0.1, -2.0}), {4321, -1234, 99}};
  auto here = deskew_of();
  auto there = deskew_of();
  for (const double t : {0.0, 0.04, 0.1}) {
    REQUIRE(here->add_pose(t, exp_se3(bend * t)) == DeskewStatus::ok);
    REQUIRE(there->add_pose(t, elsewhere * exp_se3(bend * t)) == DeskewStatus::ok);
  }
  Sweep a = sweep();
  Sweep b = a;
  REQUIRE(here->apply(a.points, a.time_s, 0.1) == DeskewStatus::ok);
  REQUIRE(there->apply(b.points, b.time_s, 0.1) == DeskewStatus::ok);
  CHECK(farthest_m(a, b) < 2e-5);
}

TEST_CASE("the order of points is of no matter, to the bit") {
  auto deskew = deskew_of();
  for (int i = 0; i < 20; ++i) {
    const double t = 0.01 * i - 0.05;
    REQUIRE(deskew->add_pose(t, {exp_so3({0, 0, std::sin(20 * t)}), {5 * t, t * t, 0}}) == DeskewStatus::ok);
  }
  Sweep inorder = sweep();
  std::vector<std::size_t> order(inorder.points.size());
  std::iota(order.begin(), order.end(), 0U);
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  Sweep mixed;
  for (const std::size_t i : order) {
    mixed.points.push_back(inorder.points[i]);
    mixed.time_s.push_back(inorder.time_s[i]);
  }
  REQUIRE(deskew->apply(inorder.points, inorder.time_s, 0) == DeskewStatus::ok);
  REQUIRE(deskew->apply(mixed.points, mixed.time_s, 0) == DeskewStatus::ok);
  for (std::size_t i = 0; i < order.size(); ++i)
    REQUIRE(std::memcmp(&mixed.points[i], &inorder.points[order[i]], sizeof(Point)) == 0);
}

TEST_CASE("a gyro and a speed give the turn of the body back, with its bias taken off") {
  // A turn that grows: rate 1 + 8 t about z, at 5 m/s ahead.
  const auto rate = [](double t) { return Eigen::Vector3d(0.05, 0, 1 + 8 * t); };
  const Eigen::Vector3d bias(0.02, -0.01, 0.03);
  std::vector<GyroSample> samples;
  for (int i = -2; i <= 30; ++i) samples.push_back({0.005 * i, rate(0.005 * i) + bias});
  // The truth in steps of 10 us.
  std::vector<Pose> truth = {Pose{}};
  for (int i = 0; i < 15'000; ++i)
    truth.push_back(truth.back() * exp_se3(twist({5, 0, 0}, rate(1e-5 * (i + 0.5))) * 1e-5));
  const auto fixed_from_body = [&](double t) {
    return truth[static_cast<std::size_t>(std::lround(t * 1e5))];
  };
  const Sweep world = sweep(500);
  const Sweep seen = seen_in_motion(world, fixed_from_body);
  auto deskew = deskew_of();
  REQUIRE(deskew->set_gyro(samples, {5, 0, 0}, bias) == DeskewStatus::ok);
  Sweep scan = seen;
  REQUIRE(deskew->apply(scan.points, scan.time_s, 0) == DeskewStatus::ok);
  CHECK(farthest_m(world, seen) > 3);
  CHECK(farthest_m(world, scan) < 2e-3);
  REQUIRE(deskew->set_gyro(samples, {5, 0, 0}) == DeskewStatus::ok);
  scan = seen;
  REQUIRE(deskew->apply(scan.points, scan.time_s, 0) == DeskewStatus::ok);
  CHECK(farthest_m(world, scan) > 0.02);  // so the bias is of matter
}

TEST_CASE("what cannot be deskewed is named, and no point is touched") {
  auto deskew = deskew_of(3, 0.05);
  const Sweep before = sweep(100);
  Sweep scan = before;
  const auto refuses = [&](DeskewStatus status, double reference_s = 0) {
    CHECK(deskew->apply(scan.points, scan.time_s, reference_s) == status);
    CHECK(is_same(scan, before));
  };
  refuses(DeskewStatus::no_motion);
  REQUIRE(deskew->add_pose(0, Pose{}) == DeskewStatus::ok);
  refuses(DeskewStatus::no_motion);
  CHECK(deskew->add_pose(0, turned(1)) == DeskewStatus::times_not_growing);
  CHECK(deskew->add_pose(not_a_number, turned(1)) == DeskewStatus::times_not_growing);
  CHECK(deskew->add_pose(0.04, {Eigen::Quaterniond(2, 0, 0, 0), {0, 0, 0}}) == DeskewStatus::bad_pose);
  CHECK(deskew->add_pose(0.04, {Eigen::Quaterniond::Identity(), {not_a_number, 0, 0}}) ==
        DeskewStatus::bad_pose);
  REQUIRE(deskew->add_pose(0.04, turned(0.1)) == DeskewStatus::ok);
  refuses(DeskewStatus::outside_of_motion);         // of the last points: 0.099 s
  refuses(DeskewStatus::outside_of_motion, -0.06);  // of the reference
  refuses(DeskewStatus::time_not_finite, not_a_number);
  REQUIRE(deskew->add_pose(0.1, turned(0.2)) == DeskewStatus::ok);
  CHECK(deskew->add_pose(0.2, turned(0.3)) == DeskewStatus::no_capacity);
  scan.time_s[50] = std::numeric_limits<float>::quiet_NaN();
  refuses(DeskewStatus::time_not_finite);
  scan.time_s.pop_back();
  refuses(DeskewStatus::times_missing);
  CHECK(deskew->set_twist(twist({not_a_number, 0, 0}, {0, 0, 0})) == DeskewStatus::bad_pose);
  CHECK(deskew->set_twist(twist({1e200, 0, 0}, {0, 0, 0})) == DeskewStatus::bad_pose);
  const GyroSample sample{0, {0, 0, not_a_number}};
  CHECK(deskew->set_gyro({&sample, 1}, {0, 0, 0}) == DeskewStatus::bad_pose);
  scan = before;
  refuses(DeskewStatus::no_motion);
}

TEST_CASE("points that are no numbers stay none, and the others are deskewed") {
  auto deskew = deskew_of();
  REQUIRE(deskew->set_twist(twist({10, 0, 0}, {0, 0, 0})) == DeskewStatus::ok);
  std::vector<Point> points = {{std::numeric_limits<float>::quiet_NaN(), 1, 2}, {1, 2, 3}};
  const std::vector<float> time_s = {0.1F, 0.1F};
  REQUIRE(deskew->apply(points, time_s, 0) == DeskewStatus::ok);
  CHECK(std::isnan(points[0].x));
  CHECK(points[0].y == 1);
  CHECK(points[1].x == Approx(2));
}
