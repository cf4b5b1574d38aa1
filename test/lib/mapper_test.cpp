#include "alces/mapper.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <vector>

#include "support/in_block.h"
#include "support/mapper_bench.h"
#include "support/memory_archive.h"
#include "support/plain_scene.h"

using namespace alces;
using namespace alces::test;

namespace {

constexpr double deg = 3.14159265358979323846 / 180;

alignas(Arena::alignment) std::byte static_block[Mapper::memory_required(small_config())];

}  // namespace

TEST_CASE("a mapper lives in a static block whose size the compiler knows, and not in one byte less") {
  static_assert(Mapper::memory_required(small_config()) > (std::size_t{4} << 20));
  static_assert(Mapper::memory_required(small_config()) % Arena::alignment == 0);
  Status status = Status::bad_config;
  Mapper* const mapper = Mapper::create(static_block, small_config(), status);
  REQUIRE(mapper != nullptr);
  CHECK(status == Status::ok);
  CHECK(static_cast<void*>(mapper) == static_cast<void*>(static_block));
  CHECK(mapper->scan_count() == 0);
  CHECK(mapper->loops().empty());

  CHECK(Mapper::create(std::span(static_block).first(sizeof static_block - 1), small_config(), status) ==
        nullptr);
  CHECK(status == Status::block_too_small);
  CHECK(Mapper::create({}, small_config(), status) == nullptr);
  CHECK(status == Status::block_too_small);
  const Block larger(sizeof static_block + 64);
  CHECK(Mapper::create(larger.bytes().subspan(8, sizeof static_block), small_config(), status) == nullptr);
  CHECK(status == Status::block_misaligned);
}

TEST_CASE("a mapper uses what it said it would, to the byte, whatever its configuration") {
  MapperConfig with_gps = small_config();
  with_gps.detector.use_gps = true;
  MapperConfig tiny = small_config();
  tiny.scan_capacity = 1;
  tiny.loop_capacity = 0;
  tiny.pool_bytes = 0;
  tiny.cache_slots = 9;
  tiny.voxel.cell_capacity = 33;
  tiny.surface.sample_capacity = 7;
  tiny.correspondence_capacity = 1;
  MapperConfig paper = MapperConfig::paper();
  paper.pool_bytes = 1234567;
  for (const MapperConfig& config : {small_config(), with_gps, tiny, MapperConfig::standard(), paper}) {
    const MapperBench mapper(config);
    CHECK(mapper->used_bytes() == Mapper::memory_required(config));
  }
  CHECK(Mapper::memory_required(with_gps) > Mapper::memory_required(small_config()));

  const Block larger(Mapper::memory_required(tiny) + 4096);
  Status status = Status::bad_config;
  const Mapper* const mapper = Mapper::create(larger.bytes(), tiny, status);
  REQUIRE(mapper != nullptr);
  CHECK(mapper->used_bytes() == Mapper::memory_required(tiny));
}

TEST_CASE("a mapper writes nothing outside the bytes it asked for") {
  MapperConfig config = small_config();
  const std::size_t bytes = Mapper::memory_required(config);
  const Block block(bytes + 256);
  std::ranges::fill(block.bytes(), std::byte{0xA5});
  Status status = Status::bad_config;
  Mapper* const mapper = Mapper::create(block.bytes(), config, status);
  REQUIRE(mapper != nullptr);
  drive_through(*mapper, round_the_block(), 5);
  CHECK(std::ranges::count(block.bytes().subspan(bytes), std::byte{0xA5}) == 256);
}

