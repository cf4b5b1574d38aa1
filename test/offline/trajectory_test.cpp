#include "offline/io/map_folder/trajectory.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "support/test_data.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

Trajectory random_trajectory(bool has_time) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> metres(-1000, 1000);
  std::normal_distribution<double> part;
  Trajectory trajectory;
  trajectory.has_time = has_time;
  for (int i = 0; i < 50; ++i) {
    trajectory.stamps_s.push_back(has_time ? 1630577758.569490 + 0.1 * i : 3 * i);
    Pose pose;
    pose.translation_m = {metres(random), metres(random), metres(random)};
    pose.rotation = Eigen::Quaterniond(part(random), part(random), part(random), part(random)).normalized();
    trajectory.poses.push_back(pose);
  }
  return trajectory;
}

void check_same_poses(const Trajectory& a, const Trajectory& b, double metres) {
  REQUIRE(a.size() == b.size());
  REQUIRE(a.stamps_s.size() == b.stamps_s.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    CHECK((a.poses[i].translation_m - b.poses[i].translation_m).norm() < metres);
    CHECK(angle_between_rad(a.poses[i].rotation, b.poses[i].rotation) < 1e-9);
  }
}

}  // namespace

TEST_CASE("TUM: poses come back to 0.1 um and 1e-9 rad, stamps and scan numbers as they were") {
  const TemporaryFolder folder;
  for (const bool has_time : {false, true}) {
    const Trajectory trajectory = random_trajectory(has_time);
    write_tum(folder / "trajectory.tum", trajectory);
    for (const auto& path : {folder / "trajectory.tum", folder.path()}) {  // a map folder is its trajectory
      const Trajectory back = read_trajectory(path);
      check_same_poses(trajectory, back, 1e-7);
      CHECK(back.stamps_s == trajectory.stamps_s);
      CHECK(back.has_time == has_time);
    }
  }
}

TEST_CASE("KITTI: poses come back, stamps are the line's number") {
  const TemporaryFolder folder;
  const Trajectory trajectory = random_trajectory(true);
  write_kitti(folder / "poses.txt", trajectory);
  const Trajectory back = read_trajectory(folder / "poses.txt");
  check_same_poses(trajectory, back, 1e-7);
  CHECK(back.stamps_s[7] == 7);
  CHECK_FALSE(back.has_time);
}

TEST_CASE("3DTK .frames: poses and scan numbers come back, .frames are preferred to .pose") {
  const TemporaryFolder folder;
  const Trajectory trajectory = random_trajectory(false);
  write_3dtk_frames(folder / "frames", trajectory);
  CHECK(std::filesystem::exists(folder / "frames/scan003.frames"));
  folder.write("frames/scan000.pose", "1 2 3 4 5 6");
  const Trajectory back = read_trajectory(folder / "frames");
  check_same_poses(trajectory, back, 1e-7);
  CHECK(back.stamps_s == trajectory.stamps_s);
}

TEST_CASE("3DTK .pose: numbered by name, in cm and degrees") {
  const TemporaryFolder folder;
  folder.write("scan9.pose", "100 200 300\n0 90 0\n");
  folder.write("scan10.pose", "0 0 0\n0 0 0\n");
  const Trajectory trajectory = read_trajectory(folder.path());
  REQUIRE(trajectory.size() == 2);
  CHECK(trajectory.stamps_s == std::vector<double>{9, 10});
  CHECK((trajectory.poses[0] * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(3, -2, 2)).norm() < 1e-9);
}

TEST_CASE("matrices: four lines a pose or sixteen numbers a line, with a stamp or without") {
  const TemporaryFolder folder;
  const Trajectory plain = read_trajectory(folder.write("a", "1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n"));
  REQUIRE(plain.size() == 1);
  CHECK_FALSE(plain.has_time);
  CHECK(plain.stamps_s[0] == 0);
  CHECK(plain.poses[0].translation_m.y() == 6);
  const Trajectory stamped = read_trajectory(
      folder.write("b", "1,0,0,5,\n0,1,0,6,\n0,0,1,7,\n0.000,0.000,0.000,1630577758.569490,\n"));
  CHECK(stamped.has_time);
  CHECK(stamped.stamps_s[0] == 1630577758.569490);
  CHECK(read_trajectory(folder.write("c", "1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1\n")).poses[0].translation_m.z() ==
        7);
}

