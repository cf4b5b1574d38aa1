// The mapper: which loops are offered, how they are matched, which are believed, and who bends the map.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "alces/mapper.h"
#include "support/mapper_bench.h"
#include "support/plain_scene.h"

using namespace alces;
using namespace alces::test;

namespace {

/// Writes down what it is asked, and lifts the whole map but its origin, or says that it cannot.
class Lift final : public LoopRelaxation {
 public:
  explicit Lift(bool can) : can_(can) {}
  bool relax(const PoseGraph& graph, std::span<Pose> map_from_body) override {
    ++asked;
    asked_for = graph.edges().back();
    if (!can_) return false;
    for (Pose& pose : map_from_body.subspan(1)) pose.translation_m.z() += 1;
    return true;
  }
  int asked = 0;
  Edge asked_for;

 private:
  bool can_;
};

/// A field with huts on it.
Scene field_with(const std::vector<Eigen::Vector2d>& huts) {
  Scene scene;
  scene.rectangle({-40, -40, 0}, {80, 0, 0}, {0, 80, 0});
  for (const Eigen::Vector2d& at : huts) scene.box({at.x(), at.y(), 0}, {at.x() + 2.0, at.y() + 1.5, 2.5});
  return scene;
}
Scene yard() {
  return field_with({{5, 3}, {-4, 5}, {2, -6}, {-7, -3}, {9, -2}});
}
Scene other_yard() {
  return field_with({{0, 6}, {8, -6}, {-6, 1}, {5, 9}, {-3, -8}});
}

/// What becomes of the loop at the end of the drive round the block, with other thresholds.
LoopReport loop_verified_with(const LoopVerification& thresholds) {
  MapperConfig config = small_config();
  config.close_loops = false;
  config.loop_verification = thresholds;
  MapperBench mapper(config);
  drive_through(*mapper.mapper, round_the_block(), 49);
  const std::vector<Pose> before(mapper->graph().poses().begin(), mapper->graph().poses().end());
  LoopReport loop;
  REQUIRE(mapper->offer_loop(0, 48, loop) == Status::ok);
  const bool is_bent = !std::ranges::equal(before, mapper->graph().poses(), is_same_pose);
  const bool is_closed = loop.verdict == LoopVerdict::closed;
  CHECK(is_bent == is_closed);
  CHECK(mapper->counters().loops_closed == (is_closed ? 1 : 0));
  CHECK(mapper->graph().edge_count() == (is_closed ? 49 : 48));
  REQUIRE(mapper->loops().size() == 1);
  CHECK(mapper->loops()[0].verdict == loop.verdict);
  CHECK(loop.first == 0);
  CHECK(loop.last == 48);
  return loop;
}

/// Raises the end of the map by a storey, once; then it cannot.
class Raise final : public LoopRelaxation {
 public:
  bool relax(const PoseGraph&, std::span<Pose> map_from_body) override {
    if (std::exchange(is_done_, true)) return false;
    for (Pose& pose : map_from_body.subspan(30)) pose.translation_m.z() += 3;
    return true;
  }

 private:
  bool is_done_ = false;
};

}  // namespace

TEST_CASE("a loop offered from outside is judged like any other") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = small_config();
  config.close_loops = false;
  MapperBench mapper(config);
  drive_through(*mapper.mapper, drive, 50);
  LoopReport loop;
  CHECK(mapper->offer_loop(3, 3, loop) == Status::no_such_scan);
  CHECK(mapper->offer_loop(4, 3, loop) == Status::no_such_scan);
  CHECK(mapper->offer_loop(0, 50, loop) == Status::no_such_scan);
  CHECK(mapper->loops().empty());

  const std::vector<Pose> before(mapper->graph().poses().begin(), mapper->graph().poses().end());
  REQUIRE(mapper->offer_loop(0, 24, loop) == Status::ok);  // the opposite corner
  CHECK(loop.verdict == LoopVerdict::refused_overlap);
  CHECK(loop.overlap < config.loop_verification.minimum_overlap);
  CHECK(mapper->loops().size() == 1);
  CHECK(mapper->counters().loops_offered == 1);
  CHECK(mapper->counters().loops_closed == 0);
  CHECK(mapper->graph().edge_count() == 49);
  for (std::size_t i = 0; i < 50; ++i) {
    REQUIRE(mapper->graph().poses()[i].translation_m == before[i].translation_m);
  }

  REQUIRE(mapper->offer_loop(0, 48, loop) == Status::ok);  // the start again
  CAPTURE(to_string(loop.verdict), loop.overlap, loop.rms_m, loop.mahalanobis2);
  CHECK(loop.verdict == LoopVerdict::closed);
  CHECK(mapper->graph().edge_count() == 50);
}