TEST_CASE("scans without a usable point are refused with their counts, and the map goes on") {
  const BlockDrive& drive = round_the_block();
  MapperBench mapper(small_config());
  ScanReport report;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  CHECK(mapper->add_scan({}, nullptr, report) == Status::empty_scan);
  REQUIRE(mapper->add_scan(drive.scans[0], &drive.odometry[0], report) == Status::ok);
  REQUIRE(mapper->add_scan(drive.scans[1], &drive.odometry[1], report) == Status::ok);
  CHECK(mapper->add_scan({}, &drive.odometry[2], report) == Status::empty_scan);
  CHECK(report.scan == 2);
  const std::vector<Point> no_numbers = {{nan, 1, 1}, {1, inf, 1}, {1, 1, -inf}};
  CHECK(mapper->add_scan(no_numbers, &drive.odometry[2], report) == Status::empty_scan);
  CHECK(report.points.not_finite == 3);
  const std::vector<Point> far = {{1e30F, 0, 0}, {0, -1e30F, 1e30F}};
  CHECK(mapper->add_scan(far, &drive.odometry[2], report) == Status::empty_scan);
  CHECK(report.points.too_far == 2);
  const std::vector<Point> near(7, Point{0.01F, 0, 0});
  CHECK(mapper->add_scan(near, &drive.odometry[2], report) == Status::empty_scan);
  CHECK(report.points.too_near == 7);
  CHECK(mapper->scan_count() == 2);
  CHECK(mapper->counters().scans_refused == 5);

  // Rubbish among good points is left out; the map is that of the good points.
  std::vector<Point> mixed = drive.scans[2];
  mixed.insert(mixed.begin() + 100, {{nan, nan, nan}, {1e30F, 1, 1}, {inf, 0, 0}});
  REQUIRE(mapper->add_scan(mixed, &drive.odometry[2], report) == Status::ok);
  CHECK(report.points.not_finite == 2);
  CHECK(report.points.too_far == 1);
  MapperBench clean(small_config());
  drive_through(*clean.mapper, drive, 3);
  CHECK(is_same(*mapper.mapper, *clean.mapper));
}

TEST_CASE("a scan of one point is taken where the odometry says, and the drive goes on") {
  const BlockDrive& drive = round_the_block();
  MapperBench mapper(small_config());
  drive_through(*mapper.mapper, drive, 3);
  ScanReport report;
  const std::vector<Point> one = {{3, 2, 1}};
  REQUIRE(mapper->add_scan(one, &drive.odometry[3], report) == Status::ok);
  CHECK(report.is_predicted);
  CHECK(report.match == IcpVerdict::too_few_correspondences);
  CHECK(mapper->counters().scans_predicted == 1);
  const Pose step = mapper->graph().poses()[2].inverse() * mapper->graph().poses()[3];
  const Pose odometry_step = drive.odometry[2].inverse() * drive.odometry[3];
  CHECK(distance_m(step, odometry_step) <
        0.05);  // but for what the matches say of the odometry, which is right
  const Pose true_step = drive.truth[2].inverse() * drive.truth[3];
  CHECK(distance_m(step, true_step) < distance_m(odometry_step, true_step));
  REQUIRE(mapper->add_scan(drive.scans[4], &drive.odometry[4], report) == Status::ok);
  CHECK_FALSE(report.is_predicted);
  CHECK(distance_m(mapper->graph().poses()[4], drive.truth[4]) < 0.05);

  MapperBench from_one_point(small_config());
  REQUIRE(from_one_point->add_scan(one, nullptr, report) == Status::ok);
  REQUIRE(from_one_point->add_scan(one, nullptr, report) == Status::ok);
  CHECK(from_one_point->scan_count() == 2);
}

TEST_CASE("odometry that is no pose, or one of no place on Earth, is refused and leaves no trace") {
  const BlockDrive& drive = round_the_block();
  std::vector<Pose> bad;
  const double inf = std::numeric_limits<double>::infinity();
  for (const double far_m :
       {1.7e308, -1.7e308, 1e200, 1e30, 1.01 * farthest_place_m, inf, -inf, std::nan("")}) {
    for (int axis = 0; axis < 3; ++axis) {
      bad.emplace_back();
      bad.back().translation_m[axis] = far_m;
    }
  }
  bad.emplace_back();
  bad.back().rotation.coeffs().setZero();
  bad.emplace_back();
  bad.back().rotation.coeffs().y() = std::nan("");

  MapperBench mapper(small_config());
  MapperBench clean(small_config());
  drive_through(*clean.mapper, drive, 6);
  ScanReport report;
  for (std::size_t i = 0; i < 6; ++i) {
    std::size_t refused = 0;
    for (const Pose& pose : bad) {
      if (mapper->add_scan(drive.scans[30], &pose, report) == Status::bad_pose) ++refused;
    }
    CHECK(refused == bad.size());
    REQUIRE(mapper->scan_count() == i);
    REQUIRE(mapper->add_scan(drive.scans[i], &drive.odometry[i], report) == Status::ok);
    REQUIRE(report.scan == i);
  }
  CHECK(mapper->counters().scans_refused == 6 * bad.size());
  CHECK(mapper->counters().points_in == clean->counters().points_in);
  CHECK(is_same(*mapper.mapper, *clean.mapper));
  CHECK(mapper->graph().edge_count() == clean->graph().edge_count());
  std::vector<Point> points(4096);
  std::vector<Point> clean_points(4096);
  for (std::uint32_t scan = 0; scan <= 6; ++scan) {
    std::uint32_t count = 0;
    std::uint32_t clean_count = 0;
    CHECK(mapper->read_scan(scan, points, count) == clean->read_scan(scan, clean_points, clean_count));
    REQUIRE(count == clean_count);
    CHECK(std::memcmp(points.data(), clean_points.data(), count * sizeof(Point)) == 0);
  }
}

