#include "alces/loop_detector.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

using namespace alces;

namespace {

constexpr std::size_t plan(const LoopDetectorConfig& config) {
  Arena counting;
  const LoopDetector detector(counting, config);
  return counting.used_bytes();
}

constexpr LoopDetectorConfig plain_config{.scan_capacity = 2000, .minimum_gap_m = 30};
constexpr LoopDetectorConfig rich_config{
    .scan_capacity = 2000, .radius_cap_m = 40, .sigma_factor = 2, .minimum_gap_m = 30, .use_gps = true};
alignas(Arena::alignment) std::byte block[plan(rich_config)];

struct BruteForce {
  std::vector<Eigen::Vector3d> positions_m;
  std::vector<double> driven_m;
  std::vector<Eigen::Vector3d> gps_positions_m;  // NaN: none

  [[nodiscard]] std::optional<LoopDetector::Nearby> nearest(const Eigen::Vector3d& position_m,
                                                            std::uint32_t newest_scan, double radius_m,
                                                            std::uint32_t gap, double gap_m,
                                                            const Eigen::Vector3d* gps_m = nullptr) const {
    std::optional<LoopDetector::Nearby> best;
    for (std::uint32_t i = 0; i < positions_m.size() && i + gap <= newest_scan; ++i) {
      if (driven_m[i] > driven_m[newest_scan] - gap_m) break;
      const bool by_gps = gps_m != nullptr && gps_positions_m[i].allFinite();
      const double distance_m =
          by_gps ? (gps_positions_m[i] - *gps_m).norm() : (positions_m[i] - position_m).norm();
      if (distance_m <= radius_m && (!best || distance_m < best->distance_m)) best = {i, distance_m};
    }
    return best;
  }
};

bool is_same(const std::optional<LoopDetector::Nearby>& a, const std::optional<LoopDetector::Nearby>& b) {
  if (!a || !b) return !a && !b;
  return a->scan == b->scan && a->distance_m == b->distance_m;
}

/// What the trigger says of a row of distances; a negative one is out of reach. "l@observed " for each loop.
std::string loops_of(LoopTriggerConfig config, const std::vector<double>& distances_m) {
  LoopTrigger trigger(config);
  std::string said;
  std::uint32_t scan = 100;
  for (const double distance_m : distances_m) {
    std::optional<LoopDetector::Nearby> nearby;
    if (distance_m >= 0) nearby = {scan - 100, distance_m};
    if (const auto loop = trigger.observe(scan, nearby)) {
      CHECK(loop->first == loop->last - 100);
      said += std::to_string(loop->last - 100) + "@" + std::to_string(scan - 100) + " ";
    }
    ++scan;
  }
  if (const auto loop = trigger.finish()) said += std::to_string(loop->last - 100) + "@end ";
  CHECK_FALSE(trigger.finish());
  return said;
}

}  // namespace

TEST_CASE("the detector finds what a search of the whole list finds, on random walks") {
  std::mt19937 random(1);
  std::normal_distribution<double> step_m(0, 4);
  for (int walk = 0; walk < 6; ++walk) {
    Arena arena(block);
    LoopDetector detector(arena, plain_config);
    BruteForce brute;
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
    double driven_m = 0;
    if (walk == 5) position_m.setConstant(1e9);
    int found = 0;
    for (std::uint32_t scan = 0; scan < plain_config.scan_capacity; ++scan) {
      const Eigen::Vector3d step(step_m(random), step_m(random), walk % 2 == 0 ? 0 : step_m(random) / 4);
      position_m += step;
      // Every other walk now and then crawls, so that many scans make few metres.
      driven_m += scan / 50 % 2 == 0 ? step.norm() : 0.1 * (walk % 2);
      REQUIRE(detector.add(position_m, driven_m) == Status::ok);
      brute.positions_m.push_back(position_m);
      brute.driven_m.push_back(driven_m);
      const auto nearest = detector.nearest(position_m, scan);
      if (!is_same(nearest, brute.nearest(position_m, scan, 15, 20, 30)))
        FAIL("walk " << walk << ", scan " << scan);
      if (nearest) ++found;
    }
    CHECK(found > 100);
    CHECK(detector.add(position_m, driven_m) == Status::no_scan_capacity);
    CHECK(detector.scan_count() == plain_config.scan_capacity);
  }
}