TEST_CASE("each number of the thresholds refuses a loop by itself, from just beyond what the loop has") {
  const LoopVerification standard{.small_correction_m = 0};  // so that walls are asked for
  const LoopReport closed = loop_verified_with(standard);
  REQUIRE(closed.verdict == LoopVerdict::closed);
  REQUIRE(closed.mahalanobis2 > 0);
  const auto judged = [&](double LoopVerification::*number, double value) {
    LoopVerification thresholds = standard;
    thresholds.*number = value;
    const LoopReport loop = loop_verified_with(thresholds);
    CHECK(loop.overlap == closed.overlap);  // the match is the same, whatever is thought of it
    CHECK(loop.rms_m == closed.rms_m);
    CHECK(loop.iterations == closed.iterations);
    CHECK(loop.distance_m == closed.distance_m);
    CHECK(loop.correction_m == closed.correction_m);
    CHECK(loop.correction_rad == closed.correction_rad);
    return loop;
  };
  struct Number {
    double LoopVerification::*number;
    double limit;   // of this loop
    double beyond;  // just so far that it is refused
    LoopVerdict verdict;
    bool has_mahalanobis2;  // known by then
  };
  for (const Number& each :
       {Number{&LoopVerification::minimum_overlap, closed.overlap, std::nextafter(closed.overlap, 1.0),
               LoopVerdict::refused_overlap, false},
        Number{&LoopVerification::maximum_rms_m, closed.rms_m, std::nextafter(closed.rms_m, 0.0),
               LoopVerdict::refused_residual, false},
        Number{&LoopVerification::minimum_wall_fit, closed.wall_fit, std::nextafter(closed.wall_fit, 1.0),
               LoopVerdict::refused_walls, false},
        Number{&LoopVerification::maximum_mahalanobis2, closed.mahalanobis2,
               std::nextafter(closed.mahalanobis2, 0.0), LoopVerdict::refused_implausible, true}}) {
    CHECK(judged(each.number, each.limit).verdict == LoopVerdict::closed);
    const LoopReport refused = judged(each.number, each.beyond);
    CAPTURE(to_string(each.verdict), to_string(refused.verdict));
    CHECK(refused.verdict == each.verdict);
    CHECK(refused.wall_fit == closed.wall_fit);
    CHECK(refused.mahalanobis2 == (each.has_mahalanobis2 ? closed.mahalanobis2 : 0));
  }
  SECTION("and a correction that counts as small is not asked for walls") {
    LoopVerification thresholds = standard;
    thresholds.minimum_wall_fit = 1;
    const double moved_m = closed.correction_m + 15 * closed.correction_rad;
    thresholds.small_correction_m = moved_m;
    CHECK(loop_verified_with(thresholds).verdict == LoopVerdict::closed);
    thresholds.small_correction_m = std::nextafter(moved_m, 0.0);
    CHECK(loop_verified_with(thresholds).verdict == LoopVerdict::refused_walls);
  }
}

TEST_CASE("metascans that find too few partners are no match, and the loop is not judged further") {
  MapperConfig config = small_config();
  config.close_loops = false;
  config.loop_match.minimum_correspondences = 1'000'000;
  MapperBench mapper(config);
  drive_through(*mapper.mapper, round_the_block(), 49);
  LoopReport loop;
  REQUIRE(mapper->offer_loop(0, 48, loop) == Status::ok);
  CHECK(loop.verdict == LoopVerdict::refused_no_match);
  CHECK(loop.overlap > config.loop_verification.minimum_overlap);
  CHECK(loop.correction_m < 1e-9);  // nothing moved
  CHECK(loop.wall_fit == 0);
  CHECK(loop.mahalanobis2 == 0);
  CHECK(mapper->counters().loops_closed == 0);
  CHECK(mapper->graph().edge_count() == 48);
}

