// Nothing allocates once alcesd has started: malloc and its kin, and operator new, are replaced in this
// program and trap on every thread while a drive goes through the whole of it but the devices: drivers,
// mapper on its thread, recording through its thread to a file, notices and status lines. A program of its
// own, for glibc without sanitizers.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "alces_onboard/console.h"
#include "alces_onboard/page/live_page.h"
#include "alces_onboard/recorder/background_sink.h"
#include "alces_onboard/recorder/background_sync.h"
#include "alces_platform/linux/clock.h"
#include "alces_platform/recording/file_sink.h"
#include "onboard/vehicle_bench.h"
#include "support/allocation_trap.h"

namespace {

using namespace alces;
using test::allocations;
using test::is_armed;
using namespace alces::onboard;

int failures = 0;

void expect(bool is_so, const char* what) {
  std::printf("%s: %s\n", is_so ? "ok" : "FAILED", what);
  if (!is_so) ++failures;
}

/// A drive's events, from a simulator that allocates.
std::vector<KeptEvent> drive_events() {
  VehicleBench bench(8);
  PipelineConfig config = config_of(small_vehicle());
  config.maps = false;
  config.records = false;
  Pipeline pipeline(config, {.ports = bench.ports()});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feeder.keeps = true;
  bench.drive_to_end(feeder);
  return std::move(feeder.kept);
}

}  // namespace

int main() {
  expect(test::trap_springs(), "the trap springs");

  const std::vector<KeptEvent> events = drive_events();
  std::string name = "/tmp/alcesd_no_allocation_XXXXXX";
  const int descriptor = ::mkstemp(name.data());
  expect(descriptor >= 0, "a file to record to");
  FileSink file;
  expect(file.open(name.c_str()), "it opens");
  BackgroundSink recording(file, {});
  BackgroundSync sync({.period_ns = ns_per_ms});
  DescriptorSink terminal(descriptor);
  BackgroundSink lines(terminal, {.ring_bytes = 65536});
  Console console({}, lines);
  NoWires wires;
  const auto shared = std::make_unique<alces_page>();
  LivePage page(*shared);
  PipelineConfig config = config_of(small_vehicle());
  config.mapping.scan_slots = 32;
  config.counters_interval_ns = 2 * ns_per_s;
  {
    Pipeline pipeline(
        config,
        {.ports = {&wires, {&wires, &wires}}, .page = &page, .recording = &recording, .listener = &console});
    recording.start();
    sync.start([] { return sync_folder("/tmp"); }, [&] { return sync_data(file.descriptor()); });
    lines.start();
    pipeline.start_mapping_thread();
    pipeline.start_scanner();
    std::array<char, 512> room{};

    is_armed = true;
    std::int64_t shown_ns = 0;
    for (const KeptEvent& kept : events) {
      Event event = kept.event;
      event.bytes = kept.bytes;
      pipeline.on_event(event);
      if (event.kind == EventKind::tick && event.stamp_ns - shown_ns >= ns_per_s) {
        shown_ns = event.stamp_ns;
        expect(!sync.news(now_ns()), "the disk takes everything");
        console.show_status(format(pipeline.status(), room), shown_ns);
      }
    }
    pipeline.end_events();
    while (!pipeline.is_mapping_finished()) {
      pipeline.take_results();
      std::this_thread::yield();
    }
    recording.let_writes_wait(10 * ns_per_s);
    const bool is_whole = pipeline.finish_recording();
    is_armed = false;

    expect(is_whole, "the recording is whole");
    expect(pipeline.counters().scans_mapped >= 7, "scans are mapped");
    expect(pipeline.counters().scans_dropped == 0, "none is dropped");
    expect(console.lines_lost() == 0, "lines are said");
    std::array<std::uint32_t, ALCES_PAGE_WORDS(alces_page_map)> words{};
    alces_page_map map{};
    expect(alces_page_read(shared->map, words.data(), words.size()) == 1, "the page can be read");
    std::memcpy(&map, words.data(), sizeof map);
    expect(map.map_from_odom.sequence >= 7, "and has the scans' poses");
  }
  expect(recording.stop(10 * ns_per_s), "all is on its way to the disk");
  expect(sync.stop(10 * ns_per_s), "and on it");
  expect(lines.stop(10 * ns_per_s), "and to the terminal");
  expect(file.size() > 1'000'000, "the file is there");
  std::remove(name.c_str());
  std::printf("    %u allocations\n", allocations.load());
  expect(allocations == 0, "nothing was allocated");
  return failures == 0 ? 0 : 1;
}