TEST_CASE(
    "reach grows with the uncertainty up to its cap, and GPS positions count where both scans have one") {
  std::mt19937 random(2);
  std::normal_distribution<double> step_m(0, 6);
  Arena arena(block);
  LoopDetector detector(arena, rich_config);
  BruteForce brute;
  Eigen::Vector3d true_m = Eigen::Vector3d::Zero();
  for (std::uint32_t scan = 0; scan < rich_config.scan_capacity; ++scan) {
    true_m += Eigen::Vector3d(step_m(random), step_m(random), 0);
    const Eigen::Vector3d drifted_m = true_m + Eigen::Vector3d(0.05 * scan, 0, 0);
    const bool with_gps = random() % 3 != 0;
    const Eigen::Vector3d gps_m = true_m + Eigen::Vector3d(5000, step_m(random), 0);
    REQUIRE(detector.add(drifted_m, 6.0 * scan, with_gps ? &gps_m : nullptr) == Status::ok);
    brute.positions_m.push_back(drifted_m);
    brute.driven_m.push_back(6.0 * scan);
    brute.gps_positions_m.push_back(with_gps ? gps_m : Eigen::Vector3d::Constant(std::nan("")));
    const double sigma_m = 0.01 * scan;
    const double radius_m = std::min(40.0, 15 + 2 * sigma_m);
    const Eigen::Vector3d* gps = with_gps ? &gps_m : nullptr;
    if (!is_same(detector.nearest(drifted_m, scan, sigma_m, gps),
                 brute.nearest(drifted_m, scan, radius_m, 20, 30, gps))) {
      FAIL("scan " << scan);
    }
  }
  // the map is bent: other positions, the same GPS positions
  std::vector<Pose> poses;
  for (std::uint32_t scan = 0; scan < rich_config.scan_capacity; ++scan) {
    poses.emplace_back();
    poses.back().translation_m = brute.positions_m[scan] = brute.positions_m[scan] * 0.8;
  }
  REQUIRE(detector.rebuild(poses) == Status::ok);
  for (std::uint32_t scan = 0; scan < rich_config.scan_capacity; scan += 7) {
    const Eigen::Vector3d& gps_m = brute.gps_positions_m[scan];
    const Eigen::Vector3d* gps = gps_m.allFinite() ? &gps_m : nullptr;
    CHECK(is_same(detector.nearest(brute.positions_m[scan], scan, 0, gps),
                  brute.nearest(brute.positions_m[scan], scan, 15, 20, 30, gps)));
  }
  CHECK(is_same(detector.nearest(true_m, 1999, std::nan("")), brute.nearest(true_m, 1999, 15, 20, 30)));
}

TEST_CASE("scans closer than the minimum gap are no loop, and of equally near ones the first is taken") {
  Arena arena(block);
  LoopDetector detector(arena, plain_config);
  const Eigen::Vector3d here_m(1, 2, 3);
  for (int scan = 0; scan < 30; ++scan) REQUIRE(detector.add(here_m, 2.0 * scan) == Status::ok);
  CHECK_FALSE(detector.nearest(here_m, 19));
  REQUIRE(detector.nearest(here_m, 20));
  CHECK(detector.nearest(here_m, 29)->scan == 0);
  CHECK(detector.nearest(here_m + Eigen::Vector3d(0, 15, 0), 29)->distance_m == 15);
  CHECK_FALSE(detector.nearest(here_m + Eigen::Vector3d(0, 15.001, 0), 29));
  detector.clear();
  CHECK_FALSE(detector.nearest(here_m, 29));
}

TEST_CASE(
    "scans of one pass are no loop, however densely they follow each other: the gap counts metres, too") {
  Arena arena(block);
  LoopDetector detector(arena, plain_config);
  const auto at = [](int scan) { return Eigen::Vector3d(0.25 * scan, 0, 0); };
  for (int scan = 0; scan < 200; ++scan) REQUIRE(detector.add(at(scan), 0.25 * scan) == Status::ok);
  for (std::uint32_t scan = 0; scan < 200; ++scan)
    CHECK_FALSE(detector.nearest(at(static_cast<int>(scan)), scan));
  // Back at the start: 49.75 m, 50 m ... driven. What was passed 30 m before may be met again, later scans
  // not.
  for (int scan = 0; scan < 100; ++scan) REQUIRE(detector.add(at(scan), 49.75 + 0.25 * scan) == Status::ok);
  for (std::uint32_t scan = 200; scan < 300; ++scan) {
    const Eigen::Vector3d place_m = at(static_cast<int>(scan) - 200);
    const auto nearest = detector.nearest(place_m, scan);
    REQUIRE(nearest);
    CHECK(nearest->scan == scan - 200);
    CHECK(nearest->distance_m == 0);
  }
}

