// The disk under the archive is full for a while, or does not answer at all: on the simulated wires.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <string>
#include <thread>

#include "alces_onboard/error.h"
#include "alces_onboard/orderly_stop.h"
#include "onboard/vehicle_bench.h"
#include "support/memory_archive.h"

using namespace alces;
using namespace alces::onboard;
using Catch::Matchers::Contains;

namespace {

/// Writes do not come back until it is released, as on a disk that is stalled.
class StalledArchive final : public ScanArchive {
 public:
  ~StalledArchive() { is_stalled = false; }
  [[nodiscard]] bool write(std::uint32_t scan, std::span<const std::byte> bytes) override {
    while (is_stalled) {
      is_waited_for = true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    is_waited_for = false;
    return below.write(scan, bytes);
  }
  [[nodiscard]] bool read(std::uint32_t scan, std::span<std::byte> bytes) override {
    return below.read(scan, bytes);
  }
  test::MemoryArchive below;
  std::atomic<bool> is_stalled{false};
  std::atomic<bool> is_waited_for{false};
};

/// Every scan goes into the archive.
PipelineConfig archiving() {
  PipelineConfig config = config_of(small_vehicle());
  config.mapping.mapper.pool_bytes = 0;
  return config;
}

template <class Archive>
struct ArchiveBench {
  explicit ArchiveBench(std::size_t scans)
      : bench(scans),
        pipeline(archiving(),
                 {.ports = bench.ports(), .recording = &sink, .archive = &archive, .listener = &notices}),
        feeder(pipeline) {
    feeder.maps = false;  // after each event would be a try of the archive each
    pipeline.start_scanner();
  }
  void run_for(std::int64_t duration_ns) {
    for (std::int64_t done_ns = 0; done_ns < duration_ns; done_ns += 100 * ns_per_ms) {
      bench.run_for(100 * ns_per_ms, feeder);
      while (pipeline.run_mapper_once()) {
      }
      pipeline.take_results();
    }
  }
  void drive_to_end() { run_for(bench.end_ns() - std::max(bench.now_ns(), bench.begin_ns())); }
  [[nodiscard]] std::string line() const {
    std::array<char, 512> room{};
    return std::string(format(pipeline.status(), room));
  }
  [[nodiscard]] bool head_turns() { return bench.vehicle().drive().head_turns_per_s_at(bench.now_ns()) != 0; }
  void run_until_mapped(std::uint64_t scans) {
    for (int i = 0; i < 300 && pipeline.counters().scans_mapped < scans; ++i) run_for(100 * ns_per_ms);
    REQUIRE(pipeline.counters().scans_mapped >= scans);
  }
  VehicleBench bench;
  MemorySink sink;
  NoticeList notices;
  Archive archive;
  Pipeline pipeline;
  Feeder feeder;
};

/// The mapping thread hangs in a stalled archive, in the middle of a drive.
struct HungBench : ArchiveBench<StalledArchive> {
  explicit HungBench(std::size_t scans = 40) : ArchiveBench(scans) {
    // a thread maps
    pipeline.start_mapping_thread();
    for (int i = 0; i < 60'000 && pipeline.counters().scans_mapped < 2; ++i) {
      if (pipeline.status().waiting_scans == 0) {
        bench.run_for(10 * ns_per_ms, feeder);
      } else {  // simulated time waits for the thread, so that it is never behind
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        pipeline.take_results();
      }
    }
    REQUIRE(pipeline.counters().scans_mapped >= 2);
    archive.is_stalled = true;
    for (int i = 0; i < 60'000 && !archive.is_waited_for; ++i) {
      if (pipeline.status().waiting_scans == 0) bench.run_for(10 * ns_per_ms, feeder);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    REQUIRE(archive.is_waited_for);
  }
  ~HungBench() { archive.is_stalled = false; }

  /// Simulated time until it is finished, at most a minute.
  std::int64_t end(std::uint64_t requests) {
    OrderlyStop stop(pipeline, {});
    const std::int64_t begin_ns = bench.now_ns();
    while (bench.now_ns() - begin_ns < 60 * ns_per_s) {
      bench.run_for(10 * ns_per_ms, feeder);
      if (stop.update(bench.now_ns(), requests, true) == StopStage::finished) break;
    }
    was_mapper_left = stop.was_mapper_left();
    return bench.now_ns() - begin_ns;
  }
  bool was_mapper_left = false;
};

}  // namespace

TEST_CASE(
    "an archive that is full for three seconds costs no scan, is told, and the map goes on to the bit") {
  std::vector<Pose> undisturbed;
  {
    ArchiveBench<test::MemoryArchive> bench(8);
    bench.drive_to_end();
    REQUIRE(end_drive(bench.pipeline));
    undisturbed = poses_of(bench.pipeline);
    CHECK(bench.pipeline.counters().archive_stalls == 0);
  }
  ArchiveBench<test::MemoryArchive> bench(8);
  bench.run_until_mapped(3);
  const std::uint64_t mapped = bench.pipeline.counters().scans_mapped;
  CHECK_THAT(bench.line(), !Contains("AGO") && !Contains("STALLED"));
  bench.archive.write_fails = true;
  bench.run_for(3 * ns_per_s);
  CHECK(bench.pipeline.counters().scans_mapped == mapped);
  CHECK_FALSE(bench.pipeline.status().is_map_full);
  bench.run_for(ns_per_s / 2);
  CHECK_THAT(bench.line(), Contains("ARCHIVE STALLED") && Contains(" s AGO"));  // no stale pose as a new one
  CHECK(bench.notices.has("mapper: the scan archive cannot be written; make room on its disk"));
  CHECK(bench.pipeline.are_threads_alive());

  bench.archive.write_fails = false;
  bench.run_for(3 * ns_per_s);
  CHECK(bench.pipeline.counters().scans_mapped > mapped + 3);
  CHECK_THAT(bench.line(), !Contains("STALLED") && !Contains("AGO"));
  CHECK(bench.notices.has("mapper: the scan archive is written again"));
  bench.drive_to_end();
  REQUIRE(end_drive(bench.pipeline));
  CHECK(bench.pipeline.counters().archive_stalls == 1);
  CHECK(bench.pipeline.counters().archive_retries > 1);
  CHECK(bench.pipeline.counters().scans_dropped == 0);
  CHECK(are_same_bits(poses_of(bench.pipeline), undisturbed));
}

TEST_CASE("an archive that is full for long loses the newest scans, counted, and the map goes on after it") {
  ArchiveBench<test::MemoryArchive> bench(30);
  bench.run_until_mapped(3);
  const std::uint64_t mapped = bench.pipeline.counters().scans_mapped;
  bench.archive.write_fails = true;
  bench.run_for(8 * ns_per_s);
  CHECK(bench.pipeline.counters().scans_mapped == mapped);
  CHECK(bench.pipeline.counters().scans_dropped > 1);
  bench.archive.write_fails = false;
  bench.run_for(5 * ns_per_s);
  CHECK(bench.pipeline.counters().scans_mapped > mapped + 4);
  CHECK(bench.pipeline.health().parts == 1);
  const Eigen::Vector3d at_m = bench.pipeline.status().map_from_body.translation_m;
  REQUIRE(end_drive(bench.pipeline));
  CHECK(at_m.allFinite());
  std::uint64_t dropped = 0;
  std::int64_t newest_ns = 0;
  const Recorded recorded = read_back(bench.sink.bytes);
  for (const Recorded::KeptScan& kept : recorded.scans)
    dropped += kept.verdict == "dropped: the mapper was busy" ? 1U : 0U;
  CHECK(dropped == bench.pipeline.counters().scans_dropped);  // `alces replay` drops the same
  for (const PoseRecord& pose : recorded.poses) {
    CHECK(pose.stamp_ns > newest_ns);  // each pose once, at the time that it is of
    newest_ns = pose.stamp_ns;
  }
}

TEST_CASE("an archive that cannot be read is told, and steps go on by odometry") {
  ArchiveBench<test::MemoryArchive> bench(10);
  bench.run_until_mapped(3);
  bench.archive.read_fails = true;
  bench.drive_to_end();
  REQUIRE(end_drive(bench.pipeline));
  CHECK(bench.pipeline.counters().scans_mapped >= 8);
  for (const Pose& pose : poses_of(bench.pipeline)) CHECK(is_valid(pose));
}

TEST_CASE("while the mapper hangs in a stalled archive the watchdog is told nothing, and recording goes on") {
  HungBench bench;
  CHECK(bench.pipeline.are_threads_alive());
  bench.bench.run_for(19 * ns_per_s, bench.feeder);
  CHECK(bench.pipeline.are_threads_alive());
  const std::size_t recorded = bench.sink.bytes.size();
  const std::uint64_t mapped = bench.pipeline.counters().scans_mapped;
  bench.bench.run_for(3 * ns_per_s, bench.feeder);
  CHECK_FALSE(bench.pipeline.are_threads_alive());
  CHECK(bench.notices.has("mapper: does not come back from a scan"));
  CHECK_THAT(bench.line(), Contains("MAPPER HANGS for 2") && Contains(" s AGO"));
  CHECK(bench.sink.bytes.size() > recorded);
  CHECK(bench.pipeline.counters().mapper_hangs == 1);

  bench.archive.is_stalled = false;  // the disk is back: so is the map
  for (int i = 0; i < 60'000 && bench.pipeline.counters().scans_mapped <= mapped + 3; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    bench.bench.run_for(10 * ns_per_ms, bench.feeder);
  }
  CHECK(bench.pipeline.counters().scans_mapped > mapped + 3);
  CHECK(bench.pipeline.are_threads_alive());
  CHECK(bench.notices.has("mapper: is back; the map goes on"));
}

TEST_CASE(
    "told to stop while the mapper hangs: the head stands, the recording is whole, the mapper is left") {
  HungBench bench;
  const bool was_known_before = GENERATE(false, true);
  if (was_known_before) bench.bench.run_for(21 * ns_per_s, bench.feeder);
  CHECK(bench.pipeline.are_threads_alive() != was_known_before);
  REQUIRE(bench.head_turns());
  const std::int64_t took_ns = bench.end(1);
  CHECK(took_ns < (was_known_before ? 15 : 35) * ns_per_s);
  CHECK(bench.was_mapper_left);
  CHECK(bench.notices.has("the mapper did not come back in time and is left"));
  CHECK_FALSE(bench.head_turns());
  CHECK(bench.pipeline.is_motor_confirmed());
  CHECK(bench.pipeline.finish_recording());
  CHECK(bench.pipeline.was_mapper_left());
  const Recorded recorded = read_back(bench.sink.bytes);
  CHECK(recorded.is_whole);
  CHECK(recorded.poses.size() == bench.pipeline.counters().scans_mapped);
}

TEST_CASE("a second signal waits five seconds for a mapper that hangs, a third one half a second") {
  HungBench bench;
  const std::uint64_t requests = GENERATE(std::uint64_t{2}, std::uint64_t{3});
  const std::int64_t took_ns = bench.end(requests);
  CHECK(took_ns < (requests == 2 ? 7 * ns_per_s : ns_per_s));
  CHECK(bench.was_mapper_left);
  CHECK(bench.pipeline.is_motor_confirmed() == (requests == 2));
  CHECK(bench.head_turns() == (requests == 3));
  CHECK(bench.pipeline.finish_recording());
  CHECK(read_back(bench.sink.bytes).is_whole);
}

TEST_CASE("a process whose mapper hangs ends all the same, with its own exit status") {
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    HungBench bench;
    bench.end(3);
    const bool is_whole = bench.pipeline.finish_recording();
    if (!bench.pipeline.was_mapper_left()) ::_exit(1);
    leave_process(is_whole ? ExitStatus::hung : ExitStatus::device, "the mapper did not come back (a test)");
  }
  int status = -1;
  pid_t ended = 0;
  for (int i = 0; i < 120'000 && ended == 0; ++i) {
    ended = ::waitpid(child, &status, WNOHANG);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (ended == 0) ::kill(child, SIGKILL);
  REQUIRE(ended == child);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 7);
}
