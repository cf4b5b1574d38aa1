#include "alces/mapper.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <vector>

#include "support/in_block.h"
#include "support/memory_archive.h"
#include "support/plain_scene.h"

using namespace alces;
using namespace alces::test;

namespace {

constexpr double deg = 3.14159265358979323846 / 180;

constexpr MapperConfig small_config() {
  MapperConfig config = MapperConfig::standard();
  config.scan_capacity = 64;
  config.loop_capacity = 16;
  config.pool_bytes = std::size_t{4} << 20;
  config.voxel.cell_capacity = 4096;
  config.voxel.maximum_range_m = 30;
  config.surface.sample_capacity = 1024;
  config.detector.minimum_gap_scans = 20;
  config.detector.radius_m = 6;
  config.detector.radius_cap_m = 6;
  return config;
}

alignas(Arena::alignment) std::byte static_block[Mapper::memory_required(small_config())];

/// A square of streets around a block of houses, driven once around and a little farther; side 24 m.
struct Drive {
  std::vector<Pose> truth;
  std::vector<Pose> odometry;
  std::vector<std::vector<Point>> scans;
};

Scene block_of_houses() {
  Scene scene;
  scene.rectangle({-30, -30, 0}, {60, 0, 0}, {0, 60, 0});
  sim::Random random(5);
  for (int side = 0; side < 4; ++side) {
    for (double along = -22; along < 18;) {
      const double width = random.uniform(3, 6);
      for (const double distance : {8.0 - random.uniform(0, 1.5), -16.5 - random.uniform(0, 1.5)}) {
        const double near = std::abs(distance);
        const double far = distance > 0 ? near - 2 : near + 2;
        Eigen::Vector3d a(along, std::min(near, far), 0);
        Eigen::Vector3d b(along + width, std::max(near, far), random.uniform(3, 6));
        if (distance > 0 && (along < -6 || along + width > 6)) continue;
        for (int turn = 0; turn < side; ++turn) {
          const Eigen::Vector3d low = a;
          const Eigen::Vector3d high = b;
          a = {-high.y(), low.x(), low.z()};
          b = {-low.y(), high.x(), high.z()};
        }
        scene.box(a, b);
      }
      along += width + random.uniform(0.3, 1.5);
    }
  }
  return scene;
}

const Drive& round_the_block() {
  static const Drive made = [] {
    Drive drive;
    const Scene scene = block_of_houses();
    std::vector<Pose> way;
    constexpr int steps_a_side = 12;
    for (int step = 0; step < 4 * steps_a_side + 5; ++step) {
      const int side = step / steps_a_side;
      const double along = -12 + 2.0 * (step % steps_a_side);
      const double turning = step % steps_a_side >= steps_a_side - 1 ? 45
                             : step % steps_a_side == 0 && step > 0  ? -45
                                                                     : 0;
      const Pose rotated = pose_at(0, 0, 0, 90.0 * side);
      way.push_back(rotated * pose_at(along, -12, 1, std::max(0.0, turning), 0.3 * std::sin(step),
                                      0.3 * std::cos(step)));
    }
    Pose odometry;
    for (std::size_t i = 0; i < way.size(); ++i) {
      drive.truth.push_back(way[0].inverse() * way[i]);
      if (i > 0) {
        Pose step = way[i - 1].inverse() * way[i];
        step.translation_m *= 1.02;
        step.rotation = exp_so3({0, 0, 0.01}) * step.rotation;
        odometry = odometry * step;
      }
      drive.odometry.push_back(odometry);
      drive.scans.push_back(scene.scan(way[i], 3000, 20, 0.01, i));
    }
    return drive;
  }();
  return made;
}

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

/// A mapper in a block of its own, of exactly the bytes it asks for.
class Bench {
 public:
  explicit Bench(const MapperConfig& config, ScanArchive* archive = nullptr,
                 LoopRelaxation* relaxation = nullptr)
      : block_(Mapper::memory_required(config)) {
    Status status = Status::bad_config;
    mapper = Mapper::create(block_.bytes(), config, status, archive, nullptr, relaxation);
    REQUIRE(status == Status::ok);
    REQUIRE(mapper != nullptr);
  }
  Mapper* operator->() const { return mapper; }
  Mapper* mapper = nullptr;

