// The mapper: what becomes of a step that is not believed, of parts, and of loops that tell nothing new.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "alces/mapper.h"
#include "support/mapper_bench.h"
#include "support/plain_scene.h"

using namespace alces;
using namespace alces::test;

namespace {

/// Points all about, of no surface at all: a cloud of steam.
std::vector<Point> steam(std::uint64_t seed) {
  sim::Random random(seed);
  std::vector<Point> points;
  for (int i = 0; i < 3000; ++i) {
    points.push_back(as_point({random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-1, 3)}));
  }
  return points;
}

ScanReport add(Mapper& mapper, const std::vector<Point>& points, const Pose* odometry) {
  ScanReport report;
  REQUIRE(mapper.add_scan(points, odometry, report) == Status::ok);
  return report;
}

/// What the mapper has learned of the odometry, learned once more from the steps of its map.
MotionPrior::Prediction prediction_for(const Mapper& mapper, const BlockDrive& drive, std::size_t next) {
  MotionPrior prior(mapper.config().motion);
  prior.start(&drive.odometry[0]);
  for (std::size_t i = 1; i < next; ++i) {
    const Pose step = mapper.graph().poses()[i - 1].inverse() * mapper.graph().poses()[i];
    prior.observe(prior.predict(&drive.odometry[i]), step, &drive.odometry[i], true);
  }
  return prior.predict(&drive.odometry[next]);
}

}  // namespace

TEST_CASE("a step that is not believed lies where the odometry says, and is as sure as odometry is") {
  const BlockDrive& drive = round_the_block();
  MapperBench mapper(small_config());
  drive_through(*mapper.mapper, drive, 8);
  for (std::uint32_t i = 1; i < 8; ++i) REQUIRE(mapper->step_verdict(i) == StepVerdict::believed);
  const MotionPrior::Prediction prediction = prediction_for(*mapper.mapper, drive, 8);
  const ScanReport report = add(*mapper.mapper, steam(1), &drive.odometry[8]);
  CAPTURE(to_string(report.step), to_string(report.doubt), report.overlap, report.fit);
  CHECK(report.step == StepVerdict::on_odometry);
  CHECK(report.is_predicted);
  CHECK(report.doubt != StepDoubt::none);
  CHECK(mapper->step_verdict(8) == StepVerdict::on_odometry);
  const auto poses = mapper->graph().poses();
  const Edge& edge = mapper->graph().edges()[7];
  REQUIRE(edge.to == 8);
  CHECK(distance_m(poses[7].inverse() * poses[8], prediction.last_from_next) < 1e-6);
  CHECK(distance_m(edge.from_from_to, prediction.last_from_next) < 1e-6);

  PairCovariance odometry;
  odometry.is_known = true;
  const Eigen::Matrix3d axes = prediction.last_from_next.rotation.toRotationMatrix();
  odometry.covariance.topLeftCorner<3, 3>() =
      axes * prediction.variance.head<3>().asDiagonal() * axes.transpose();
  odometry.covariance.bottomRightCorner<3, 3>() =
      axes * prediction.variance.tail<3>().asDiagonal() * axes.transpose();
  const EdgeVariance expected =
      edge_variance(odometry, Pose{prediction.last_from_next.rotation, Eigen::Vector3d::Zero()},
                    mapper->config().edge_uncertainty);
  CHECK(edge.variance.x_m2 == Approx(expected.x_m2).epsilon(1e-4));
  CHECK(edge.variance.y_m2 == Approx(expected.y_m2).epsilon(1e-4));
  CHECK(edge.variance.z_m2 == Approx(expected.z_m2).epsilon(1e-4));
  CHECK(edge.variance.rotation_rad2 == Approx(expected.rotation_rad2).epsilon(1e-4));
  CHECK(edge.variance.x_m2 > 3 * mapper->graph().edges()[6].variance.x_m2);

  // The drive goes on, where it is.
  CHECK(add(*mapper.mapper, drive.scans[9], &drive.odometry[9]).step != StepVerdict::on_odometry);
  CHECK(distance_m(mapper->graph().poses()[9], drive.truth[9]) < 0.15);
  const MapHealth health = mapper->health();
  CHECK(health.on_odometry == 1);
  CHECK(health.parts == 1);
  CHECK(health.verdict != MapVerdict::bad);
}

TEST_CASE("judged no more, a match is taken whatever it is") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = small_config();
  config.judge_steps = config.search_steps = false;
  MapperBench mapper(config);
  drive_through(*mapper.mapper, drive, 8);
  CHECK(add(*mapper.mapper, steam(1), &drive.odometry[8]).step == StepVerdict::believed);
}