TEST_CASE("a prediction of no place on Earth is refused, whichever way it comes about, and leaves no trace") {
  const BlockDrive& drive = round_the_block();
  const auto moved = [](Pose pose, double x_m) {
    pose.translation_m.x() += x_m;
    return pose;
  };
  MapperBench mapper(small_config());
  ScanReport report;
  // Both ends of the step are places, but from one to the other it is too far.
  const double edge_m = -0.9 * farthest_place_m;
  std::array<Pose, 4> odometry;
  for (std::size_t i = 0; i < 4; ++i) odometry[i] = moved(drive.odometry[i], edge_m);
  REQUIRE(mapper->add_scan(drive.scans[0], &odometry[0], report) == Status::ok);
  const Pose other_edge = moved(drive.odometry[1], -edge_m);
  CHECK(mapper->add_scan(drive.scans[1], &other_edge, report) == Status::bad_pose);
  CHECK(mapper->scan_count() == 1);
  for (std::size_t i = 1; i < 4; ++i)
    REQUIRE(mapper->add_scan(drive.scans[i], &odometry[i], report) == Status::ok);
  CHECK(mapper->counters().scans_refused == 1);
  for (std::uint32_t i = 0; i < 4; ++i) CHECK(distance_m(mapper->graph().poses()[i], drive.truth[i]) < 0.05);

  // Without odometry the map goes on as it went, until it would leave the Earth.
  MapperBench rushing(small_config());
  const std::vector<Point> speck = {{3, 2, 1}};
  const Pose start;
  const Pose next = moved(start, 0.4 * farthest_place_m);
  REQUIRE(rushing->add_scan(speck, &start, report) == Status::ok);
  REQUIRE(rushing->add_scan(speck, &next, report) == Status::ok);
  REQUIRE(rushing->add_scan(speck, nullptr, report) == Status::ok);
  CHECK(rushing->add_scan(speck, nullptr, report) == Status::bad_pose);
  CHECK(rushing->scan_count() == 3);
  CHECK(rushing->graph().edge_count() == 2);
  for (const Pose& pose : rushing->graph().poses()) CHECK(is_valid(pose));

  // From one end of what is a place to the other there is no step.
  MapperBench leaping(small_config());
  for (const double x_m : {0.0, edge_m}) {
    const Pose place = moved(start, x_m);
    REQUIRE(leaping->add_scan(speck, &place, report) == Status::ok);
  }
  const Pose other_end = moved(start, -edge_m);
  CHECK(leaping->add_scan(speck, &other_end, report) == Status::bad_pose);
  CHECK(leaping->scan_count() == 2);
  CHECK(leaping->graph().edge_count() == 1);
}

