#include "alces_platform/sim/world/vehicle_motion.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "alces_platform/sim/world/tour.h"

using namespace alces;
using sim::MotionSettings;
using sim::VehicleMotion;

namespace {

constexpr std::int64_t ms = 1'000'000;

struct World {
  explicit World(const MotionSettings& settings)
      : tour(sim::make_tour(settings)), town(tour.layout), motion(settings, tour, town) {}
  sim::Tour tour;
  sim::Town town;
  VehicleMotion motion;
};

MotionSettings short_drive(std::size_t scans = 40, std::uint64_t seed = 1) {
  MotionSettings settings;
  settings.scans = scans;
  settings.seed = seed;
  return settings;
}

bool same(const Pose& a, const Pose& b) {
  return a.translation_m == b.translation_m && a.rotation.coeffs() == b.rotation.coeffs();
}

}  // namespace

TEST_CASE("the vehicle stands, drives as long as its scans take, and stands again") {
  MotionSettings settings = short_drive(120);
  settings.mean_speed_m_per_s = GENERATE(1.1, 1.6);
  const World world(settings);
  const VehicleMotion& motion = world.motion;
  CAPTURE(settings.mean_speed_m_per_s);

  const double standstill_s = 1e-9 * static_cast<double>(motion.roll_stamp_ns() - motion.start_stamp_ns());
  CHECK(standstill_s > settings.standstill_s - 0.3);
  CHECK(same(motion.town_from_body(motion.start_stamp_ns() - 1000 * ms),
             motion.town_from_body(motion.roll_stamp_ns())));
  for (std::int64_t stamp = motion.start_stamp_ns(); stamp < motion.roll_stamp_ns(); stamp += 50 * ms) {
    REQUIRE(motion.at(stamp).velocity_m_per_s.norm() == 0);
    REQUIRE(motion.at(stamp).rate_rad_per_s.norm() == 0);
  }
  const double driving_s = 1e-9 * static_cast<double>(motion.stop_stamp_ns() - motion.roll_stamp_ns());
  CHECK(driving_s == Approx(120 * 1.2).epsilon(0.02));
  CHECK(motion.way_m(motion.stop_stamp_ns()) ==
        Approx(120 * 1.2 * settings.mean_speed_m_per_s).epsilon(0.01));
  CHECK(motion.at(motion.stop_stamp_ns() + ms).velocity_m_per_s.norm() < 1e-9);
  CHECK(same(motion.town_from_body(motion.stop_stamp_ns() + 1000 * ms),
             motion.town_from_body(motion.stop_stamp_ns() + 9000 * ms)));
}

TEST_CASE("the motion has no jumps in place, speed or turn") {
  MotionSettings settings = short_drive(120);
  settings.mean_speed_m_per_s = GENERATE(1.1, 1.6);
  const World world(settings);
  auto before = world.motion.at(world.motion.start_stamp_ns());
  double fastest = 0, hardest = 0, sideways = 0;
  const double step_s = 0.002;
  for (std::int64_t stamp = world.motion.start_stamp_ns() + 2 * ms; stamp < world.motion.stop_stamp_ns();
       stamp += 2 * ms) {
    const auto now = world.motion.at(stamp);
    REQUIRE(is_valid(now.town_from_body));
    const double moved = (now.town_from_body.translation_m - before.town_from_body.translation_m).norm();
    // What it moved is what its velocities say.
    const double speed = 0.5 * (now.velocity_m_per_s + before.velocity_m_per_s).norm();
    REQUIRE(std::abs(moved - speed * step_s) < 2e-5);
    const Eigen::Vector3d turned =
        log_so3(before.town_from_body.rotation.conjugate() * now.town_from_body.rotation);
    const Eigen::Vector3d rate = 0.5 * (now.rate_rad_per_s + before.rate_rad_per_s);
    REQUIRE((turned - rate * step_s).norm() < 2e-5);
    fastest = std::max(fastest, now.velocity_m_per_s.x());
    hardest = std::max(hardest, (now.velocity_m_per_s - before.velocity_m_per_s).norm() / step_s);
    sideways = std::max(sideways, std::abs(now.velocity_m_per_s.y()));
    before = now;
  }
  CHECK(fastest > settings.mean_speed_m_per_s);
  CHECK(fastest < 1.6 * settings.mean_speed_m_per_s);
  CHECK(hardest < 1.0);
  CHECK(sideways < 0.01);  // the tilt of the ground; wheels do not slip sideways
}