TEST_CASE("a file of five numbers a line is no trajectory, and the error says what is") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_trajectory(folder.write("a.txt", "# hello\n1 2 3 4 5\n")),
                    Contains("a.txt:2:") && Contains("5 numbers") && Contains("TUM") && Contains("KITTI"));
}

TEST_CASE("a line that is shorter than the first is an error with its number") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_trajectory(folder.write("a.txt", "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 1\n")),
                    Contains("a.txt:2:") && Contains("7 numbers where 8"));
}

TEST_CASE("a quaternion that is far from unit length is an error") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_trajectory(folder.write("a.txt", "0 0 0 0 1 0 0 1\n")), Contains("quaternion"));
  CHECK_THROWS_WITH(read_trajectory(folder.write("a.txt", "0 0 0 0 0 0 0 0\n")), Contains("quaternion"));
}

TEST_CASE("matrices that mirror or stretch are errors") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_trajectory(folder.write("a.txt", "1 0 0 0 0 1 0 0 0 0 -1 0\n")),
                    Contains("mirrors"));
  CHECK_THROWS_WITH(read_trajectory(folder.write("a.txt", "2 0 0 0 0 1 0 0 0 0 1 0\n")),
                    Contains("no rotation"));
}

TEST_CASE("a matrix with a row too few, or whose last row is none, is an error") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_trajectory(folder.write("a.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n")), Contains("4x4"));
  CHECK_THROWS_WITH(read_trajectory(folder.write("a.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 1 1\n")),
                    Contains("a.txt:4:"));
}

TEST_CASE("NaN in a pose is an error in every format") {
  const TemporaryFolder folder;
  for (const char* text :
       {"0 nan 0 0 0 0 0 1\n", "1 0 0 inf 0 1 0 0 0 0 1 0\n", "1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"}) {
    CHECK_THROWS_WITH(read_trajectory(folder.write("a.txt", text)), Contains("NaN or Inf"));
  }
  CHECK_THROWS_AS(read_3dtk_pose(folder.write("scan000.pose", "0 0 nan 0 0 0")), InputError);
}

TEST_CASE("text in a trajectory is an error with its line") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_trajectory(folder.write("a.txt", "0 0 0 0 0 0 0 1\n1 0 zero 0 0 0 0 1\n")),
                    Contains("a.txt:2:") && Contains("zero"));
}

TEST_CASE("empty files, empty folders and missing paths are errors") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_trajectory(folder.path()), Contains("no trajectory"));
  CHECK_THROWS_WITH(read_trajectory(folder.write("a.txt", "# nothing\n")), Contains("no poses"));
  CHECK_THROWS_AS(read_trajectory(folder / "nowhere"), InputError);
  CHECK_THROWS_AS(read_3dtk_frames(folder.write("scan000.frames", "")), InputError);
  CHECK_THROWS_WITH(read_3dtk_frames(folder.write("scan000.frames", "1 2 3\n")),
                    Contains("3 numbers where 16"));
  CHECK_THROWS_WITH(read_3dtk_pose(folder.write("scan000.pose", "1 2 3 4 5 6 7")),
                    Contains("7 numbers where 6"));
}

TEST_CASE("real trajectories: KITTI 00 and fr2_desk") {
  if (!test::has_test_data("trajectories")) return;
  const Trajectory kitti = read_trajectory(test::test_data("trajectories/KITTI_00_gt.txt"));
  REQUIRE(kitti.size() == 4541);
  double length_m = 0;
  for (std::size_t i = 1; i < kitti.size(); ++i) {
    length_m += (kitti.poses[i].translation_m - kitti.poses[i - 1].translation_m).norm();
  }
  CHECK(length_m == Approx(3724.2).margin(0.5));
  CHECK(read_trajectory(test::test_data("trajectories/KITTI_00_SPTAM.txt")).size() == 4541);
  const Trajectory desk = read_trajectory(test::test_data("trajectories/fr2_desk_groundtruth.txt"));
  CHECK(desk.size() > 20900);
  CHECK(desk.has_time);
  CHECK(desk.stamps_s[0] == 1311868163.8697);
  CHECK(std::all_of(desk.poses.begin(), desk.poses.end(), is_valid));
}