TEST_CASE("at the capacity of scans the next one is refused, and the map stays usable") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = small_config();
  config.scan_capacity = 4;
  MapperBench mapper(config);
  drive_through(*mapper.mapper, drive, 4);
  const std::uint64_t points_of_the_map = mapper->store_counters().points;
  ScanReport report;
  const std::vector<Pose> before(mapper->graph().poses().begin(), mapper->graph().poses().end());
  constexpr std::uint32_t beyond = 100'000;
  std::uint32_t refused = 0;
  for (std::uint32_t i = 0; i < beyond; ++i) {
    if (mapper->add_scan(drive.scans[4], &drive.odometry[4], report) == Status::no_scan_capacity) ++refused;
  }
  CHECK(refused == beyond);
  CHECK(mapper->scan_count() == 4);
  CHECK(mapper->graph().edge_count() == 3);
  CHECK(mapper->counters().scans_refused == beyond);
  CHECK(mapper->counters().points_in == 4 * drive.scans[0].size());
  CHECK(mapper->store_counters().points == points_of_the_map);
  CHECK(std::ranges::equal(mapper->graph().poses(), before, is_same_pose));
  std::vector<Point> points(config.voxel.cell_capacity);
  std::uint32_t count = 0;
  CHECK(mapper->read_scan(3, points, count) == Status::ok);
  CHECK(count > 2000);
  CHECK(mapper->read_scan(4, points, count) == Status::no_such_scan);
  CHECK(mapper->read_scan(3, std::span(points).first(5), count) == Status::buffer_too_small);
  LoopReport loop;
  CHECK_FALSE(mapper->finish(loop));
}

TEST_CASE("a full pool refuses scans without an archive, with one they go there") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = small_config();
  config.pool_bytes = 60000;  // two scans
  MapperBench mapper(config);
  ScanReport report;
  drive_through(*mapper.mapper, drive, 2);
  CHECK(mapper->add_scan(drive.scans[2], &drive.odometry[2], report) == Status::no_point_capacity);
  CHECK(mapper->add_scan(drive.scans[3], &drive.odometry[3], report) == Status::no_point_capacity);
  CHECK(mapper->scan_count() == 2);
  CHECK(mapper->graph().edge_count() == 1);

  MemoryArchive archive;
  MapperBench with_archive(config, &archive);
  drive_through(*with_archive.mapper, drive, 6);
  CHECK(with_archive->store_counters().archived_scans == 4);
  archive.write_fails = true;
  CHECK(with_archive->add_scan(drive.scans[6], &drive.odometry[6], report) == Status::archive_write_failed);
  CHECK(with_archive->scan_count() == 6);
  archive.write_fails = false;
  CHECK(with_archive->add_scan(drive.scans[6], &drive.odometry[6], report) == Status::ok);
  MapperBench in_pool(small_config());
  drive_through(*in_pool.mapper, drive, 7);
  CHECK(is_same(*with_archive.mapper, *in_pool.mapper));
}

TEST_CASE("a scan of more cells than the grid has is added all the same, downsampled coarser") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = small_config();
  config.voxel.cell_capacity = 1800;
  MapperBench mapper(config);
  ScanReport report;
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(mapper->add_scan(drive.scans[i], &drive.odometry[i], report) == Status::no_voxel_capacity);
    CHECK(report.points.kept <= 1800);
    CHECK(report.points.kept > 450);
    CHECK(report.points.cell_size_m > config.voxel.cell_size_m);
    CHECK(report.points.without_cell == 0);
  }
  CHECK(mapper->scan_count() == 3);
  CHECK(mapper->counters().scans_refused == 0);
  CHECK(distance_m(mapper->graph().poses()[2], drive.truth[2]) < 0.15);
}