 private:
  Block block_;
};

void drive_through(Mapper& mapper, const Drive& drive, std::size_t count, bool with_odometry = true) {
  for (std::size_t i = 0; i < count; ++i) {
    ScanReport report;
    REQUIRE(mapper.add_scan(drive.scans[i], with_odometry ? &drive.odometry[i] : nullptr, report) ==
            Status::ok);
    REQUIRE(report.scan == i);
  }
}

bool is_same(const Mapper& a, const Mapper& b) {
  const auto p = a.graph().poses();
  const auto q = b.graph().poses();
  return p.size() == q.size() && std::ranges::equal(p, q, [](const Pose& x, const Pose& y) {
           return x.translation_m == y.translation_m && x.rotation.coeffs() == y.rotation.coeffs();
         });
}

double mean_error_m(const Mapper& mapper, const Drive& drive) {
  double sum = 0;
  for (std::uint32_t i = 0; i < mapper.scan_count(); ++i) {
    sum += distance_m(mapper.graph().poses()[i], drive.truth[i]);
  }
  return sum / mapper.scan_count();
}

Status create_status(const MapperConfig& config) {
  Status status = Status::ok;
  const Block block(1 << 20);
  CHECK(Mapper::create(block.bytes(), config, status) == nullptr);
  return status;
}

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

TEST_CASE("settings that make no sense are refused") {
  const auto with = [](auto change) {
    MapperConfig config = small_config();
    change(config);
    return create_status(config);
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK(with([](MapperConfig& c) { c.scan_capacity = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.cache_slots = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.cache_slots = c.model_scans; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.model_scans = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.model_scans = 17, c.cache_slots = 40; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.loop_search.shift_steps = 65; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.loop_search.shift_step_m = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.scans_around_first = 8, c.cache_slots = 40; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.scans_before_last = 40, c.cache_slots = 100; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.correspondence_capacity = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.voxel.cell_capacity = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.voxel.cell_size_m = 0; }) == Status::bad_config);
  CHECK(with([&](MapperConfig& c) { c.voxel.cell_size_m = nan; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.voxel.maximum_range_m = c.voxel.minimum_range_m; }) ==
        Status::bad_config);
  CHECK(with([&](MapperConfig& c) { c.voxel.maximum_range_m = nan; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.surface.sample_capacity = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.scan_match.maximum_iterations = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.scan_match.first_distance_limit_m = -1; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.loop_match.limit_factor = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.loop_match.limit_factor = 1.5F; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.detector.radius_m = -1; }) == Status::bad_config);
}

TEST_CASE("scans without a usable point are refused with their counts, and the map goes on") {
  const Drive& drive = round_the_block();
  Bench mapper(small_config());
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
  Bench clean(small_config());
  drive_through(*clean.mapper, drive, 3);
  CHECK(is_same(*mapper.mapper, *clean.mapper));
}

TEST_CASE("a scan of one point is taken where the odometry says, and the drive goes on") {
  const Drive& drive = round_the_block();
  Bench mapper(small_config());
  drive_through(*mapper.mapper, drive, 3);
  ScanReport report;
  const std::vector<Point> one = {{3, 2, 1}};
  REQUIRE(mapper->add_scan(one, &drive.odometry[3], report) == Status::ok);
  CHECK(report.is_predicted);
  CHECK(report.match == IcpVerdict::too_few_correspondences);
  CHECK(mapper->counters().scans_predicted == 1);
  const Pose step = mapper->graph().poses()[2].inverse() * mapper->graph().poses()[3];
  const Pose odometry_step = drive.odometry[2].inverse() * drive.odometry[3];
  CHECK(distance_m(step, odometry_step) < 0.02);  // but for what the matches say of the odometry
  REQUIRE(mapper->add_scan(drive.scans[4], &drive.odometry[4], report) == Status::ok);
  CHECK_FALSE(report.is_predicted);
  CHECK(distance_m(mapper->graph().poses()[4], drive.truth[4]) < 0.05);

  Bench from_one_point(small_config());
  REQUIRE(from_one_point->add_scan(one, nullptr, report) == Status::ok);
  REQUIRE(from_one_point->add_scan(one, nullptr, report) == Status::ok);
  CHECK(from_one_point->scan_count() == 2);
}

TEST_CASE("odometry that is no pose is refused") {
  const Drive& drive = round_the_block();
  Bench mapper(small_config());
  drive_through(*mapper.mapper, drive, 2);
  ScanReport report;
  Pose nowhere;
  nowhere.translation_m.y() = std::nan("");
  CHECK(mapper->add_scan(drive.scans[2], &nowhere, report) == Status::bad_pose);
  Pose no_rotation;
  no_rotation.rotation.coeffs().setZero();
  CHECK(mapper->add_scan(drive.scans[2], &no_rotation, report) == Status::bad_pose);
  Pose endless;
  endless.translation_m.z() = std::numeric_limits<double>::infinity();
  CHECK(mapper->add_scan(drive.scans[2], &endless, report) == Status::bad_pose);
  CHECK(mapper->scan_count() == 2);
  CHECK(mapper->counters().scans_refused == 3);
  REQUIRE(mapper->add_scan(drive.scans[2], &drive.odometry[2], report) == Status::ok);
  CHECK(distance_m(mapper->graph().poses()[2], drive.truth[2]) < 0.05);
}

TEST_CASE("at the capacity of scans the next one is refused, and the map stays usable") {
  const Drive& drive = round_the_block();
  MapperConfig config = small_config();
  config.scan_capacity = 4;
  Bench mapper(config);
  drive_through(*mapper.mapper, drive, 4);
  ScanReport report;
  for (int i = 0; i < 3; ++i) {
    CHECK(mapper->add_scan(drive.scans[4], &drive.odometry[4], report) == Status::no_scan_capacity);
  }
  CHECK(mapper->scan_count() == 4);
  CHECK(mapper->graph().edge_count() == 3);
  CHECK(mapper->counters().scans_refused == 3);
  std::vector<Point> points(config.voxel.cell_capacity);
  std::uint32_t count = 0;
  CHECK(mapper->read_scan(3, points, count) == Status::ok);
  CHECK(count > 2000);
  CHECK(mapper->read_scan(4, points, count) == Status::no_such_scan);
  CHECK(mapper->read_scan(3, std::span(points).first(5), count) == Status::buffer_too_small);
  LoopReport loop;
  CHECK_FALSE(mapper->finish(loop));
}

TEST_CASE("a full pool refuses scans without an archive; with one they go there") {
  const Drive& drive = round_the_block();
  MapperConfig config = small_config();
  config.pool_bytes = 60000;  // two scans
  Bench mapper(config);
  ScanReport report;
  drive_through(*mapper.mapper, drive, 2);
  CHECK(mapper->add_scan(drive.scans[2], &drive.odometry[2], report) == Status::no_point_capacity);
  CHECK(mapper->add_scan(drive.scans[3], &drive.odometry[3], report) == Status::no_point_capacity);
  CHECK(mapper->scan_count() == 2);
  CHECK(mapper->graph().edge_count() == 1);

  MemoryArchive archive;
  Bench with_archive(config, &archive);
  drive_through(*with_archive.mapper, drive, 6);
  CHECK(with_archive->store_counters().archived_scans == 4);
  archive.write_fails = true;
  CHECK(with_archive->add_scan(drive.scans[6], &drive.odometry[6], report) == Status::archive_write_failed);
  CHECK(with_archive->scan_count() == 6);
  archive.write_fails = false;
  CHECK(with_archive->add_scan(drive.scans[6], &drive.odometry[6], report) == Status::ok);
  Bench in_pool(small_config());
  drive_through(*in_pool.mapper, drive, 7);
  CHECK(is_same(*with_archive.mapper, *in_pool.mapper));
}

TEST_CASE("more cells than the grid has thin the scan out, and the scan is added all the same") {
  const Drive& drive = round_the_block();
  MapperConfig config = small_config();
  config.voxel.cell_capacity = 1800;
  Bench mapper(config);
  ScanReport report;
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(mapper->add_scan(drive.scans[i], &drive.odometry[i], report) == Status::no_voxel_capacity);
    CHECK(report.points.kept == 1800);
    CHECK(report.points.without_cell > 0);
  }
  CHECK(mapper->scan_count() == 3);
  CHECK(mapper->counters().scans_refused == 0);
  CHECK(distance_m(mapper->graph().poses()[2], drive.truth[2]) < 0.1);
}

TEST_CASE("around a block of houses the loop closes, and the map is nearer to the truth than without") {
  const Drive& drive = round_the_block();
  Bench mapper(small_config());
  MapperConfig open = small_config();
  open.close_loops = false;
  Bench without(open);
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
    Bench again(small_config());
    drive_through(*again.mapper, drive, drive.scans.size());
    again->finish(loop);
    CHECK(is_same(*mapper.mapper, *again.mapper));
  }
  SECTION("and an archive with next to no pool and few slots gives the same bits") {
    MapperConfig config = small_config();
    config.pool_bytes = 4096;
    config.cache_slots = 8;
    MemoryArchive archive;
    Bench archived(config, &archive);
    drive_through(*archived.mapper, drive, drive.scans.size());
    archived->finish(loop);
    CHECK(archived->store_counters().archived_scans == drive.scans.size());
    CHECK(is_same(*mapper.mapper, *archived.mapper));
    CHECK(Mapper::memory_required(config) < Mapper::memory_required(small_config()) - (std::size_t{3} << 20));
  }
}

