#include "alces/pose.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

using namespace alces;

namespace {

constexpr double pi = std::numbers::pi;

Pose random_pose(std::mt19937& random) {
  std::uniform_real_distribution<double> metres(-100, 100);
  std::normal_distribution<double> part;
  Pose pose;
  pose.translation_m = {metres(random), metres(random), metres(random)};
  pose.rotation = Eigen::Quaterniond(part(random), part(random), part(random), part(random)).normalized();
  return pose;
}

void check_same(const Pose& a, const Pose& b) {
  CHECK((a.translation_m - b.translation_m).norm() < 1e-9);
  CHECK(angle_between_rad(a.rotation, b.rotation) < 1e-9);
}

}  // namespace

TEST_CASE("a pose composed with its inverse is the identity") {
  std::mt19937 random(1);
  for (int i = 0; i < 100; ++i) {
    const Pose pose = random_pose(random);
    check_same(pose * pose.inverse(), Pose{});
    check_same(Pose::from_matrix(pose.matrix()), pose);
    check_same(Pose::from_matrix(pose.matrix() * pose.matrix()), pose * pose);
  }
}

TEST_CASE("exponential and logarithm of SE(3) undo each other, also near zero and near half a turn") {
  std::mt19937 random(2);
  std::normal_distribution<double> part;
  for (const double angle_rad : {0.0, 1e-12, 1e-7, 1e-4, 0.01, 1.0, 3.0, 3.14}) {
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d axis = Eigen::Vector3d(part(random), part(random), part(random)).normalized();
      Vector6d twist;
      twist << part(random), part(random), part(random), angle_rad * axis;
      CHECK((log_se3(exp_se3(twist)) - twist).norm() < 1e-6);
    }
  }
}

TEST_CASE("slerp takes the shorter way and composes to the whole") {
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Quaterniond q = random_pose(random).rotation;
    const Eigen::Quaterniond third = slerp_from_identity(1.0 / 3.0, q);
    CHECK(angle_between_rad(third * third * third, q) < 1e-9);
    CHECK(angle_between_rad(Eigen::Quaterniond::Identity(), third) <= 3.1415927 / 3.0);
    CHECK(angle_between_rad(third, Eigen::Quaterniond::Identity().slerp(1.0 / 3.0, q)) < 1e-9);
  }
}

TEST_CASE("3DTK's poses convert there and back, and a point lands where 3DTK puts it") {
  std::mt19937 random(4);
  for (int i = 0; i < 100; ++i) {
    const Pose pose = random_pose(random);
    check_same(from_3dtk(to_3dtk(pose)), pose);
    check_same(from_matrix_3dtk(matrix_3dtk(pose)), pose);
  }
  // slam6d: x right, y up, z forward, cm; 90 deg about y turns z (forward) into x (right)
  const Pose right_turn = from_3dtk({{100, 200, 300}, {0, 1.5707963267948966, 0}});
  CHECK((right_turn.translation_m - Eigen::Vector3d(3, -1, 2)).norm() < 1e-12);
  const Eigen::Vector3d ahead = right_turn * Eigen::Vector3d(1, 0, 0);
  CHECK((ahead - Eigen::Vector3d(3, -2, 2)).norm() < 1e-12);
}

TEST_CASE("a pose between two lies on the straight line, and turns evenly the shorter way") {
  std::mt19937 random(5);
  for (int i = 0; i < 100; ++i) {
    const Pose from = random_pose(random);
    const Pose to = random_pose(random);
    Pose same_to = to;
    same_to.rotation.coeffs() *= -1;  // the same orientation, by the other quaternion
    const double whole_rad = angle_between_rad(from.rotation, to.rotation);
    check_same(interpolate(from, to, 0), from);
    check_same(interpolate(from, to, 1), to);
    for (const double fraction : {0.25, 0.5, 0.9}) {
      const Pose between = interpolate(from, to, fraction);
      const Eigen::Vector3d expected_m =
          from.translation_m + fraction * (to.translation_m - from.translation_m);
      CHECK((between.translation_m - expected_m).norm() < 1e-9);
      CHECK(angle_between_rad(from.rotation, between.rotation) == Approx(fraction * whole_rad).margin(1e-9));
      CHECK(angle_between_rad(between.rotation, to.rotation) ==
            Approx((1 - fraction) * whole_rad).margin(1e-9));
      check_same(interpolate(from, same_to, fraction), between);
      check_same(interpolate(to, from, 1 - fraction), between);
    }
  }
  // from 10 to 340 deg about z: back over zero, not round by 180
  const auto heading = [](double deg) {
    Pose pose;
    pose.rotation = Eigen::AngleAxisd(deg * pi / 180, Eigen::Vector3d::UnitZ());
    return pose;
  };
  check_same(interpolate(heading(10), heading(340), 0.5), heading(-5));
  check_same(interpolate(heading(10), heading(340), 2), heading(-50));
}