TEST_CASE("around a block of houses the loop closes, and the map is nearer to the truth than without") {
  const BlockDrive& drive = round_the_block();
  MapperBench mapper(small_config());
  MapperConfig open = small_config();
  open.close_loops = false;
  MapperBench without(open);
  drive_through(*mapper.mapper, drive, drive.scans.size());
  drive_through(*without.mapper, drive, drive.scans.size());
  LoopReport loop;
  mapper->finish(loop);
  CHECK_FALSE(without->finish(loop));
  REQUIRE(mapper->counters().loops_closed >= 1);
  CHECK(without->counters().loops_offered == 0);
  const double error_m = mean_error_m(*mapper.mapper, drive);
  const double open_m = mean_error_m(*without.mapper, drive);
  CAPTURE(error_m, open_m);
  CHECK(error_m < open_m);
  CHECK(error_m < 0.15);
  const Pose& first = mapper->graph().poses()[0];
  CHECK(first.translation_m.isZero(0));

  SECTION("and the counters add up") {
    const Mapper::Counters& counters = mapper->counters();
    CHECK(counters.loops_offered == mapper->loops().size() + counters.loops_not_listed);
    CHECK(counters.loops_closed == static_cast<std::uint32_t>(std::ranges::count(
                                       mapper->loops(), LoopVerdict::closed, &LoopReport::verdict)));
    CHECK(mapper->graph().edge_count() == mapper->scan_count() - 1 + counters.loops_closed);
    CHECK(static_cast<std::uint32_t>(std::ranges::count(mapper->graph().edges(), true, &Edge::closes_loop)) ==
          counters.loops_closed);
    std::uint64_t points = 0;
    for (const auto& scan : drive.scans) points += scan.size();
    CHECK(counters.points_in == points);
    CHECK(counters.scans_refused == 0);
    for (const LoopReport& each : mapper->loops()) {
      CHECK(each.first + small_config().detector.minimum_gap_scans <= each.last);
      CHECK(each.distance_m <= small_config().detector.radius_cap_m);
    }
  }
  SECTION("and the same drive gives the same bits") {
    MapperBench again(small_config());
    drive_through(*again.mapper, drive, drive.scans.size());
    again->finish(loop);
    CHECK(is_same(*mapper.mapper, *again.mapper));
  }
  SECTION("and an archive with next to no pool and few slots gives the same bits") {
    MapperConfig config = small_config();
    config.pool_bytes = 4096;
    config.cache_slots = 8;
    MemoryArchive archive;
    MapperBench archived(config, &archive);
    drive_through(*archived.mapper, drive, drive.scans.size());
    archived->finish(loop);
    CHECK(archived->store_counters().archived_scans == drive.scans.size());
    CHECK(is_same(*mapper.mapper, *archived.mapper));
    CHECK(Mapper::memory_required(config) < Mapper::memory_required(small_config()) - (std::size_t{3} << 20));
  }
}

TEST_CASE("the paper's front end maps the block, too") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = MapperConfig::paper();
  const MapperConfig sizes = small_config();
  config.scan_capacity = sizes.scan_capacity;
  config.loop_capacity = sizes.loop_capacity;
  config.pool_bytes = sizes.pool_bytes;
  config.voxel = sizes.voxel;
  config.surface = sizes.surface;
  config.detector = sizes.detector;
  MapperBench mapper(config);
  drive_through(*mapper.mapper, drive, drive.scans.size());
  LoopReport loop;
  mapper->finish(loop);
  CHECK(mapper->counters().scans_predicted == 0);
  CHECK(mapper->counters().loops_offered >= 1);
  CHECK(mean_error_m(*mapper.mapper, drive) < 1.5);
}

TEST_CASE("without odometry the next step is taken to be like the last") {
  const BlockDrive& drive = round_the_block();
  MapperBench mapper(small_config());
  // 2 m a scan: the first step, for which nothing is known, is given
  ScanReport report;
  REQUIRE(mapper->add_scan(drive.scans[0], &drive.odometry[0], report) == Status::ok);
  REQUIRE(mapper->add_scan(drive.scans[1], &drive.odometry[1], report) == Status::ok);
  for (std::size_t i = 2; i < 10; ++i)
    REQUIRE(mapper->add_scan(drive.scans[i], nullptr, report) == Status::ok);
  for (std::uint32_t i = 0; i < 10; ++i) CHECK(distance_m(mapper->graph().poses()[i], drive.truth[i]) < 0.15);
}

