// The mapper on drives through the synthetic town, against truth.
#include <catch2/catch.hpp>
#include <vector>

#include "alces/mapper.h"
#include "alces_platform/sim/drive.h"
#include "support/mapper_bench.h"
#include "support/plain_scene.h"

using namespace alces;
using namespace alces::test;

namespace {

MapperConfig config_for(std::size_t scans) {
  MapperConfig config = MapperConfig::standard();
  config.scan_capacity = static_cast<std::uint32_t>(scans);
  config.loop_capacity = 64;
  config.pool_bytes = scans * (std::size_t{88} << 10);
  config.voxel.cell_capacity = 12288;
  return config;
}

sim::DriveSettings settings_for(std::size_t scans, std::uint64_t seed, std::size_t points_per_scan) {
  sim::DriveSettings settings;
  settings.scans = scans;
  settings.seed = seed;
  settings.scanner.points_per_scan = points_per_scan;
  return settings;
}

void drive_through(const sim::Drive& drive, std::size_t begin, std::size_t end, std::size_t every,
                   std::initializer_list<Mapper*> mappers) {
  std::vector<Point> points;
  for (std::size_t i = begin; i < end; i += every) {
    drive.points(i, points);
    for (Mapper* const mapper : mappers) {
      ScanReport report;
      const Status status = mapper->add_scan(points, &drive.odometry(i), report);
      REQUIRE((status == Status::ok || status == Status::no_voxel_capacity));
    }
  }
}

double mean_error_m(const Mapper& mapper, const sim::Drive& drive) {
  double sum = 0;
  for (std::uint32_t i = 0; i < mapper.scan_count(); ++i) {
    sum += distance_m(mapper.graph().poses()[i], drive.truth(i));
  }
  return sum / mapper.scan_count();
}

}  // namespace

TEST_CASE(
    "through the town the steps drift little, and closing loops brings the maps nearer to the truth still") {
  double error_m = 0;
  double open_m = 0;
  for (const std::uint64_t seed : {1U, 6U}) {
    const sim::Drive drive = sim::drive(settings_for(450, seed, 15000));
    const MapperConfig config = config_for(drive.size());
    MapperConfig open = config;
    open.close_loops = false;
    const MapperBench closed(config);
    const MapperBench without(open);
    drive_through(drive, 0, drive.size(), 1, {closed.mapper, without.mapper});
    LoopReport loop;
    closed->finish(loop);
    error_m += mean_error_m(*closed.mapper, drive) / 2;
    open_m += mean_error_m(*without.mapper, drive) / 2;
    CAPTURE(seed, error_m, open_m, closed->loops().size());
    CHECK(closed->counters().loops_closed >= 10);
    for (const LoopReport& each : closed->loops()) {
      if (each.verdict != LoopVerdict::closed) continue;
      // a false loop would join places that are far apart
      CHECK(distance_m(drive.truth(each.first), drive.truth(each.last)) < 20);
      const Pose truth = drive.truth(each.first).inverse() * drive.truth(each.last);
      const Pose mapped = closed->graph().poses()[each.first].inverse() * closed->graph().poses()[each.last];
      CHECK(distance_m(truth, mapped) < 0.4);
    }
  }
  CAPTURE(error_m, open_m);
  CHECK(open_m < 0.3);  // 450 scans, 600 m and more
  CHECK(error_m < 0.9 * open_m);
}

TEST_CASE("two places that look alike are told apart by the way between them") {
  const sim::LookAlike alike = sim::look_alike_drive(4, settings_for(0, 4, 12000));
  const sim::Drive& drive = alike.drive;
  constexpr std::size_t every = 2;  // scans, for time's sake
  constexpr std::uint32_t first = 4;
  const std::size_t begin = alike.first - first * every;
  const auto second = static_cast<std::uint32_t>((alike.second - begin) / every);
  MapperConfig config = config_for(second + 4);
  config.close_loops = false;

  SECTION("a mapper that drove it refuses a loop between them, and the map stays") {
    const MapperBench mapper(config);
    drive_through(drive, begin, begin + every * (second + 4), every, {mapper.mapper});
    const std::vector<Pose> before(mapper->graph().poses().begin(), mapper->graph().poses().end());
    for (const std::uint32_t shift : {0U, 2U}) {
      LoopReport loop;
      REQUIRE(mapper->offer_loop(first + shift, second + shift, loop) == Status::ok);
      CAPTURE(to_string(loop.verdict), loop.overlap, loop.rms_m, loop.mahalanobis2, loop.correction_m);
      CHECK(loop.verdict == LoopVerdict::refused_no_match);  // nothing of one is in reach of the other
      CHECK(loop.overlap == 0);
      CHECK(loop.distance_m > 300);
    }
    CHECK(mapper->counters().loops_closed == 0);
    CHECK(mapper->loops().size() == 2);
    std::size_t moved = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (mapper->graph().poses()[i].translation_m != before[i].translation_m) ++moved;
    }
    CHECK(moved == 0);
  }
  SECTION("one that was carried there and believes itself back takes them for the same") {
    config.search_steps =
        false;  // which would look for the way there, and find some street that fits a little
    const MapperBench mapper(config);
    drive_through(drive, begin, begin + every * (2 * first + 1), every, {mapper.mapper});
    const std::uint32_t again = mapper->scan_count();
    std::vector<Point> points;
    for (std::size_t i = 0; i <= first; ++i) {
      const std::size_t scan = alike.second - (first - i) * every;
      const Pose second_from_scan = drive.truth(alike.second).inverse() * drive.truth(scan);
      const Pose believed =
          drive.odometry(alike.first) * alike.first_from_second * pose_at(0.6, 0.4, 0, 2) * second_from_scan;
      drive.points(scan, points);
      ScanReport report;
      REQUIRE(mapper->add_scan(points, &believed, report) == Status::ok);
    }
    LoopReport loop;
    REQUIRE(mapper->offer_loop(first, again + first, loop) == Status::ok);
    CAPTURE(to_string(loop.verdict), loop.overlap, loop.rms_m, loop.mahalanobis2, loop.correction_m);
    CHECK(loop.verdict == LoopVerdict::closed);
    CHECK(loop.overlap >= config.loop_verification.minimum_overlap);
    CHECK(loop.rms_m <= config.loop_verification.maximum_rms_m);
    const auto poses = mapper->graph().poses();
    CHECK(distance_m(poses[first].inverse() * poses[again + first], alike.first_from_second) < 0.1);
  }
}