TEST_CASE("3DTK's angles turn about z first, then y, then x, as slam6d's EulerToMatrix4 writes them") {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> part(-0.999, 0.999);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d euler_rad(pi * part(random), pi / 2 * part(random), pi * part(random));
    const double sx = std::sin(euler_rad.x());
    const double cx = std::cos(euler_rad.x());
    const double sy = std::sin(euler_rad.y());
    const double cy = std::cos(euler_rad.y());
    const double sz = std::sin(euler_rad.z());
    const double cz = std::cos(euler_rad.z());
    Eigen::Matrix4d expected;
    expected << cy * cz, -cy * sz, sy, 120,                              //
        sx * sy * cz + cx * sz, -sx * sy * sz + cx * cz, -sx * cy, -50,  //
        -cx * sy * cz + sx * sz, cx * sy * sz + sx * cz, cx * cy, 7,     //
        0, 0, 0, 1;
    const Pose pose = from_3dtk({{120, -50, 7}, euler_rad});
    CHECK((matrix_3dtk(pose) - expected).cwiseAbs().maxCoeff() < 1e-9);
    check_same(from_matrix_3dtk(expected), pose);
    const Pose3dtk back = to_3dtk(pose);
    CHECK((back.euler_rad - euler_rad).cwiseAbs().maxCoeff() < 1e-9);
    CHECK((back.position_cm - Eigen::Vector3d(120, -50, 7)).norm() < 1e-9);
  }
}

TEST_CASE("where 3DTK's y angle is a quarter turn, the angle about x carries both") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> part(-1.5, 1.5);
  for (int i = 0; i < 50; ++i) {
    const double x_rad = part(random);
    const double z_rad = part(random);
    for (const double side : {1.0, -1.0}) {
      const Pose pose = from_3dtk({{1, 2, 3}, {x_rad, side * pi / 2, z_rad}});
      const Pose3dtk converted = to_3dtk(pose);
      CAPTURE(x_rad, z_rad, side);
      CHECK(converted.euler_rad.x() == Approx(x_rad + side * z_rad).margin(1e-9));
      CHECK(converted.euler_rad.y() == Approx(side * pi / 2).margin(1e-9));
      CHECK(converted.euler_rad.z() == 0);
      check_same(from_3dtk(converted), pose);
      // next to it the three angles are still told apart, as far as their digits go
      for (const double beside_rad : {1e-3, 1e-5, 1e-7, 1e-8, 1e-10, 1e-12}) {
        const Pose near = from_3dtk({{1, 2, 3}, {x_rad, side * (pi / 2 - beside_rad), z_rad}});
        CAPTURE(beside_rad);
        CHECK(angle_between_rad(from_3dtk(to_3dtk(near)).rotation, near.rotation) < 5e-8);
      }
    }
  }
}

TEST_CASE("NaN, places farther than the Earth is large, and quaternions not of unit length are no poses") {
  CHECK(is_valid(Pose{}));
  const double inf = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {1.0, -1.0}) {
      Pose pose;
      pose.translation_m[axis] = side * 0.99 * farthest_place_m;
      CHECK(is_valid(pose));
      for (const double far_m : {1.01 * farthest_place_m, 1e30, 1e200, 1.7e308, inf}) {
        pose.translation_m[axis] = side * far_m;
        CHECK_FALSE(is_valid(pose));
      }
    }
    Pose pose;
    pose.translation_m[axis] = std::nan("");
    CHECK_FALSE(is_valid(pose));
  }
  for (int part = 0; part < 4; ++part) {
    for (const double value : {std::nan(""), inf, -inf, 1e200}) {
      Pose pose;
      pose.rotation.coeffs()[part] = value;
      CHECK_FALSE(is_valid(pose));
    }
  }
  for (const double length : {0.0, 0.99, 1.01, 2.0}) {
    Pose pose;
    pose.rotation.coeffs() *= length;
    CHECK_FALSE(is_valid(pose));
  }
}