TEST_CASE("a place that looks the same a storey higher is refused as implausible, and the map stays") {
  MapperConfig config = small_config();
  config.close_loops = false;
  // A prior, the map's uncertainty, would not let the match go so far in the first place.
  config.use_motion_prior = false;
  Raise raise;
  MapperBench mapper(config, nullptr, &raise);
  drive_through(*mapper.mapper, round_the_block(), 50);
  LoopReport loop;
  REQUIRE(mapper->offer_loop(1, 49, loop) == Status::ok);
  REQUIRE(loop.verdict == LoopVerdict::closed);
  const std::vector<Pose> before(mapper->graph().poses().begin(), mapper->graph().poses().end());
  REQUIRE(mapper->offer_loop(0, 48, loop) == Status::ok);
  CAPTURE(to_string(loop.verdict), loop.mahalanobis2);
  CHECK(loop.verdict == LoopVerdict::refused_implausible);
  CHECK(loop.overlap >= config.loop_verification.minimum_overlap);
  CHECK(loop.rms_m <= config.loop_verification.maximum_rms_m);
  CHECK(loop.wall_fit >= config.loop_verification.minimum_wall_fit);
  CHECK(loop.correction_m == Approx(3).margin(0.05));
  CHECK(loop.mahalanobis2 > config.loop_verification.maximum_mahalanobis2);
  for (std::size_t i = 0; i < before.size(); ++i)
    REQUIRE(mapper->graph().poses()[i].translation_m == before[i].translation_m);
}

TEST_CASE(
    "the map's uncertainty holds a loop's match: it does not run to where a place only looks the same") {
  MapperConfig config = small_config();
  config.close_loops = false;
  config.loop_verification.ambiguity_sigmas = 0;  // there are few points
  Raise raise;
  MapperBench mapper(config, nullptr, &raise);
  drive_through(*mapper.mapper, round_the_block(), 50);
  LoopReport loop;
  REQUIRE(mapper->offer_loop(1, 49, loop) == Status::ok);
  REQUIRE(loop.verdict == LoopVerdict::closed);
  const std::vector<Pose> before(mapper->graph().poses().begin(), mapper->graph().poses().end());
  REQUIRE(mapper->offer_loop(0, 48, loop) == Status::ok);
  CAPTURE(to_string(loop.verdict), loop.correction_m, loop.expected_m);
  CHECK(loop.verdict != LoopVerdict::closed);
  CHECK(loop.correction_m < 5 * loop.expected_m);  // the storey is 3 m
  for (std::size_t i = 0; i < before.size(); ++i)
    REQUIRE(mapper->graph().poses()[i].translation_m == before[i].translation_m);
}

