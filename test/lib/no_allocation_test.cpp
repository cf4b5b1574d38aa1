// Nothing allocates once a mapper is made: malloc and its kin, and operator new, are replaced in this program
// and trap while the mapper works. A program of its own, for glibc without sanitizers.
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <vector>

#include "alces/mapper.h"
#include "alces_platform/sim/drive.h"

namespace {

std::atomic<bool> is_armed{false};
std::atomic<unsigned> allocations{0};

void count_allocation() {
  if (is_armed.load(std::memory_order_relaxed)) allocations.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace

extern "C" {
void* __libc_malloc(std::size_t);                 // NOLINT(bugprone-reserved-identifier)
void* __libc_calloc(std::size_t, std::size_t);    // NOLINT(bugprone-reserved-identifier)
void* __libc_realloc(void*, std::size_t);         // NOLINT(bugprone-reserved-identifier)
void* __libc_memalign(std::size_t, std::size_t);  // NOLINT(bugprone-reserved-identifier)
void __libc_free(void*);                          // NOLINT(bugprone-reserved-identifier)

void* malloc(std::size_t bytes) {
  count_allocation();
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  count_allocation();
  return __libc_calloc(count, bytes);
}
void* realloc(void* memory, std::size_t bytes) {
  count_allocation();
  return __libc_realloc(memory, bytes);
}
void* memalign(std::size_t alignment, std::size_t bytes) {
  count_allocation();
  return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  count_allocation();
  return __libc_memalign(alignment, bytes);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) {
  count_allocation();
  *memory = __libc_memalign(alignment, bytes);
  return *memory == nullptr ? 12 : 0;  // ENOMEM
}
}

void* operator new(std::size_t bytes) {
  count_allocation();
  if (void* const memory = __libc_malloc(bytes)) return memory;
  std::abort();
}
void operator delete(void* memory) noexcept {
  __libc_free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  __libc_free(memory);
}

namespace {

using namespace alces;

int failures = 0;

void expect(bool is_so, const char* what) {
  std::printf("%s: %s\n", is_so ? "ok" : "FAILED", what);
  if (!is_so) ++failures;
}

constexpr std::uint32_t scans = 100;

constexpr MapperConfig config_with(SharingRule rule, IcpMetric metric) {
  MapperConfig config = MapperConfig::standard();
  config.scan_capacity = scans;
  config.loop_capacity = 32;
  config.pool_bytes = std::size_t{6} << 20;
  config.voxel.cell_capacity = 6144;
  config.sharing = rule;
  config.scan_match.metric = metric;
  return config;
}

alignas(Arena::alignment)
    std::byte block[Mapper::memory_required(config_with(SharingRule::trails, IcpMetric::surface))];

void map(const sim::Drive& drive, SharingRule rule, IcpMetric metric) {
  Status status = Status::bad_config;
  is_armed = true;
  Mapper* const mapper = Mapper::create(block, config_with(rule, metric), status);
  is_armed = false;
  expect(mapper != nullptr, "the mapper is made in its static block");
  if (mapper == nullptr) return;
  std::vector<Point> points;
  unsigned refused = 0;
  for (std::uint32_t i = 0; i < scans; ++i) {
    drive.points(i, points);
    ScanReport report;
    is_armed = true;
    const Status added = mapper->add_scan(points, &drive.odometry(i), report);
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

}  // namespace

int main() {
  is_armed = true;
  std::free(std::malloc(100));
  delete new int(3);
  is_armed = false;
  expect(allocations > 0, "the trap springs");
  allocations = 0;

  sim::DriveSettings settings;
  settings.scans = scans;
  settings.scanner.points_per_scan = 6000;
  const sim::Drive drive = sim::drive(settings);
  map(drive, SharingRule::trails, IcpMetric::surface);
  map(drive, SharingRule::paper, IcpMetric::point_to_point);
  return failures == 0 ? 0 : 1;
}
