// Nothing allocates once a mapper is made: malloc and its kin, and operator new, are replaced in this program
// and trap while the mapper works. A program of its own, for glibc without sanitizers.
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "alces/deskew.h"
#include "alces/mapper.h"
#include "alces_platform/sim/drive.h"
#include "support/allocation_trap.h"

namespace {

using namespace alces;
using test::allocations;
using test::is_armed;

int failures = 0;

void expect(bool is_so, const char* what) {
  std::printf("%s: %s\n", is_so ? "ok" : "FAILED", what);
  if (!is_so) ++failures;
}

constexpr std::uint32_t scans = 100;

constexpr MapperConfig config_with(CorrectionRule rule, IcpMetric metric) {
  MapperConfig config = MapperConfig::standard();
  config.scan_capacity = scans;
  config.loop_capacity = 32;
  config.pool_bytes = std::size_t{6} << 20;
  config.keep_intensity = true;
  config.voxel.cell_capacity = 6144;
  config.correction_rule = rule;
  config.scan_match.metric = metric;
  if (metric == IcpMetric::point_to_point) {  // the paper's: a match so rough is ambiguous
    config.loop_verification.ambiguity_sigmas = 0;
    config.loop_verification.free_space_sigmas = 0;
  }
  return config;
}

alignas(Arena::alignment)
    std::byte block[Mapper::memory_required(config_with(CorrectionRule::trails, IcpMetric::surface))];

void map(const sim::Drive& drive, CorrectionRule rule, IcpMetric metric) {
  Status status = Status::bad_config;
  is_armed = true;
  Mapper* const mapper = Mapper::create(block, config_with(rule, metric), status);
  is_armed = false;
  expect(mapper != nullptr, "the mapper is made in its static block");
  if (mapper == nullptr) return;
  std::vector<Point> points;
  std::vector<std::uint8_t> intensity;
  unsigned refused = 0;
  for (std::uint32_t i = 0; i < scans; ++i) {
    drive.points(i, points);
    intensity.assign(points.size(), static_cast<std::uint8_t>(i));
    ScanReport report;
    is_armed = true;
    const Status added = mapper->add_scan(points, &drive.odometry(i), report, nullptr, intensity);
    is_armed = false;
    if (added != Status::ok && added != Status::no_voxel_capacity) ++refused;
  }
  LoopReport loop;
  is_armed = true;
  mapper->finish(loop);
  if (mapper->counters().loops_closed == 0) (void)mapper->offer_loop(0, scans - 1, loop);
  (void)mapper->offer_loop(0, scans / 2, loop);  // refused or not: it runs
  ScanReport report;
  (void)mapper->add_scan(points, nullptr, report);  // beyond the capacity
  is_armed = false;
  std::printf("    %u loops closed of %u\n", mapper->counters().loops_closed,
              mapper->counters().loops_offered);
  expect(refused == 0, "every scan is added");
  expect(mapper->counters().loops_closed > 0, "a loop is closed");
  expect(allocations == 0, "nothing was allocated");
}

constexpr DeskewConfig deskew_config{.pose_capacity = 16};
alignas(Arena::alignment) std::byte deskew_block[4096];

void deskew() {
  std::vector<Point> points(1000, Point{1, 2, 3});
  std::vector<float> time_s(1000);
  for (std::size_t i = 0; i < time_s.size(); ++i) time_s[i] = 1e-4F * static_cast<float>(i);
  const GyroSample samples[] = {{0, {0, 0, 1}}, {0.05, {0, 0, 1.2}}, {0.1, {0, 0, 1.4}}};
  is_armed = true;
  Arena arena(deskew_block);
  Deskew deskew(arena, deskew_config);
  bool is_done = !arena.overflowed();
  for (int i = 0; i < 10; ++i)
    is_done = is_done &&
              deskew.add_pose(0.02 * i, {exp_so3({0, 0, 0.01 * i}), {0.1 * i, 0, 0}}) == DeskewStatus::ok;
  is_done = is_done && deskew.apply(points, time_s, 0) == DeskewStatus::ok;
  is_done = is_done && deskew.set_gyro(samples, {1, 0, 0}) == DeskewStatus::ok;
  is_done = is_done && deskew.apply(points, time_s, 0) == DeskewStatus::ok;
  is_armed = false;
  expect(is_done, "a scan is deskewed, by poses and by a gyro");
  expect(allocations == 0, "nothing was allocated");
}

}  // namespace

int main() {
  expect(test::trap_springs(), "the trap springs");

  sim::DriveSettings settings;
  settings.scans = scans;
  settings.scanner.points_per_scan = 6000;
  const sim::Drive drive = sim::drive(settings);
  map(drive, CorrectionRule::trails, IcpMetric::surface);
  map(drive, CorrectionRule::paper, IcpMetric::point_to_point);
  deskew();
  return failures == 0 ? 0 : 1;
}