TEST_CASE("a heading that has drifted by 40 degrees is found by trying turned starts, and only so") {
  const Scene scene = street();
  const auto way = [](int step) { return pose_at(step, 0.2 * step, 1, 0); };
  for (const double drift_deg : {40.0, -40.0}) {
    for (const bool searches : {true, false}) {
      MapperConfig config = small_config();
      config.close_loops = false;
      config.search_steps = searches;
      config.loop_verification.small_correction_m = 0;
      config.loop_verification.minimum_wall_fit = 0.2;
      MapperBench mapper(config);
      for (int step = 0; step < 5; ++step) see(*mapper.mapper, scene, way(step), way(step));
      for (int i = 0; i < 6; ++i) see_nothing(*mapper.mapper, way(2));
      const Pose drifted_from_way =
          pose_at(0.3, -0.2, 0, 0) * way(2) * pose_at(0, 0, 0, drift_deg) * way(2).inverse();
      for (int step = 0; step < 3; ++step)
        see(*mapper.mapper, scene, way(step), drifted_from_way * way(step));
      LoopReport loop;
      REQUIRE(mapper->offer_loop(2, 13, loop) == Status::ok);
      CAPTURE(drift_deg, searches, to_string(loop.verdict), loop.overlap, loop.wall_fit, loop.mahalanobis2);
      CHECK(loop.verdict == (searches ? LoopVerdict::closed : LoopVerdict::refused_walls));
      if (!searches) continue;
      CHECK(loop.correction_rad == Approx(std::abs(drift_deg) * std::numbers::pi / 180).margin(0.01));
      CHECK(distance_m(mapper->graph().poses()[2], mapper->graph().poses()[13]) < 0.03);
    }
  }
}
TEST_CASE("when the nearest scan is of another place, an earlier visit to the right one closes the loop") {
  const Scene here = room();
  const Scene elsewhere = street();
  const auto way = [](int step) { return pose_at(0.3 * step, 0, 1, 0); };
  for (const std::uint32_t candidates : {3U, 1U}) {
    MapperConfig config = small_config();
    config.detector = {.radius_m = 1.9, .radius_cap_m = 1.9, .minimum_gap_scans = 6};
    config.trigger = {.hysteresis_m = 100, .patience_scans = 0};  // at the end only
    config.loop_search.candidates = candidates;
    MapperBench mapper(config);
    for (int step = 0; step < 5; ++step) see(*mapper.mapper, here, way(step), way(step));
    for (int i = 0; i < 3; ++i) see_nothing(*mapper.mapper, pose_at(100, 0, 1, 0));
    for (int step = 0; step < 5; ++step)  // 8 to 12: the map has it beside the first
      see(*mapper.mapper, elsewhere, way(step), pose_at(0, 2.2, 0, 0) * way(step));
    for (int i = 0; i < 3; ++i) see_nothing(*mapper.mapper, pose_at(200, 0, 1, 0));
    for (int step = 0; step < 5; ++step)  // 16 to 20: the first again, after a drift towards the other
      see(*mapper.mapper, here, way(step), pose_at(0, 1.4, 0, 0) * way(step));
    CHECK(mapper->loops().empty());
    LoopReport loop;
    REQUIRE(mapper->finish(loop));
    CAPTURE(candidates, to_string(mapper->loops()[0].verdict), to_string(loop.verdict));
    REQUIRE(mapper->loops().size() == std::min(candidates, 2U));
    const LoopReport& nearest = mapper->loops()[0];
    CHECK(nearest.first >= 8);
    CHECK(nearest.first <= 12);
    CHECK(nearest.distance_m == Approx(0.8).margin(0.1));
    CHECK(nearest.verdict != LoopVerdict::closed);
    CHECK(nearest.verdict != LoopVerdict::refused_implausible);  // it does not even come together
    if (candidates == 1) continue;
    CHECK(loop.last == nearest.last);
    CHECK(loop.first < 5);
    CHECK(loop.distance_m == Approx(1.4).margin(0.1));
    REQUIRE(loop.verdict == LoopVerdict::closed);
    const auto poses = mapper->graph().poses();
    const Pose truth = way(static_cast<int>(loop.first)).inverse() * way(static_cast<int>(loop.last) - 16);
    CHECK(distance_m(poses[loop.first].inverse() * poses[loop.last], truth) < 0.05);
  }
}
TEST_CASE("between long walls a loop's match does not stay where it slid to") {
  const Scene street = walled_street();
  for (const double drift_m : {0.0, 1.0, 1.6, 2.3, 3.0}) {
    for (const std::uint32_t steps : {40U, 0U}) {
      for (std::uint32_t trial = 0; trial < 4; ++trial) {
        MapperConfig config = small_config();
        config.voxel.cell_capacity = 16384;
        config.pool_bytes = std::size_t{16} << 20;
        config.close_loops = false;
        config.scan_match.minimum_correspondences = 1'000'000;  // so that the odometry stands
        config.loop_verification.maximum_mahalanobis2 = 1e12;
        config.search_steps = false;  // other starts would find it, too
        config.loop_verification.ambiguity_sigmas =
            0;  // what the match makes of it, not whether it is believed
        config.loop_verification.free_space_sigmas = 0;
        config.loop_search.shift_steps = steps;
        MapperBench mapper(config);
        for (std::uint32_t i = 0; i < 10; ++i) {  // there, and once more the same way, after a drift
          const Pose at = pose_at(i % 5, 0, 1, 0);
          Pose odometry = at;
          if (i >= 5) odometry.translation_m += Eigen::Vector3d(drift_m, 0.3, 0.02);
          const std::vector<Point> points = street.scan(at, 12000, 14, 0.01, 100 * trial + i);
          ScanReport report;
          REQUIRE(mapper->add_scan(points, &odometry, report) == Status::ok);
        }
        LoopReport loop;
        REQUIRE(mapper->offer_loop(2, 7, loop) == Status::ok);
        const auto poses = mapper->graph().poses();
        const double off_m = (poses[2].inverse() * poses[7]).translation_m.norm();
        CAPTURE(drift_m, steps, trial, off_m, to_string(loop.verdict), loop.overlap, loop.rms_m);
        CHECK((off_m < 0.02) == (steps > 0 || drift_m == 0));
      }
    }
  }
}

