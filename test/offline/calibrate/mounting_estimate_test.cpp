// The mounting of lasers from full turns in a room whose walls are known.
#include "offline/calibrate/mounting_estimate.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "offline/io/files/error.h"
#include "room_scan.h"

namespace alces::offline {
namespace {

using Catch::Contains;

const MountingParameter& parameter(const MountingEstimate& estimate, std::size_t laser, MountingKey key) {
  return estimate.parameters.at(laser * mounting_keys + static_cast<std::size_t>(key));
}

Mounting wrong_first() {
  return {0.083, 0.004, 0, 90.4 * deg, -0.5 * deg, 0};
}
Mounting wrong_second() {
  return {-0.076, -0.006, 0.005, 89.7 * deg, 0.3 * deg, 180.8 * deg};
}

TEST_CASE("two lasers back to back: the second is brought into line with the first") {
  RoomScan room;
  room.turns = 2;
  room.profiles_a_turn = 180;
  room.lasers = {wrong_first(), wrong_second()};
  const MountingEstimate estimate = estimate_mounting(room.scan(), two_lasers());
  CHECK(estimate.has_converged);
  CHECK(estimate.before.median_gap_m > 0.02);
  CHECK(estimate.after.median_gap_m < 0.001);
  const auto& found = estimate.lasers;
  CHECK(found[0] == two_lasers()[0]);
  for (const MountingKey key : {key_x, key_y, key_roll, key_pitch})
    CHECK(parameter(estimate, 0, key).fate == Fate::undetermined);
  // The lasers look to opposite sides, so that a wall shows the sum of their errors in x and y.
  CHECK(found[0][key_x] + found[1][key_x] == Approx(0.083 - 0.076).margin(0.001));
  CHECK(found[0][key_y] + found[1][key_y] == Approx(0.004 - 0.006).margin(0.002));
  CHECK(found[1][key_z] == Approx(0.005).margin(0.001));
  CHECK(found[1][key_roll] - found[0][key_roll] == Approx(-0.7 * deg).margin(0.03 * deg));
  CHECK(found[1][key_pitch] - found[0][key_pitch] == Approx(0.8 * deg).margin(0.03 * deg));
  CHECK(found[1][key_yaw] == Approx(180.8 * deg).margin(0.05 * deg));
}

TEST_CASE("where surfaces are flat the tilt of both lasers shows") {
  RoomScan room;
  room.lasers = {wrong_first(), wrong_second()};
  const MountingEstimate estimate = estimate_mounting(room.scan(), two_lasers(), {.surfaces_are_flat = true});
  CHECK(estimate.after.rms_m < 0.011);  // the noise is 0.010
  CHECK(estimate.lasers[0][key_pitch] == Approx(-0.5 * deg).margin(0.15 * deg));
  CHECK(estimate.lasers[1][key_pitch] == Approx(0.3 * deg).margin(0.15 * deg));
  CHECK(estimate.lasers[0][key_roll] == Approx(90.4 * deg).margin(0.4 * deg));
  CHECK(estimate.lasers[1][key_roll] == Approx(89.7 * deg).margin(0.4 * deg));
}

TEST_CASE("the first laser's height and turn are the head's, and keep what is configured") {
  RoomScan room;
  room.lasers = {wrong_first(), wrong_second()};
  room.lasers[0][key_z] = 0.02;
  room.lasers[0][key_yaw] = 1 * deg;
  const MountingEstimate estimate = estimate_mounting(room.scan(), two_lasers());
  for (const MountingKey key : {key_z, key_yaw}) {
    CHECK(parameter(estimate, 0, key).fate == Fate::same_as_head);
    CHECK(parameter(estimate, 0, key).estimated == two_lasers()[0][key]);
  }
  // The second one is found in relation to it.
  CHECK(estimate.lasers[1][key_z] == Approx(0.005 - 0.02).margin(0.002));
  CHECK(estimate.lasers[1][key_yaw] == Approx(179.8 * deg).margin(0.05 * deg));
}

TEST_CASE("one laser of three quarters of a turn that looks up sees walls twice: four numbers are found") {
  RoomScan room;
  room.first_ray_rad = -45 * deg;
  room.rays = 271;
  room.lasers = {{0.10, 0.02, 0, 91 * deg, 0.7 * deg, 0}};
  const std::vector<Mounting> configured{{0.08, 0, 0, 90 * deg, 0, 0}};
  const MountingEstimate estimate = estimate_mounting(room.scan(), configured);
  CHECK(estimate.patches_seen_twice > 20);
  CHECK(estimate.lasers[0][key_x] == Approx(0.10).margin(0.002));
  CHECK(estimate.lasers[0][key_y] == Approx(0.02).margin(0.002));
  CHECK(estimate.lasers[0][key_roll] == Approx(91 * deg).margin(0.05 * deg));
  CHECK(estimate.lasers[0][key_pitch] == Approx(0.7 * deg).margin(0.05 * deg));
}

TEST_CASE("the standard deviations are as large as the errors") {
  double sum = 0;
  int count = 0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    RoomScan room;
    room.seed = seed;
    room.turns = 1;
    room.lasers = two_lasers();
    room.lasers[1] = wrong_second();
    std::vector<Mounting> configured = room.lasers;  // what cannot be seen is right
    configured[1][key_pitch] += 0.3 * deg;
    configured[1][key_yaw] += 0.3 * deg;
    const MountingEstimate estimate = estimate_mounting(room.scan(), configured);
    for (const MountingParameter& one : estimate.parameters) {
      if (one.fate != Fate::estimated) continue;
      const double error = one.estimated - room.lasers[one.laser][static_cast<std::size_t>(one.key)];
      CAPTURE(seed, one.laser, name(one.key), error, one.sigma);
      CHECK(std::abs(error) < 5 * one.sigma);
      sum += error * error / (one.sigma * one.sigma);
      ++count;
    }
  }
  CHECK(count >= 15);
  CHECK(std::sqrt(sum / count) < 2.5);
}

TEST_CASE("between floor and ceiling alone nothing says where the lasers look, and it is said") {
  RoomScan room;
  room.walls = {{-Eigen::Vector3d::UnitZ(), 1.0}, {Eigen::Vector3d::UnitZ(), 2.2}};
  room.lasers = two_lasers();
  room.farthest_m = 10;
  const MountingEstimate estimate = estimate_mounting(room.scan(), two_lasers());
  CHECK(parameter(estimate, 1, key_yaw).fate == Fate::undetermined);
  CHECK(parameter(estimate, 1, key_yaw).estimated == two_lasers()[1][key_yaw]);
  CHECK(parameter(estimate, 1, key_y).fate == Fate::undetermined);
  CHECK(parameter(estimate, 1, key_z).fate == Fate::estimated);
}

TEST_CASE("the same rays give the same numbers to the bit") {
  RoomScan room;
  room.profiles_a_turn = 60;
  room.lasers = {wrong_first(), wrong_second()};
  const auto rays = room.scan();
  const MountingEstimate one = estimate_mounting(rays, two_lasers());
  const MountingEstimate two = estimate_mounting(rays, two_lasers());
  CHECK(one.lasers == two.lasers);
  CHECK(one.after.rms_m == two.after.rms_m);
}

TEST_CASE("where nothing is flat a calibration is refused") {
  RoomScan room;
  room.lasers = two_lasers();
  room.noise_m = 0.6;
  room.turns = 1;
  CHECK_THROWS_WITH(estimate_mounting(room.scan(), two_lasers()), Contains("flat surfaces"));
  CHECK_THROWS_AS(estimate_mounting({}, two_lasers()), InputError);
}

TEST_CASE("a scan plane across the axis, and a pitch of 90, are refused by name") {
  RoomScan room;
  room.lasers = two_lasers();
  room.profiles_a_turn = 20;
  const auto rays = room.scan();
  std::vector<Mounting> lying = two_lasers();
  lying[1][key_roll] = 0;
  CHECK_THROWS_WITH(estimate_mounting(rays, lying), Contains("laser_b") && Contains("no 3D scans"));
  std::vector<Mounting> pitched = two_lasers();
  pitched[0][key_pitch] = 90 * deg;
  CHECK_THROWS_WITH(estimate_mounting(rays, pitched), Contains("laser_a") && Contains("pitch_deg"));
}

TEST_CASE("a mounting and its pose say the same") {
  const Mounting mounting{0.1, -0.2, 0.3, 91 * deg, -2 * deg, 170 * deg};
  const Mounting again = mounting_of(pose_of(mounting));
  for (std::size_t key = 0; key < mounting_keys; ++key) CHECK(again[key] == Approx(mounting[key]));
}

}  // namespace
}  // namespace alces::offline