TEST_CASE("without odometry and without overlap a new part of the map begins, and a loop rejoins it") {
  const Scene here = street();
  const Scene elsewhere = room();
  const auto way = [](int step) { return pose_at(-3 + 1.5 * step, 0, 1, 0); };
  MapperConfig config = small_config();
  config.close_loops = false;
  MapperBench mapper(config);
  const auto drive = [&](const Scene& scene, int count, std::uint64_t seed) {
    for (int step = 0; step < count; ++step)
      add(*mapper.mapper, scene.scan(way(step), 4000, 15, 0.01, seed + static_cast<std::uint64_t>(step)),
          nullptr);
  };
  drive(here, 6, 1);
  CHECK(mapper->health().parts == 1);
  CHECK(mapper->step_verdict(1) == StepVerdict::found);  // a first step that nothing is known of
  for (std::uint32_t i = 1; i < 6; ++i)
    CHECK(distance_m(mapper->graph().poses()[i], way(0).inverse() * way(static_cast<int>(i))) < 0.05);

  add(*mapper.mapper, steam(7), nullptr);
  add(*mapper.mapper, steam(8), nullptr);
  add(*mapper.mapper, steam(9), nullptr);
  CHECK(mapper->step_verdict(6) == StepVerdict::apart);
  const std::uint32_t parts_in_steam = mapper->health().parts;
  CHECK(parts_in_steam >= 2);
  CHECK(mapper->health().verdict == MapVerdict::bad);
  CHECK(mapper->health().doubt == MapDoubt::parts);
  CHECK(mapper->graph().edges()[5].variance.x_m2 > 0.5);  // nobody knows

  drive(here, 6, 30);  // the first street again: scans 9 to 14
  CHECK(mapper->step_verdict(9) == StepVerdict::apart);
  const std::uint32_t parts = mapper->health().parts;
  CHECK(parts > 1);
  const std::uint32_t last = mapper->scan_count() - 1;
  LoopReport loop;
  REQUIRE(mapper->offer_loop(4, last - 1, loop) == Status::ok);
  CAPTURE(to_string(loop.verdict), loop.overlap, loop.fit, loop.usual_fit, loop.correction_m, loop.expected_m,
          loop.mahalanobis2);
  REQUIRE(loop.verdict == LoopVerdict::closed);
  CHECK(mapper->step_verdict(6) == StepVerdict::rejoined);
  CHECK(mapper->step_verdict(9) == StepVerdict::rejoined);
  CHECK(mapper->health().parts == 1);
  CHECK(mapper->health().doubt != MapDoubt::parts);
  const auto poses = mapper->graph().poses();
  CHECK(distance_m(poses[4].inverse() * poses[last - 1], Pose{}) < 0.05);
}

TEST_CASE("an odometry that freezes is overruled by matches that go on as the vehicle went") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = small_config();
  config.close_loops = false;
  MapperBench mapper(config);
  std::uint32_t overruled = 0;
  for (std::size_t i = 0; i < 14; ++i) {
    const ScanReport report =
        add(*mapper.mapper, drive.scans[i], &drive.odometry[std::min<std::size_t>(i, 4)]);
    if (report.step == StepVerdict::against_odometry) ++overruled;
    CAPTURE(i, to_string(report.step), to_string(report.doubt), report.fit, report.overlap,
            report.motion_mahalanobis2);
    CHECK(distance_m(mapper->graph().poses()[i], drive.truth[i]) < 0.2);
  }
  CHECK(overruled >= 1);
  CHECK(mapper->health().against_odometry == overruled);
}

TEST_CASE("a drive that breaks once is in two parts, not more") {
  const Scene here = street();
  const Scene elsewhere = room();
  MapperConfig config = small_config();
  config.close_loops = false;
  MapperBench mapper(config);
  for (std::uint64_t i = 0; i < 6; ++i)
    add(*mapper.mapper, here.scan(pose_at(-3 + 1.5 * static_cast<double>(i), 0, 1, 0), 4000, 15, 0.01, i),
        nullptr);
  for (std::uint64_t i = 0; i < 6; ++i)
    add(*mapper.mapper,
        elsewhere.scan(pose_at(0.3 * static_cast<double>(i), 0, 1, 0), 4000, 15, 0.01, 20 + i), nullptr);
  CHECK(mapper->step_verdict(6) == StepVerdict::apart);
  for (std::uint32_t scan = 7; scan < 12; ++scan) {
    CAPTURE(scan, to_string(mapper->step_verdict(scan)));
    CHECK(mapper->step_verdict(scan) != StepVerdict::apart);
  }
  CHECK(mapper->health().parts == 2);
}

TEST_CASE("scans that see less of the way than the odometry, all along, make the map doubtful") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = small_config();
  config.close_loops = false;
  MapperBench mapper(config);
  for (std::size_t i = 0; i < 20; ++i) {
    Pose odometry = drive.odometry[i];
    odometry.translation_m *= 1.15;
    add(*mapper.mapper, drive.scans[i], &odometry);
  }
  const MapHealth health = mapper->health();
  CAPTURE(to_string(health.doubt), health.odometry_scale);
  CHECK(health.odometry_scale < 0.9);
  CHECK(health.odometry_scale > 0.85);
  CHECK(health.verdict == MapVerdict::doubtful);
  CHECK(health.doubt == MapDoubt::odometry_scale);
}