TEST_CASE("a loop is not believed when nothing but the ground fits") {
  const Scene here = yard();
  const Scene elsewhere = other_yard();
  const double least = LoopVerification{}.minimum_wall_fit;
  const auto offered = [&](const Scene& then, const Pose& drift, double minimum_wall_fit) {
    MapperConfig config = small_config();
    config.voxel.cell_capacity = 16384;
    config.pool_bytes = std::size_t{16} << 20;
    config.close_loops = false;
    config.scan_match.minimum_correspondences = 1'000'000;  // so that the odometry stands
    config.loop_match.degenerate_ratio = 0;                 // so that a few chance pairs are a match
    config.loop_verification.maximum_mahalanobis2 = 1e12;
    config.loop_verification.minimum_wall_fit = minimum_wall_fit;
    config.loop_verification.ambiguity_sigmas = 0;  // it would refuse, too
    config.loop_verification.free_space_sigmas = 0;
    MapperBench mapper(config);
    for (std::uint32_t i = 0; i < 10; ++i) {
      const Pose at = pose_at(0.5 * (i % 5), 0, 1, 0);
      const Pose odometry = i < 5 ? at : at * drift;
      const std::vector<Point> points = (i < 5 ? here : then).scan(at, 5000, 15, 0.01, i);
      ScanReport report;
      REQUIRE(mapper->add_scan(points, &odometry, report) == Status::ok);
    }
    LoopReport loop;
    REQUIRE(mapper->offer_loop(2, 7, loop) == Status::ok);
    return loop;
  };
  // Lifted, and tilted in place: the ground is 0.8 m off at 15 m, although scan l itself hardly moves.
  for (const Pose& drift : {pose_at(0.3, 0.2, 0.8, 0), pose_at(0, 0, 0, 0, 3)}) {
    const LoopReport same = offered(here, drift, least);
    const LoopReport other = offered(elsewhere, drift, least);
    CAPTURE(same.wall_fit, same.overlap, other.wall_fit, other.overlap, other.rms_m, other.correction_m,
            other.correction_rad);
    CHECK(same.verdict == LoopVerdict::closed);
    CHECK(same.wall_fit > 0.5);
    CHECK(other.overlap > LoopVerification{}.minimum_overlap);
    CHECK(other.rms_m < LoopVerification{}.maximum_rms_m);
    CHECK(other.verdict == LoopVerdict::refused_walls);
    CHECK(other.wall_fit < least);
    CHECK(offered(elsewhere, drift, 0).verdict == LoopVerdict::closed);
  }
}