TEST_CASE("the paper's front end maps the block, too") {
  const Drive& drive = round_the_block();
  MapperConfig config = MapperConfig::paper();
  const MapperConfig sizes = small_config();
  config.scan_capacity = sizes.scan_capacity;
  config.loop_capacity = sizes.loop_capacity;
  config.pool_bytes = sizes.pool_bytes;
  config.voxel = sizes.voxel;
  config.surface = sizes.surface;
  config.detector = sizes.detector;
  Bench mapper(config);
  drive_through(*mapper.mapper, drive, drive.scans.size());
  LoopReport loop;
  mapper->finish(loop);
  CHECK(mapper->counters().scans_predicted == 0);
  CHECK(mapper->counters().loops_offered >= 1);
  CHECK(mean_error_m(*mapper.mapper, drive) < 1.5);
}

TEST_CASE("without odometry the next step is taken to be like the last") {
  const Drive& drive = round_the_block();
  Bench mapper(small_config());
  // 2 m a scan: the first step, for which nothing is known, is given
  ScanReport report;
  REQUIRE(mapper->add_scan(drive.scans[0], &drive.odometry[0], report) == Status::ok);
  REQUIRE(mapper->add_scan(drive.scans[1], &drive.odometry[1], report) == Status::ok);
  for (std::size_t i = 2; i < 10; ++i)
    REQUIRE(mapper->add_scan(drive.scans[i], nullptr, report) == Status::ok);
  for (std::uint32_t i = 0; i < 10; ++i) CHECK(distance_m(mapper->graph().poses()[i], drive.truth[i]) < 0.15);
}