TEST_CASE("the vehicle slows down in bends") {
  const World world(short_drive(120));
  double bend_speed = 0, straight_speed = 0;
  int bends = 0, straights = 0;
  for (std::int64_t stamp = world.motion.roll_stamp_ns() + 5000 * ms;
       stamp < world.motion.stop_stamp_ns() - 5000 * ms; stamp += 100 * ms) {
    const auto state = world.motion.at(stamp);
    const double curvature = std::abs(state.rate_rad_per_s.z()) / std::max(0.1, state.velocity_m_per_s.x());
    if (curvature > 0.27) {
      bend_speed += state.velocity_m_per_s.x();
      ++bends;
    } else if (curvature < 0.05) {
      straight_speed += state.velocity_m_per_s.x();
      ++straights;
    }
  }
  REQUIRE(bends > 20);
  REQUIRE(straights > 100);
  CHECK(bend_speed / bends < 0.93 * straight_speed / straights);
}

TEST_CASE("height and tilt follow the ground under the wheels") {
  const World world(short_drive(120, 3));
  double worst_m = 0, worst_rad = 0, lowest_m = 1e9, highest_m = -1e9;
  for (std::int64_t stamp = world.motion.roll_stamp_ns(); stamp < world.motion.stop_stamp_ns();
       stamp += 200 * ms) {
    const Pose pose = world.motion.town_from_body(stamp);
    const Eigen::Vector3d ahead = pose.rotation * Eigen::Vector3d::UnitX();
    const auto stand =
        sim::stand_on(world.town, pose.translation_m.head<2>(), std::atan2(ahead.y(), ahead.x()));
    worst_m = std::max(worst_m, std::abs(pose.translation_m.z() - stand.height_m));
    worst_rad = std::max(worst_rad, std::abs(std::asin(-ahead.z()) - stand.pitch_rad));
    lowest_m = std::min(lowest_m, stand.height_m);
    highest_m = std::max(highest_m, stand.height_m);
  }
  CHECK(highest_m - lowest_m > 0.3);  // there is something to follow
  CHECK(worst_m < 0.05);
  CHECK(worst_rad < 0.06);  // the suspension takes the short waves out
}

TEST_CASE("the same seed is the same motion, another seed is another") {
  const World one(short_drive()), again(short_drive()), other(short_drive(40, 2));
  for (int second = 0; second < 50; second += 7) {
    const std::int64_t stamp = one.motion.start_stamp_ns() + second * 1000 * ms + 123'456;
    CHECK(same(one.motion.town_from_body(stamp), again.motion.town_from_body(stamp)));
    CHECK_FALSE(same(one.motion.town_from_body(stamp), other.motion.town_from_body(stamp)));
  }
}

TEST_CASE("the paper's drive is 1.24 km long and closes five loops or more, short drives come back too") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    for (const std::size_t scans : {std::size_t{40}, std::size_t{120}, std::size_t{924}}) {
      const World world(short_drive(scans, seed));
      CAPTURE(seed, scans);
      std::vector<Eigen::Vector3d> places;
      for (std::size_t scan = 0; scan < scans; ++scan)
        places.push_back(
            world.motion
                .town_from_body(world.motion.roll_stamp_ns() + static_cast<std::int64_t>(scan) * 1200 * ms)
                .translation_m);
      std::size_t revisits = 0;
      bool is_near = false;
      for (std::size_t late = 20; late < places.size(); ++late) {
        bool near = false;
        for (std::size_t early = 0; early + 20 <= late && !near; ++early)
          near = (places[late] - places[early]).norm() < (scans == 40 ? 8 : 3);
        if (near && !is_near) ++revisits;
        is_near = near;
      }
      CHECK(revisits >= (scans == 924 ? 5U : 1U));
      if (scans == 924) {
        CHECK(world.motion.way_m(world.motion.stop_stamp_ns()) == Approx(1240).margin(10));
        CHECK(1e-9 * static_cast<double>(world.motion.stop_stamp_ns() - world.motion.roll_stamp_ns()) ==
              Approx(924 * 1.2).margin(3));
      }
    }
  }
}
