#include "alces/pose.h"

#include <catch2/catch.hpp>
#include <random>

using namespace alces;

namespace {

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

TEST_CASE("NaN and quaternions that are not of unit length are no poses") {
  Pose pose;
  CHECK(is_valid(pose));
  pose.translation_m.x() = std::nan("");
  CHECK_FALSE(is_valid(pose));
  pose = Pose{};
  pose.rotation.coeffs() *= 2;
  CHECK_FALSE(is_valid(pose));
}