TEST_CASE("while the vehicle follows its old track, loops are closed again and again, if that is wanted") {
  const Scene scene = street();
  for (const std::uint32_t interval : {3U, 0U}) {
    MapperConfig config = small_config();
    config.detector.minimum_gap_scans = 10;
    config.detector.minimum_gap_m = 0;
    config.loop_verification.known_m = 0;  // also those that tell little
    config.trigger.repeat_after_scans = interval;
    MapperBench mapper(config);
    for (int i = 0; i <= 48; ++i) {  // 24 m up the street, and the same way back
      const Pose at = pose_at(-12 + std::min(i, 48 - i), 0, 1, 0);
      see(*mapper.mapper, scene, at, at);
    }
    LoopReport last;
    CHECK_FALSE(mapper->finish(last));
    const auto loops = mapper->loops();
    CAPTURE(interval, loops.size());
    if (interval == 0) {
      REQUIRE(loops.size() == 1);
    } else {
      REQUIRE(loops.size() >= 4);
    }
    for (std::uint32_t i = 0; i < loops.size(); ++i) {
      CHECK(loops[i].verdict == LoopVerdict::closed);
      CHECK(loops[i].first == 48 - loops[i].last);
      if (i > 1) CHECK(loops[i].last == loops[i - 1].last + interval);  // the first is told of later
    }
    CHECK(mapper->counters().loops_closed == loops.size());
  }
}
TEST_CASE("GPS positions offer a loop that the drifted poses alone would not") {
  const Scene scene = room();
  const auto way = [](int step) { return pose_at(0.3 * step, 0, 1, 0); };
  const auto gps_m = [](const Pose& at) {  // in a frame of its own
    return Eigen::Vector3d(4e5 + at.translation_m.y(), 5e6 - at.translation_m.x(), 80);
  };
  const auto drive = [&](MapperBench& mapper, bool with_gps, const Eigen::Vector3d& when_covered_m) {
    const auto see_nothing_at = [&](double x_m) {
      const Eigen::Vector3d position_m = when_covered_m + x_m * Eigen::Vector3d::UnitX();
      for (int i = 0; i < 3; ++i)
        see_nothing(*mapper.mapper, pose_at(x_m, 0, 1, 0), with_gps ? &position_m : nullptr);
    };
    const auto see_way = [&](const Pose& drifted_from_way) {
      for (int step = 0; step < 5; ++step) {
        const Eigen::Vector3d position_m = gps_m(way(step));
        see(*mapper.mapper, scene, way(step), drifted_from_way * way(step), with_gps ? &position_m : nullptr);
      }
    };
    see_nothing_at(50);              // 0 to 2
    see_way(Pose{});                 // 3 to 7
    see_nothing_at(100);             // 8 to 10
    see_way(pose_at(0, 1.4, 0, 0));  // 11 to 15
    LoopReport loop;
    mapper->finish(loop);
  };
  const auto config_with = [](bool use_gps, double radius_m) {
    MapperConfig config = small_config();
    config.scans_around_first = config.scans_before_last = 0;  // none of the covered ones is looked at
    config.detector = {
        .radius_m = radius_m, .radius_cap_m = radius_m, .minimum_gap_scans = 6, .use_gps = use_gps};
    config.trigger = {.hysteresis_m = 100, .patience_scans = 0};  // at the end only
    return config;
  };
  const double nan = std::nan("");
  const double inf = std::numeric_limits<double>::infinity();

  SECTION("without them, or when none are given, it is not offered") {
    MapperBench without(config_with(false, 1));
    drive(without, false, {0, 0, 0});
    CHECK(without->loops().empty());
    MapperBench none_given(config_with(true, 1));
    drive(none_given, false, {0, 0, 0});
    CHECK(none_given->loops().empty());
  }
  SECTION("those that are not to be used change nothing, whatever they are") {
    MapperBench without(config_with(false, 2));
    drive(without, false, {0, 0, 0});
    REQUIRE(without->counters().loops_closed == 1);
    MapperBench not_used(config_with(false, 2));
    drive(not_used, true, {nan, 0, 0});
    CHECK(not_used->loops().size() == 1);
    CHECK(not_used->counters().scans_refused == 0);
    CHECK(not_used->counters().gps_not_finite == 0);
    CHECK(is_same(*not_used.mapper, *without.mapper));
  }
  SECTION("with them it is, and positions that are no numbers are left out and counted") {
    for (const Eigen::Vector3d& when_covered_m : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(nan, 0, 0),
                                                  Eigen::Vector3d(0, inf, 0), Eigen::Vector3d(0, 0, -inf)}) {
      MapperBench mapper(config_with(true, 1));
      drive(mapper, true, when_covered_m);
      CAPTURE(when_covered_m.transpose());
      REQUIRE(mapper->loops().size() == 1);
      const LoopReport& loop = mapper->loops()[0];
      CHECK(loop.first >= 3);
      CHECK(loop.first <= 7);
      CHECK(loop.last == loop.first + 8);  // the same place
      CHECK(loop.distance_m < 1e-6);
      CHECK(loop.verdict == LoopVerdict::closed);
      CHECK(loop.correction_m == Approx(1.4).margin(0.05));
      CHECK(mapper->scan_count() == 16);
      CHECK(mapper->counters().scans_refused == 0);
      CHECK(mapper->counters().gps_not_finite == (when_covered_m.allFinite() ? 0 : 6));
    }
  }
}

