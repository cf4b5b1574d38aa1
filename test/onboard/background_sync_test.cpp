#include "alces_onboard/recorder/background_sync.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "alces_onboard/recorder/background_sink.h"
#include "alces_platform/linux/clock.h"
#include "alces_platform/recording/file_sink.h"
#include "onboard/vehicle_bench.h"
#include "support/comes_true.h"

using namespace alces;
using namespace alces::onboard;
using test::comes_true;

namespace {

/// A disk whose syncs come back when they are let, with the answer that they are told.
struct Disk {
  std::atomic<bool> blocks{false};
  std::atomic<int> answer{0};
  std::atomic<int> folder_syncs{0};
  std::atomic<int> file_syncs{0};
  std::atomic<int> waiting{0};

  int sync() {
    ++waiting;
    while (blocks) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    --waiting;
    return answer;
  }
};

/// The thread may be left in a sync: it shares the disk.
void start(BackgroundSync& sync, const std::shared_ptr<Disk>& disk) {
  sync.start([disk] { return ++disk->folder_syncs, disk->sync(); },
             [disk] { return ++disk->file_syncs, disk->sync(); });
}

std::string text_of(const std::optional<Notice>& notice) {
  return notice ? std::string(notice->source) + ": " + notice->text : "nothing";
}

}  // namespace

TEST_CASE("the folder is synced once, the file again and again, and once more at the end") {
  const auto disk = std::make_shared<Disk>();
  BackgroundSync sync({.period_ns = ns_per_ms});
  start(sync, disk);
  CHECK(comes_true([&] { return disk->file_syncs >= 5; }));
  CHECK(disk->folder_syncs == 1);
  CHECK_FALSE(sync.news(now_ns()));
  CHECK(sync.stop(10 * ns_per_s));
  CHECK(sync.error_number() == 0);
  CHECK(sync.counters().syncs == static_cast<std::uint64_t>(disk->file_syncs) + 1);
  CHECK(sync.stop(0));  // nothing to do any more
}

TEST_CASE("the last sync is not left out, however long the period is") {
  const auto disk = std::make_shared<Disk>();
  BackgroundSync sync({.period_ns = 3600 * ns_per_s});
  start(sync, disk);
  CHECK(sync.stop(10 * ns_per_s));
  CHECK(disk->file_syncs == 1);
}

TEST_CASE("a sync that fails is told once, its end as well, and the recording does not count as whole") {
  const auto disk = std::make_shared<Disk>();
  disk->answer = EIO;
  BackgroundSync sync({.period_ns = ns_per_ms});
  start(sync, disk);
  std::optional<Notice> notice;
  REQUIRE(comes_true([&] { return (notice = sync.news(now_ns())).has_value(); }));
  CHECK_THAT(text_of(notice), Catch::StartsWith("recording: the disk did not take a part of it"));
  CHECK(notice->severity == Severity::error);
  CHECK(notice->value == EIO);
  const int tries = disk->file_syncs;
  CHECK(comes_true([&] { return disk->file_syncs > tries + 3; }));
  CHECK_FALSE(sync.news(now_ns()));

  disk->answer = 0;
  REQUIRE(comes_true([&] { return (notice = sync.news(now_ns())).has_value(); }));
  CHECK_THAT(text_of(notice), Catch::Contains("confirms what is written again"));
  CHECK_FALSE(sync.stop(10 * ns_per_s));  // what was forgotten stays so
  CHECK(sync.error_number() == EIO);
}

TEST_CASE("what the system refuses to sync is no success") {
  BackgroundSync sync({.period_ns = ns_per_ms});
  sync.start([] { return sync_folder("/nowhere/at/all"); }, [] { return sync_data(-1); });
  REQUIRE(comes_true([&] { return sync.counters().syncs_failed >= 2; }));
  CHECK_FALSE(sync.stop(10 * ns_per_s));
  CHECK(sync.error_number() == EBADF);
}

TEST_CASE("while a sync does not come back the vehicle goes on: every tick is taken, recorded and written") {
  const auto disk = std::make_shared<Disk>();
  disk->blocks = true;
  char name[] = "/tmp/alcesd_sync_XXXXXX";
  const int made = ::mkstemp(name);
  REQUIRE(made >= 0);
  ::close(made);
  FileSink file;
  REQUIRE(file.open(name));
  BackgroundSink ring(file, {});
  BackgroundSync sync({.period_ns = ns_per_ms, .patience_ns = 0});
  VehicleBench bench(3);
  PipelineConfig config = config_of(small_vehicle());
  config.maps = false;
  config.recording.chunk_capacity = 2;  // pages of the index go the same way
  Pipeline pipeline(config, {.ports = bench.ports(), .recording = &ring});
  ring.start();
  start(sync, disk);
  REQUIRE(comes_true([&] { return disk->waiting == 1; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(2));

  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feeder.keeps = true;
  bench.drive_to_end(feeder);
  CHECK_THAT(text_of(sync.news(now_ns())), Catch::Contains("does not confirm"));
  CHECK_FALSE(sync.news(now_ns()));  // once
  pipeline.end_events();
  ring.let_writes_wait(10 * ns_per_s);
  CHECK(pipeline.finish_recording());
  CHECK(pipeline.recorder()->file_counters().chunks_written > 4);
  CHECK(pipeline.recorder()->file_counters().chunks_not_indexed == 0);
  CHECK(ring.stop(10 * ns_per_s));
  CHECK(disk->waiting == 1);  // all the time
  CHECK_FALSE(sync.stop(20 * ns_per_ms));
  CHECK(sync.error_number() == ETIMEDOUT);
  disk->blocks = false;

  FileSource source(name);
  RecordingReader reader(source);
  REQUIRE(reader.open());
  std::size_t ticks = 0;
  Event event;
  while (reader.next_event(event)) ticks += event.kind == EventKind::tick ? 1U : 0U;
  CHECK(reader.is_whole());
  const auto ticks_fed = static_cast<std::size_t>(std::ranges::count_if(
      feeder.kept, [](const KeptEvent& kept) { return kept.event.kind == EventKind::tick; }));
  CHECK(ticks_fed > 1000);
  CHECK(ticks == ticks_fed);
  CHECK(pipeline.counters().scans >= 3);
  ::unlink(name);
}