TEST_CASE("odometry that comes and goes does not tear the map") {
  const Drive& drive = round_the_block();
  Bench mapper(small_config());
  ScanReport report;
  for (std::size_t i = 0; i < 10; ++i) {
    const bool is_known = i < 3 || i == 5 || i > 7;
    REQUIRE(mapper->add_scan(drive.scans[i], is_known ? &drive.odometry[i] : nullptr, report) == Status::ok);
    CHECK(distance_m(mapper->graph().poses()[i], drive.truth[i]) < 0.15);
  }
}

TEST_CASE("two mappers side by side do not know of each other") {
  const Drive& drive = round_the_block();
  Bench alone(small_config());
  drive_through(*alone.mapper, drive, 12);
  Bench one(small_config());
  Bench other(small_config());
  ScanReport report;
  for (std::size_t i = 0; i < 12; ++i) {
    REQUIRE(one->add_scan(drive.scans[i], &drive.odometry[i], report) == Status::ok);
    REQUIRE(other->add_scan(drive.scans[30 - i], nullptr, report) == Status::ok);
  }
  CHECK(is_same(*alone.mapper, *one.mapper));
  CHECK_FALSE(is_same(*one.mapper, *other.mapper));
}

TEST_CASE("a loop offered from outside is judged like any other") {
  const Drive& drive = round_the_block();
  MapperConfig config = small_config();
  config.close_loops = false;
  Bench mapper(config);
  drive_through(*mapper.mapper, drive, 50);
  LoopReport loop;
  CHECK(mapper->offer_loop(3, 3, loop) == Status::no_such_scan);
  CHECK(mapper->offer_loop(4, 3, loop) == Status::no_such_scan);
  CHECK(mapper->offer_loop(0, 50, loop) == Status::no_such_scan);
  CHECK(mapper->loops().empty());

  const std::vector<Pose> before(mapper->graph().poses().begin(), mapper->graph().poses().end());
  REQUIRE(mapper->offer_loop(0, 24, loop) == Status::ok);  // the opposite corner
  CHECK(loop.verdict != LoopVerdict::closed);
  CHECK(text(loop.verdict) != nullptr);
  CHECK(mapper->loops().size() == 1);
  CHECK(mapper->counters().loops_offered == 1);
  CHECK(mapper->counters().loops_closed == 0);
  CHECK(mapper->graph().edge_count() == 49);
  for (std::size_t i = 0; i < 50; ++i) {
    REQUIRE(mapper->graph().poses()[i].translation_m == before[i].translation_m);
  }

  REQUIRE(mapper->offer_loop(0, 48, loop) == Status::ok);  // the start again
  CAPTURE(text(loop.verdict), loop.overlap, loop.rms_m, loop.mahalanobis2);
  CHECK(loop.verdict == LoopVerdict::closed);
  CHECK(mapper->graph().edge_count() == 50);
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
        config.belief.maximum_mahalanobis2 = 1e12;
        config.loop_search.shift_steps = steps;
        Bench mapper(config);
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
        REQUIRE(loop.verdict == LoopVerdict::closed);
        const auto poses = mapper->graph().poses();
        const double off_m = (poses[2].inverse() * poses[7]).translation_m.norm();
        CAPTURE(drift_m, steps, trial, off_m, loop.overlap, loop.rms_m);
        CHECK((off_m < 0.02) == (steps > 0 || drift_m == 0));
      }
    }
  }
}