TEST_CASE("after a loop was closed, the next is looked for in the bent map") {
  const Scene scene = room();
  const auto way = [](int step) { return pose_at(0.3 * step, 0, 1, 0); };
  const Pose drifted_from_way = pose_at(0, 1.4, 0, 0);
  MapperConfig config = small_config();
  config.detector = {.radius_m = 1, .radius_cap_m = 1, .minimum_gap_scans = 4};
  config.trigger = {.hysteresis_m = 100, .patience_scans = 0};  // at the end only
  MapperBench mapper(config);
  const auto see_nothing_at = [&](double x_m) {
    for (int i = 0; i < 3; ++i) see_nothing(*mapper.mapper, pose_at(x_m, 0, 1, 0));
  };
  for (int step = 0; step < 5; ++step) see(*mapper.mapper, scene, way(step), way(step));
  see_nothing_at(100);
  for (int step = 0; step < 7; ++step)  // 8 to 14, two steps farther than before
    see(*mapper.mapper, scene, way(step), drifted_from_way * way(step));
  LoopReport loop;
  REQUIRE(mapper->offer_loop(2, 10, loop) == Status::ok);
  REQUIRE(loop.verdict == LoopVerdict::closed);
  see_nothing_at(200);
  see(*mapper.mapper, scene, way(6), drifted_from_way * way(6));
  REQUIRE(mapper->finish(loop));
  CHECK(loop.first == 14);
  CHECK(loop.last == 18);
  CHECK(loop.distance_m < 0.1);
}

TEST_CASE("another back end bends the map in LOA's place, once for every loop that is believed") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = small_config();
  config.close_loops = false;
  Lift lift(true);
  MapperBench mapper(config, nullptr, &lift);
  drive_through(*mapper.mapper, drive, 50);
  const std::vector<Pose> before(mapper->graph().poses().begin(), mapper->graph().poses().end());
  LoopReport loop;
  REQUIRE(mapper->offer_loop(0, 24, loop) == Status::ok);  // the opposite corner
  CHECK(lift.asked == 0);
  REQUIRE(mapper->offer_loop(0, 48, loop) == Status::ok);
  REQUIRE(loop.verdict == LoopVerdict::closed);
  CHECK(lift.asked == 1);
  CHECK(lift.asked_for.closes_loop);
  CHECK(lift.asked_for.from == 0);
  CHECK(lift.asked_for.to == 48);
  CHECK(mapper->graph().edge_count() == 50);
  CHECK(mapper->counters().loops_not_relaxed == 0);
  CHECK(mapper->graph().poses()[0].translation_m == before[0].translation_m);
  for (std::size_t i = 1; i < 50; ++i)
    REQUIRE(mapper->graph().poses()[i].translation_m == before[i].translation_m + Eigen::Vector3d::UnitZ());
}

TEST_CASE("where another back end cannot bend the map, LOA does, and it is counted") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = small_config();
  config.close_loops = false;
  Lift lift(false);
  MapperBench mapper(config, nullptr, &lift);
  MapperBench plain(config);
  drive_through(*mapper.mapper, drive, 50);
  drive_through(*plain.mapper, drive, 50);
  LoopReport loop;
  REQUIRE(mapper->offer_loop(0, 48, loop) == Status::ok);
  CHECK(loop.verdict == LoopVerdict::closed);
  REQUIRE(plain->offer_loop(0, 48, loop) == Status::ok);
  CHECK(lift.asked == 1);
  CHECK(mapper->counters().loops_not_relaxed == 1);
  CHECK(mapper->graph().edge_count() == plain->graph().edge_count());
  CHECK(is_same(*mapper.mapper, *plain.mapper));
}

TEST_CASE("with no room for loops every loop is refused for that reason") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = small_config();
  config.close_loops = false;
  config.loop_capacity = 0;
  config.scan_capacity = 49;
  MapperBench mapper(config);
  drive_through(*mapper.mapper, drive, 49);
  LoopReport loop;
  for (const std::uint32_t first : {0U, 1U}) {
    REQUIRE(mapper->offer_loop(first, 48, loop) == Status::ok);
    CAPTURE(to_string(loop.verdict));
    CHECK(loop.verdict == LoopVerdict::refused_capacity);
  }
  CHECK(mapper->counters().loops_not_listed == 2);
}
