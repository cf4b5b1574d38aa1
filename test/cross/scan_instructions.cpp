// scan_instructions [SCANS]: maps so many scans of the simulated town (35 000 points each, standard settings,
// 64 MiB) with a mark around each scan for test/cross/instruction_counter.cpp. Prints what was mapped, and
// nothing that depends on time.
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

#include "alces/mapper.h"
#include "alces_platform/settings/memory_plan.h"
#include "alces_platform/sim/drive.h"

namespace {

void mark(int begins) {
  static_cast<void>(syscall(SYS_getppid, 0xA1CE5, begins));
}

}  // namespace

int main(int argc, char** argv) {
  using namespace alces;
  sim::DriveSettings settings;
  settings.scans = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 40;
  settings.scanner.points_per_scan = 72000;  // rays; about half of them meet something
  const sim::Drive drive = sim::drive(settings);

  MapperConfig config = MapperConfig::standard();
  config.scan_capacity = static_cast<std::uint32_t>(drive.size());
  config.voxel.cell_capacity = 32768;
  config.pool_bytes = 0;
  const settings::MemoryPlan plan = settings::plan_memory(config, std::size_t{64} << 20);
  const settings::MemoryBlock block(plan.block_bytes);
  Status status = Status::ok;
  Mapper* const mapper = Mapper::create(block.bytes(), config, status);
  if (mapper == nullptr) return std::fprintf(stderr, "%s\n", to_string(status)), 1;

  std::vector<Point> points;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    drive.points(i, points);
    ScanReport report;
    mark(1);
    status = mapper->add_scan(points, &drive.odometry(i), report);
    mark(0);
    if (status != Status::ok) return std::fprintf(stderr, "scan %zu: %s\n", i, to_string(status)), 1;
    if (report.loop_offered)
      std::printf("loop %u-%u: %s\n", report.loop.first, report.loop.last, to_string(report.loop.verdict));
  }
  LoopReport loop;
  mark(1);
  const bool is_offered = mapper->finish(loop);
  mark(0);
  if (is_offered) std::printf("loop %u-%u: %s\n", loop.first, loop.last, to_string(loop.verdict));
  const Mapper::Counters& counters = mapper->counters();
  std::printf("%zu scans, %llu points a scan, %llu of them kept; %u loops closed\n", drive.size(),
              static_cast<unsigned long long>(counters.points_in / drive.size()),
              static_cast<unsigned long long>(mapper->store_counters().points / drive.size()),
              counters.loops_closed);
  const Pose& last = mapper->graph().poses().back();
  std::printf("last pose %.6f %.6f %.6f m\n", last.translation_m.x(), last.translation_m.y(),
              last.translation_m.z());
  return 0;
}