TEST_CASE("the scans where a map hangs together worst are listed, the worst first") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = small_config();
  config.close_loops = false;
  MapperBench mapper(config);
  std::vector<std::uint32_t> on_odometry;
  for (std::size_t i = 0; i < 40; ++i) {
    const bool is_steam = i == 9 || i == 17 || i == 30;
    const ScanReport report = add(*mapper.mapper, is_steam ? steam(i) : drive.scans[i], &drive.odometry[i]);
    if (report.step == StepVerdict::on_odometry) on_odometry.push_back(report.scan);
  }
  for (const std::uint32_t scan : {9U, 17U, 30U})
    REQUIRE(std::ranges::find(on_odometry, scan) != on_odometry.end());
  add(*mapper.mapper, steam(77), nullptr);  // 40: a part of its own
  REQUIRE(mapper->step_verdict(40) == StepVerdict::apart);
  const MapHealth health = mapper->health();
  const std::span<const std::uint32_t> weakest = std::span(health.weakest).first(health.weakest_count);
  REQUIRE(weakest.size() >= 4);
  CHECK(weakest[0] == 40);
  for (std::size_t i = 1; i <= std::min<std::size_t>(on_odometry.size(), weakest.size() - 1); ++i) {
    CAPTURE(i, weakest[i]);
    CHECK(std::ranges::find(on_odometry, weakest[i]) != on_odometry.end());
  }
  std::vector<std::uint32_t> once(weakest.begin(), weakest.end());
  std::ranges::sort(once);
  CHECK(std::ranges::adjacent_find(once) == once.end());
  CHECK(std::ranges::find(once, 0U) == once.end());  // the first scan has nothing to hang on
}

TEST_CASE("more weak scans than the list has room for: those that are listed are the worst") {
  const BlockDrive& drive = round_the_block();
  MapperBench mapper(small_config());
  drive_through(*mapper.mapper, drive, 3);
  for (std::size_t i = 3; i < 13; ++i) add(*mapper.mapper, steam(i), &drive.odometry[i]);
  add(*mapper.mapper, steam(50), nullptr);
  add(*mapper.mapper, steam(51), nullptr);
  REQUIRE(mapper->step_verdict(13) == StepVerdict::apart);
  REQUIRE(mapper->step_verdict(14) == StepVerdict::apart);
  const MapHealth health = mapper->health();
  CHECK(health.weakest_count == MapHealth::most_weakest);
  CHECK(std::max(health.weakest[0], health.weakest[1]) == 14);
  CHECK(std::min(health.weakest[0], health.weakest[1]) == 13);
}

TEST_CASE("a patrol of many laps adds loops that tell something, and never uses them up before its scans") {
  const BlockDrive& drive = round_the_block();
  constexpr std::uint32_t lap = 48;
  constexpr std::uint32_t laps = 7;
  MapperConfig config = small_config();
  config.scan_capacity = laps * lap;
  config.loop_capacity = 24;
  config.pool_bytes = std::size_t{20} << 20;
  MapperBench mapper(config);
  Pose odometry;
  std::vector<std::uint32_t> closed_in_lap(laps);
  for (std::uint32_t i = 0; i < laps * lap; ++i) {
    if (i > 0) {
      const std::uint32_t step = (i - 1) % lap;
      odometry = odometry * (drive.odometry[step].inverse() * drive.odometry[step + 1]);
    }
    const std::uint32_t before = mapper->counters().loops_closed;
    add(*mapper.mapper, drive.scans[i % lap], &odometry);
    closed_in_lap[i / lap] += mapper->counters().loops_closed - before;
  }
  const Mapper::Counters& counters = mapper->counters();
  CAPTURE(counters.loops_closed, counters.loops_known, counters.loops_offered, closed_in_lap);
  CHECK(counters.loops_closed >= 3);
  CHECK(counters.loops_closed <= config.loop_capacity);
  CHECK(closed_in_lap[laps - 1] > 0);  // there are some left for the last one
  CHECK(counters.loops_known > 0);
  for (const LoopReport& loop : mapper->loops()) {
    CHECK(loop.verdict != LoopVerdict::known);  // such are not listed
    if (loop.verdict == LoopVerdict::refused_capacity) CHECK(loop.last >= (laps - 1) * lap);
  }
  CHECK(mapper->graph().edge_count() == mapper->scan_count() - 1 + counters.loops_closed);
  for (std::uint32_t i = 0; i < lap; ++i) {  // and it stays right to the last lap
    CHECK(distance_m(mapper->graph().poses()[(laps - 1) * lap + i], drive.truth[i]) < 0.3);
  }
  CHECK(mapper->health().verdict == MapVerdict::good);
}

TEST_CASE("a vehicle that creeps has not been away, however many scans it makes") {
  const Scene scene = street();
  for (const double gap_m : {30.0, 0.0}) {
    MapperConfig config = small_config();
    config.detector.minimum_gap_m = gap_m;
    config.loop_verification.known_m = 0;
    MapperBench mapper(config);
    for (int i = 0; i < 50; ++i) {
      const Pose at = pose_at(0.05 * i, 0, 1, 0);
      see(*mapper.mapper, scene, at, at);
    }
    LoopReport loop;
    mapper->finish(loop);
    CHECK((mapper->counters().loops_offered > 0) == (gap_m == 0));
  }
}