TEST_CASE("a scanner mounted askew in the odometry's body is predicted for as soon as steps have shown it") {
  const BlockDrive& drive = round_the_block();
  const Pose odometry_body_from_scanner = pose_at(0, 0, 0, 20);
  for (const bool learns : {true, false}) {
    MapperConfig config = small_config();
    config.motion.learn_heading = learns;
    config.detector.minimum_gap_scans = 60;  // no loops
    for (const std::size_t known : {1U, 4U, 9U}) {
      MapperBench mapper(config);
      ScanReport report;
      for (std::size_t i = 0; i <= known; ++i) {
        const Pose askew = drive.odometry[i] * odometry_body_from_scanner.inverse();
        const std::vector<Point> speck = {{3, 2, 1}};  // the last is predicted
        REQUIRE(mapper->add_scan(i < known ? drive.scans[i] : speck, &askew, report) == Status::ok);
      }
      REQUIRE(report.is_predicted);
      const double off_m = distance_m(mapper->graph().poses()[known], drive.truth[known]);
      CAPTURE(learns, known, off_m);
      CHECK((off_m < 0.1) == (learns && known > 1));
      CHECK(off_m < 0.8);  // 2 m, 20 degrees
    }
  }
}

TEST_CASE("an edge is the less sure when its match used up its iterations") {
  const BlockDrive& drive = round_the_block();
  const auto edge_with = [&](std::uint32_t iterations, double factor, IcpVerdict expected) {
    MapperConfig config = small_config();
    config.scan_match.maximum_iterations = iterations;
    config.edge_uncertainty.unconverged_factor = factor;
    MapperBench mapper(config);
    ScanReport report;
    REQUIRE(mapper->add_scan(drive.scans[0], &drive.odometry[0], report) == Status::ok);
    REQUIRE(mapper->add_scan(drive.scans[1], &drive.odometry[1], report) == Status::ok);
    REQUIRE(report.match == expected);
    return mapper->graph().edges()[0].variance;
  };
  const EdgeUncertainty standard;
  CHECK(standard.unconverged_factor == 5);
  const double floor_m2 = standard.minimum_translation_m * standard.minimum_translation_m;
  const double floor_rad2 = 3 * standard.minimum_rotation_rad * standard.minimum_rotation_rad;
  const EdgeVariance plain = edge_with(2, 1, IcpVerdict::iteration_limit);
  const EdgeVariance wary = edge_with(2, 5, IcpVerdict::iteration_limit);
  CHECK(wary.x_m2 - floor_m2 == Approx(5 * (plain.x_m2 - floor_m2)));
  CHECK(wary.y_m2 - floor_m2 == Approx(5 * (plain.y_m2 - floor_m2)));
  CHECK(wary.z_m2 - floor_m2 == Approx(5 * (plain.z_m2 - floor_m2)));
  CHECK(wary.rotation_rad2 - floor_rad2 == Approx(5 * (plain.rotation_rad2 - floor_rad2)));
  CHECK(edge_with(40, 5, IcpVerdict::converged).x_m2 == edge_with(40, 1, IcpVerdict::converged).x_m2);
}

TEST_CASE("odometry that comes and goes does not tear the map") {
  const BlockDrive& drive = round_the_block();
  MapperBench mapper(small_config());
  ScanReport report;
  for (std::size_t i = 0; i < 10; ++i) {
    const bool is_known = i < 3 || i == 5 || i > 7;
    REQUIRE(mapper->add_scan(drive.scans[i], is_known ? &drive.odometry[i] : nullptr, report) == Status::ok);
    CHECK(distance_m(mapper->graph().poses()[i], drive.truth[i]) < 0.15);
  }
}

TEST_CASE("two mappers side by side do not know of each other") {
  const BlockDrive& drive = round_the_block();
  MapperBench alone(small_config());
  drive_through(*alone.mapper, drive, 12);
  MapperBench one(small_config());
  MapperBench other(small_config());
  ScanReport report;
  for (std::size_t i = 0; i < 12; ++i) {
    REQUIRE(one->add_scan(drive.scans[i], &drive.odometry[i], report) == Status::ok);
    REQUIRE(other->add_scan(drive.scans[30 - i], nullptr, report) == Status::ok);
  }
  CHECK(is_same(*alone.mapper, *one.mapper));
  CHECK_FALSE(is_same(*one.mapper, *other.mapper));
}