TEST_CASE("positions that are not finite are refused, and absurdly far ones do no harm") {
  Arena arena(block);
  LoopDetector detector(arena, plain_config);
  const Eigen::Vector3d nan_m(0, std::nan(""), 0);
  const Eigen::Vector3d inf_m(0, 0, std::numeric_limits<double>::infinity());
  const Eigen::Vector3d zero_m = Eigen::Vector3d::Zero();
  CHECK_FALSE(detector.nearest(zero_m, 100));
  CHECK(detector.add(nan_m, 0) == Status::bad_pose);
  CHECK(detector.add(inf_m, 0) == Status::bad_pose);
  CHECK(detector.add(zero_m, std::nan("")) == Status::bad_pose);
  CHECK(detector.add(zero_m, 0, &zero_m) == Status::bad_config);
  CHECK(detector.scan_count() == 0);
  for (const double far_m : {1e9, 1e18, 1e30, 1e300, -1e9, -1e18, -1e30, -1e300}) {
    REQUIRE(detector.add({far_m, -far_m, far_m}, 0) == Status::ok);
  }
  while (detector.scan_count() <= 100) REQUIRE(detector.add({7e5, 0, 0}, 1000) == Status::ok);
  std::uint32_t scan = 0;
  for (const double far_m : {1e9, 1e18, 1e30, 1e300, -1e9, -1e18, -1e30, -1e300}) {
    const auto nearest = detector.nearest({far_m, -far_m, far_m}, 100);
    REQUIRE(nearest);
    CHECK(nearest->scan == scan++);
    CHECK_FALSE(detector.nearest({far_m, far_m, far_m}, 100));
  }
  CHECK_FALSE(detector.nearest(nan_m, 100));
  std::vector<Pose> poses(3);
  poses[2].translation_m = nan_m;
  CHECK(detector.rebuild(poses) == Status::bad_pose);
  CHECK(detector.scan_count() == 101);
  poses.assign(plain_config.scan_capacity + 1, Pose{});
  CHECK(detector.rebuild(poses) == Status::no_scan_capacity);
  poses.resize(3);
  CHECK(detector.rebuild(poses) == Status::ok);
  CHECK(detector.scan_count() == 3);
}

TEST_CASE("a detector's configuration is checked, and its memory is what the plan says") {
  CHECK(LoopDetector::validate(plain_config) == Status::ok);
  CHECK(LoopDetector::validate(rich_config) == Status::ok);
  CHECK(LoopDetector::validate({.minimum_gap_scans = 1}) == Status::ok);
  for (LoopDetectorConfig config :
       {LoopDetectorConfig{.radius_m = 0}, LoopDetectorConfig{.radius_m = 16},
        LoopDetectorConfig{.radius_m = std::nan("")},
        LoopDetectorConfig{.radius_cap_m = std::numeric_limits<double>::infinity()},
        LoopDetectorConfig{.sigma_factor = -1}, LoopDetectorConfig{.minimum_gap_scans = 0},
        LoopDetectorConfig{.minimum_gap_m = -1}, LoopDetectorConfig{.minimum_gap_m = std::nan("")}}) {
    CHECK(LoopDetector::validate(config) == Status::bad_config);
  }
  for (const LoopDetectorConfig& config : {plain_config, rich_config}) {
    Arena arena(block);
    const LoopDetector detector(arena, config);
    CHECK_FALSE(arena.overflowed());
    CHECK(arena.used_bytes() == plan(config));
  }
}

TEST_CASE(
    "a loop is closed at the closest approach: when the distance grows, reach is left, or the drive ends") {
  const LoopTriggerConfig at_once{.hysteresis_m = 0, .patience_scans = 0};
  CHECK(loops_of(at_once, {9, 7, 5, 6, 8, -1}) == "2@3 ");
  CHECK(loops_of(at_once, {-1, 9, 7, 5, -1, -1}) == "3@4 ");
  CHECK(loops_of(at_once, {9, 7, 5}) == "2@end ");
  CHECK(loops_of(at_once, {-1, -1}).empty());
  CHECK(loops_of(at_once, {}).empty());
  // one loop an approach; a fresh approach gives the next
  CHECK(loops_of(at_once, {9, 7, 8, 3, 2, 1, -1, 4, 5}) == "1@2 7@8 ");
}

TEST_CASE("small wobbles do not close a loop early, but waiting has an end") {
  CHECK(loops_of({.hysteresis_m = 1, .patience_scans = 0}, {9, 7, 7.5, 6, 6.9, 5, 7, 4}) == "5@6 ");
  CHECK(loops_of({.hysteresis_m = 1, .patience_scans = 3}, {9, 7, 7, 7, 7, 7}) == "1@4 ");
}

TEST_CASE("while the robot follows its old track, loops are closed at an interval if that is wanted") {
  const std::vector<double> follows = {5, 3, 4, 2, 2, 2, 2, 2, -1, 6};
  CHECK(loops_of({.hysteresis_m = 0}, follows) == "1@2 9@end ");
  CHECK(loops_of({.hysteresis_m = 0, .repeat_after_scans = 2}, follows) == "1@2 4@4 6@6 9@end ");
}