TEST_CASE("a loop is not believed when nothing but the ground fits") {
  const auto yard = [](const std::vector<Eigen::Vector2d>& huts) {
    Scene scene;
    scene.rectangle({-40, -40, 0}, {80, 0, 0}, {0, 80, 0});
    for (const Eigen::Vector2d& at : huts) scene.box({at.x(), at.y(), 0}, {at.x() + 2.0, at.y() + 1.5, 2.5});
    return scene;
  };
  const Scene here = yard({{5, 3}, {-4, 5}, {2, -6}, {-7, -3}, {9, -2}});
  const Scene elsewhere = yard({{0, 6}, {8, -6}, {-6, 1}, {5, 9}, {-3, -8}});
  const auto offered = [&](const Scene& then, double minimum_wall_fit) {
    MapperConfig config = small_config();
    config.voxel.cell_capacity = 16384;
    config.pool_bytes = std::size_t{16} << 20;
    config.close_loops = false;
    config.scan_match.minimum_correspondences = 1'000'000;  // so that the odometry stands
    config.loop_match.degenerate_ratio = 0;                 // so that a few chance pairs are a match
    config.belief.maximum_mahalanobis2 = 1e12;
    config.belief.minimum_wall_fit = minimum_wall_fit;
    Bench mapper(config);
    for (std::uint32_t i = 0; i < 10; ++i) {
      const Pose at = pose_at(0.5 * (i % 5), 0, 1, 0);
      Pose odometry = at;
      if (i >= 5) odometry.translation_m += Eigen::Vector3d(0.3, 0.2, 0.8);
      const std::vector<Point> points = (i < 5 ? here : then).scan(at, 5000, 15, 0.01, i);
      ScanReport report;
      REQUIRE(mapper->add_scan(points, &odometry, report) == Status::ok);
    }
    LoopReport loop;
    REQUIRE(mapper->offer_loop(2, 7, loop) == Status::ok);
    return loop;
  };
  const double least = BeliefConfig{}.minimum_wall_fit;
  const LoopReport same = offered(here, least);
  const LoopReport other = offered(elsewhere, least);
  CAPTURE(same.wall_fit, same.overlap, other.wall_fit, other.overlap, other.rms_m, other.correction_m);
  CHECK(same.verdict == LoopVerdict::closed);
  CHECK(same.wall_fit > 0.5);
  CHECK(other.overlap > BeliefConfig{}.minimum_overlap);
  CHECK(other.rms_m < BeliefConfig{}.maximum_rms_m);
  CHECK(other.verdict == LoopVerdict::refused_walls);
  CHECK(other.wall_fit < least);
  CHECK(offered(elsewhere, 0).verdict == LoopVerdict::closed);
}

TEST_CASE("another back end bends the map in LOA's place, once for every loop that is believed") {
  const Drive& drive = round_the_block();
  MapperConfig config = small_config();
  config.close_loops = false;
  Lift lift(true);
  Bench mapper(config, nullptr, &lift);
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
  const Drive& drive = round_the_block();
  MapperConfig config = small_config();
  config.close_loops = false;
  Lift lift(false);
  Bench mapper(config, nullptr, &lift);
  Bench plain(config);
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

TEST_CASE("an archive that cannot read any more costs matches and loops, not the map") {
  const Drive& drive = round_the_block();
  MapperConfig config = small_config();
  config.pool_bytes = 0;
  config.cache_slots = 8;
  MemoryArchive archive;
  Bench mapper(config, &archive);
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

TEST_CASE("with no room for loops every loop is refused for that reason") {
  const Drive& drive = round_the_block();
  MapperConfig config = small_config();
  config.close_loops = false;
  config.loop_capacity = 0;
  config.scan_capacity = 49;
  Bench mapper(config);
  drive_through(*mapper.mapper, drive, 49);
  LoopReport loop;
  for (const std::uint32_t first : {0U, 1U}) {
    REQUIRE(mapper->offer_loop(first, 48, loop) == Status::ok);
    CAPTURE(text(loop.verdict));
    CHECK(loop.verdict == LoopVerdict::refused_capacity);
  }
  CHECK(mapper->counters().loops_not_listed == 2);
}

TEST_CASE("what comes back from a scan is what went in, reduced") {
  const Drive& drive = round_the_block();
  Bench mapper(small_config());
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