TEST_CASE("an archive that cannot read any more costs matches and loops, not the map") {
  const BlockDrive& drive = round_the_block();
  MapperConfig config = small_config();
  config.pool_bytes = 0;
  config.cache_slots = 8;
  MemoryArchive archive;
  MapperBench mapper(config, &archive);
  drive_through(*mapper.mapper, drive, 48);
  archive.read_fails = true;
  LoopReport loop;
  REQUIRE(mapper->offer_loop(5, 40, loop) == Status::ok);
  CHECK(loop.verdict == LoopVerdict::refused_archive);
  std::vector<Point> points(config.voxel.cell_capacity);
  std::uint32_t count = 0;
  CHECK(mapper->read_scan(0, points, count) == Status::archive_read_failed);
  ScanReport report;
  REQUIRE(mapper->add_scan(drive.scans[48], &drive.odometry[48], report) == Status::ok);
  CHECK(mapper->scan_count() == 49);
  for (const Pose& pose : mapper->graph().poses()) CHECK(is_valid(pose));
  archive.read_fails = false;
  CHECK(mapper->read_scan(0, points, count) == Status::ok);
}

TEST_CASE("what comes back from a scan is what went in, reduced") {
  const BlockDrive& drive = round_the_block();
  MapperBench mapper(small_config());
  drive_through(*mapper.mapper, drive, 2);
  std::vector<Point> points(4096);
  std::uint32_t count = 0;
  REQUIRE(mapper->read_scan(1, points, count) == Status::ok);
  std::size_t strange = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const bool is_measured = std::ranges::any_of(
        drive.scans[1], [&](const Point& p) { return (as_vector(p) - as_vector(points[i])).norm() < 0.001; });
    if (!is_measured) ++strange;
  }
  CHECK(strange == 0);
  CHECK(mapper->graph().edges()[0].variance.x_m2 > 0);
  CHECK(distance_rad(mapper->graph().poses()[1], drive.truth[1]) < 0.5 * deg);
}

TEST_CASE("a mapper stores with each scan the signature of its points") {
  const BlockDrive& drive = round_the_block();
  MapperBench mapper(small_config());
  drive_through(*mapper.mapper, drive, 4);
  std::vector<Point> points(small_config().voxel.cell_capacity);
  for (std::uint32_t scan = 0; scan < 4; ++scan) {
    std::uint32_t count = 0;
    REQUIRE(mapper->read_scan(scan, points, count) == Status::ok);
    const ScanSignature of_points = ScanSignature::of(std::span(points).first(count));
    std::span<const std::byte> record;
    REQUIRE(mapper->read_record(scan, record) == Status::ok);
    StoredScanView view;
    REQUIRE(StoredScanView::parse(record, view) == StoredScanFault::none);
    ScanSignature stored;
    REQUIRE(stored.read(view.signature(), view.signature_version()));
    CHECK(stored.likeness(of_points) > 0.98F);  // points are stored rounded, to a millimetre or two
  }
}

TEST_CASE("a step says how many samples have a surface, and how well it holds each direction") {
  const BlockDrive& drive = round_the_block();
  MapperBench mapper(small_config());
  ScanReport report;
  REQUIRE(mapper->add_scan(drive.scans[0], &drive.odometry[0], report) == Status::ok);
  CHECK(report.held.weakest() == 0);  // matched to nothing
  REQUIRE(mapper->add_scan(drive.scans[1], &drive.odometry[1], report) == Status::ok);
  CHECK(report.samples > 100);
  CHECK(report.surfaces > report.samples / 2);
  CHECK(report.surfaces <= report.samples);
  CHECK(report.held.weakest() > 0.001F);
  CHECK(report.held.x + report.held.y + report.held.z <= 1.01F);
  // A plane and nothing else: place and heading are not held.
  std::vector<Point> ground;
  for (int x = -30; x < 30; ++x)
    for (int y = -30; y < 30; ++y)
      ground.push_back({0.5F * static_cast<float>(x), 0.5F * static_cast<float>(y), -1.5F});
  MapperBench field(small_config());
  REQUIRE(field->add_scan(ground, &drive.odometry[0], report) == Status::ok);
  REQUIRE(field->add_scan(ground, &drive.odometry[0], report) == Status::ok);
  CAPTURE(report.held.x, report.held.y, report.held.z, report.held.roll, report.held.pitch, report.held.yaw);
  CHECK(report.held.z > 0.3F);
  CHECK(std::max({report.held.x, report.held.y, report.held.yaw}) < 0.01F);
}
