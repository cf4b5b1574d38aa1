// The mapper on drives through the synthetic town, against truth.
#include <catch2/catch.hpp>
#include <vector>

#include "alces/mapper.h"
#include "alces_platform/sim/drive.h"
#include "support/in_block.h"
#include "support/plain_scene.h"

using namespace alces;
using namespace alces::test;

namespace {

MapperConfig config_for(std::size_t scans) {
  MapperConfig config = MapperConfig::standard();
  config.scan_capacity = static_cast<std::uint32_t>(scans);
  config.loop_capacity = 64;
  config.pool_bytes = std::size_t{16} << 20;
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

class Bench {
 public:
  explicit Bench(const MapperConfig& config) : block_(Mapper::memory_required(config)) {
    Status status = Status::bad_config;
    mapper = Mapper::create(block_.bytes(), config, status);
    REQUIRE(mapper != nullptr);
  }
  Mapper* operator->() const { return mapper; }
  Mapper* mapper = nullptr;

 private:
  Block block_;
};

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

TEST_CASE("closing the loops of a drive through the town brings the map nearer to the truth") {
  const sim::Drive drive = sim::drive(settings_for(115, 1, 14000));
  const MapperConfig config = config_for(drive.size());
  MapperConfig open = config;
  open.close_loops = false;
  const Bench closed(config);
  const Bench without(open);
  drive_through(drive, 0, drive.size(), 1, {closed.mapper, without.mapper});
  LoopReport loop;
  closed->finish(loop);
  const double error_m = mean_error_m(*closed.mapper, drive);
  const double open_m = mean_error_m(*without.mapper, drive);
  CAPTURE(error_m, open_m, closed->loops().size());
  CHECK(closed->counters().loops_closed >= 1);
  CHECK(error_m < open_m);
  CHECK(error_m < 0.5);
  for (const LoopReport& each : closed->loops()) {
    if (each.verdict != LoopVerdict::closed) continue;
    // a false loop would join places that are far apart
    CHECK(distance_m(drive.truth(each.first), drive.truth(each.last)) < 20);
    const Pose truth = drive.truth(each.first).inverse() * drive.truth(each.last);
    const Pose mapped = closed->graph().poses()[each.first].inverse() * closed->graph().poses()[each.last];
    CHECK(distance_m(truth, mapped) < 0.3);
  }
}

TEST_CASE("a loop between two places that only look alike is refused with a reason") {
  const sim::LookAlike alike = sim::look_alike_drive(4, settings_for(0, 4, 12000));
  constexpr std::size_t every = 2;  // scans, for time's sake
  const std::size_t begin = alike.first - 4 * every;
  const auto second = static_cast<std::uint32_t>((alike.second - begin) / every);
  MapperConfig config = config_for(second + 4);
  config.close_loops = false;
  const Bench mapper(config);
  drive_through(alike.drive, begin, begin + every * (second + 4), every, {mapper.mapper});
  const std::vector<Pose> before(mapper->graph().poses().begin(), mapper->graph().poses().end());
  for (const std::uint32_t shift : {0U, 2U}) {
    LoopReport loop;
    REQUIRE(mapper->offer_loop(4 + shift, second + shift, loop) == Status::ok);
    CAPTURE(text(loop.verdict), loop.overlap, loop.rms_m, loop.mahalanobis2, loop.correction_m);
    CHECK(loop.verdict != LoopVerdict::closed);
  }
  CHECK(mapper->counters().loops_closed == 0);
  CHECK(mapper->loops().size() == 2);
  std::size_t moved = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (mapper->graph().poses()[i].translation_m != before[i].translation_m) ++moved;
  }
  CHECK(moved == 0);
}
