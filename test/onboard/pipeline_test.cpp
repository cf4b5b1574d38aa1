#include "alces_onboard/pipeline.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <set>
#include <thread>

#include "alces_onboard/error.h"
#include "onboard/vehicle_bench.h"

using namespace alces;
using namespace alces::onboard;

TEST_CASE("every assembled scan has one record that says what became of it") {
  const RecordedDrive& drive = recorded_drive();
  REQUIRE(drive.was_ended);
  CHECK(drive.recorded.is_whole);
  CHECK(drive.recorded.configuration == small_vehicle().text);
  REQUIRE(drive.counters.scans >= 6);
  REQUIRE(drive.recorded.scans.size() == drive.counters.scans);
  std::set<std::uint32_t> numbers;
  std::uint32_t next_place = 0;
  std::uint64_t incomplete = 0;
  for (const Recorded::KeptScan& kept : drive.recorded.scans) {
    numbers.insert(kept.scan.number);
    if (kept.scan.was_mapped) {
      CHECK(kept.verdict.substr(0, 6) == "mapped");
      CHECK(kept.scan.map_index == next_place++);
      CHECK(kept.scan.points_reduced > 100);
      CHECK_FALSE(kept.scan.is_incomplete);
    } else {
      CHECK(kept.verdict == "incomplete");
      CHECK(kept.scan.is_incomplete);
      ++incomplete;
    }
    CHECK(kept.scan.points > 0);
  }
  CHECK(numbers.size() == drive.recorded.scans.size());
  CHECK(*numbers.rbegin() + 1 == numbers.size());
  CHECK(incomplete == drive.counters.scans_incomplete);
  CHECK(next_place == drive.counters.scans_mapped);
  CHECK(drive.recorded.poses.size() == next_place);
  CHECK(drive.recorded.clouds == next_place);
  CHECK(drive.recorded.edges >= next_place - 1);
}

TEST_CASE("a recording replayed gives the poses of the drive, to the bit") {
  const RecordedDrive& drive = recorded_drive();
  REQUIRE(drive.poses.size() >= 5);
  NoWires wires;
  const settings::VehicleSettings vehicle =
      settings::parse_vehicle_settings(drive.recorded.configuration, "vehicle.toml");
  PipelineConfig config = config_of(vehicle);
  config.records = false;
  Pipeline replay(config, {.ports = {&wires, {&wires, &wires}}});
  replay.start_scanner();
  Feeder feeder(replay);
  feed(drive.recorded.events, feeder);
  REQUIRE(end_drive(replay));
  CHECK(are_same_bits(poses_of(replay), drive.poses));
  CHECK(replay.counters().scans == drive.counters.scans);
}

TEST_CASE("a mapper on its own thread makes the same map") {
  const RecordedDrive& drive = recorded_drive();
  NoWires wires;
  MemorySink sink;
  PipelineConfig config = config_of(small_vehicle());
  config.mapping.scan_slots = 64;  // so that none is dropped, however slow the machine
  Pipeline pipeline(config, {.ports = {&wires, {&wires, &wires}}, .recording = &sink});
  pipeline.start_mapping_thread();
  pipeline.start_scanner();
  feed(drive.recorded.events, pipeline);
  pipeline.end_events();
  for (int i = 0; i < 60'000 && !pipeline.is_mapping_finished(); ++i) {
    pipeline.take_results();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  REQUIRE(pipeline.is_mapping_finished());
  REQUIRE(pipeline.finish_recording());
  CHECK(are_same_bits(poses_of(pipeline), drive.poses));
  CHECK(read_back(sink.bytes).scans.size() == drive.counters.scans);
}

TEST_CASE("a pipeline that is thrown away in the middle of a drive ends its thread") {
  const RecordedDrive& drive = recorded_drive();
  NoWires wires;
  PipelineConfig config = config_of(small_vehicle());
  config.records = false;
  Pipeline pipeline(config, {.ports = {&wires, {&wires, &wires}}});
  pipeline.start_mapping_thread();
  pipeline.start_scanner();
  feed(drive.recorded.events, pipeline);
  CHECK(pipeline.counters().scans > 0);
}

TEST_CASE(
    "when the mapper is too slow the newest scans are dropped, counted and recorded, and raw data goes on") {
  const RecordedDrive& drive = recorded_drive();
  NoWires wires;
  MemorySink sink;
  NoticeList notices;
  PipelineConfig config = config_of(small_vehicle());
  config.mapping.scan_slots = 2;
  Pipeline pipeline(config, {.ports = {&wires, {&wires, &wires}}, .recording = &sink, .listener = &notices});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feeder.maps = false;
  feed(drive.recorded.events, feeder);
  const std::uint64_t whole = pipeline.counters().scans - pipeline.counters().scans_incomplete;
  REQUIRE(whole >= 5);
  CHECK(pipeline.counters().scans_dropped == whole - 2);
  CHECK(pipeline.status().waiting_scans == 2);
  CHECK(notices.has("mapper: is behind"));
  REQUIRE(end_drive(pipeline));
  CHECK(pipeline.counters().scans_mapped == 2);

  const Recorded recorded = read_back(sink.bytes);
  CHECK(recorded.events.size() == drive.recorded.events.size());
  std::vector<std::uint32_t> mapped;
  std::vector<std::uint32_t> dropped;
  for (const Recorded::KeptScan& kept : recorded.scans) {
    if (kept.scan.was_mapped) mapped.push_back(kept.scan.number);
    if (kept.verdict == "dropped: the mapper was busy") dropped.push_back(kept.scan.number);
  }
  REQUIRE(mapped.size() == 2);
  CHECK(dropped.size() == whole - 2);
  CHECK(mapped.back() < dropped.front());  // the newest go
  CHECK(recorded.scans.size() == pipeline.counters().scans);
}

TEST_CASE("scans of more cells than the table has are mapped coarser, all of each, and it is told") {
  const RecordedDrive& drive = recorded_drive();
  NoWires wires;
  MemorySink sink;
  NoticeList notices;
  PipelineConfig config = config_of(small_vehicle());
  config.mapping.mapper.voxel.cell_capacity = 1000;
  Pipeline pipeline(config, {.ports = {&wires, {&wires, &wires}}, .recording = &sink, .listener = &notices});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feed(drive.recorded.events, feeder);
  REQUIRE(end_drive(pipeline));
  CHECK(pipeline.counters().scans_mapped == drive.counters.scans_mapped);
  CHECK(pipeline.counters().scans_thinned == drive.counters.scans_mapped);
  CHECK(drive.counters.scans_thinned == 0);
  CHECK(notices.has("mapper: a scan has more cells than voxel.cell_capacity and is downsampled coarser"));
  CHECK_FALSE(drive.notices.has("downsampled coarser"));
  for (const Recorded::KeptScan& kept : read_back(sink.bytes).scans) {
    if (!kept.scan.was_mapped) continue;
    CHECK(kept.verdict == "mapped, downsampled coarser");
    CHECK(kept.scan.points_reduced <= 1000);
  }
}

namespace {

struct Judged {
  NoticeList notices;
  StatusReport status;
  std::string line;
};

/// The recorded drive again.
Judged judged(const PipelineConfig& config) {
  Judged outcome;
  NoWires wires;
  Pipeline pipeline(config, {.ports = {&wires, {&wires, &wires}}, .listener = &outcome.notices});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feed(recorded_drive().recorded.events, feeder);
  REQUIRE(end_drive(pipeline));
  outcome.status = pipeline.status();
  std::array<char, 512> room{};
  outcome.line = format(outcome.status, room);
  CHECK(pipeline.health().verdict == pipeline.mapper()->health().verdict);
  return outcome;
}

PipelineConfig without_recording() {
  PipelineConfig config = config_of(small_vehicle());
  config.records = false;
  return config;
}

}  // namespace

TEST_CASE("a good map is called good in the status, and no notice speaks of it") {
  const Judged outcome = judged(without_recording());
  CHECK(outcome.status.health.verdict == MapVerdict::good);
  CHECK(outcome.line.find("| map good |") != std::string::npos);
  CHECK_FALSE(outcome.notices.has("the map is"));
  CHECK_FALSE(outcome.notices.has("a new part"));
}

TEST_CASE(
    "a map whose steps stand on odometry alone is called bad in the status, once in a notice, with reasons") {
  PipelineConfig config = without_recording();
  config.mapping.mapper.step_verification.minimum_overlap = 1;  // no match is believed
  const Judged outcome = judged(config);
  CHECK(outcome.status.health.verdict == MapVerdict::bad);
  CHECK(outcome.status.health.on_odometry >= 4);
  CHECK(outcome.line.find(std::string("| MAP BAD: ") + to_string(outcome.status.health.doubt) + ", ") !=
        std::string::npos);
  CHECK(outcome.line.find(" steps on odometry |") != std::string::npos);
  CHECK(outcome.notices.has("mapper: the map is bad: too many steps stand on odometry alone; steps"));
  CHECK(std::ranges::count(outcome.notices.lines,
                           "mapper: the map is bad: too many steps stand on odometry alone; steps") == 1);
}

TEST_CASE("without odometry, where nothing fits, a map falls into parts, and that is told") {
  PipelineConfig config = without_recording();
  config.scanner.has_odometry = false;
  config.mapping.mapper.step_verification.minimum_overlap = 1;
  const Judged outcome = judged(config);
  CHECK(outcome.status.health.verdict == MapVerdict::bad);
  CHECK(outcome.status.health.parts >= 4);
  CHECK(outcome.line.find("| MAP BAD: it is in parts that no loop joins, ") != std::string::npos);
  CHECK(outcome.line.find(" parts |") != std::string::npos);
  CHECK(outcome.notices.has("mapper: a new part of the map begins"));
  CHECK(outcome.notices.has("mapper: the map is bad until loops join its parts"));
}

TEST_CASE("scans that wait when mapping is abandoned are answered for as dropped") {
  const RecordedDrive& drive = recorded_drive();
  NoWires wires;
  MemorySink sink;
  Pipeline pipeline(config_of(small_vehicle()), {.ports = {&wires, {&wires, &wires}}, .recording = &sink});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feeder.maps = false;
  feed(drive.recorded.events, feeder);
  pipeline.abandon_mapping();
  REQUIRE(end_drive(pipeline));
  CHECK(pipeline.counters().scans_mapped == 0);
  CHECK(pipeline.counters().scans_left == 3);
  std::size_t left = 0;
  for (const Recorded::KeptScan& kept : read_back(sink.bytes).scans)
    left += kept.verdict == "dropped: told to stop" ? 1U : 0U;
  CHECK(left == 3);
}

TEST_CASE("incomplete scans are mapped when the configuration says so") {
  const RecordedDrive& drive = recorded_drive();
  REQUIRE(drive.counters.scans_incomplete > 0);
  NoWires wires;
  PipelineConfig config = config_of(small_vehicle());
  config.records = false;
  config.maps_incomplete_scans = true;
  Pipeline pipeline(config, {.ports = {&wires, {&wires, &wires}}});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feed(drive.recorded.events, feeder);
  REQUIRE(end_drive(pipeline));
  CHECK(pipeline.counters().scans_incomplete == 0);
  CHECK(pipeline.counters().scans_mapped + pipeline.counters().scans_refused == pipeline.counters().scans);
}

TEST_CASE("without mapping everything is recorded, and scans are marked so that a replay maps them") {
  const RecordedDrive& drive = recorded_drive();
  NoWires wires;
  MemorySink sink;
  PipelineConfig config = config_of(small_vehicle());
  config.maps = false;
  CHECK(Pipeline::memory_required(config).mapper_bytes == 0);
  Pipeline pipeline(config, {.ports = {&wires, {&wires, &wires}}, .recording = &sink});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feed(drive.recorded.events, feeder);
  REQUIRE(end_drive(pipeline));
  const Recorded recorded = read_back(sink.bytes);
  CHECK(recorded.events.size() == drive.recorded.events.size());
  REQUIRE(recorded.scans.size() == drive.counters.scans);
  for (const Recorded::KeptScan& kept : recorded.scans) {
    CHECK_FALSE(kept.scan.was_mapped);
    CHECK(kept.verdict.substr(0, 7) != "dropped");
  }
}

TEST_CASE("a full map ends, is told once, and recording goes on") {
  const RecordedDrive& drive = recorded_drive();
  NoWires wires;
  MemorySink sink;
  NoticeList notices;
  PipelineConfig config = config_of(small_vehicle());
  config.mapping.mapper.scan_capacity = 3;
  Pipeline pipeline(config, {.ports = {&wires, {&wires, &wires}}, .recording = &sink, .listener = &notices});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feed(drive.recorded.events, feeder);
  CHECK(pipeline.status().is_map_full);
  REQUIRE(end_drive(pipeline));
  CHECK(pipeline.counters().scans_mapped == 3);
  CHECK(poses_of(pipeline).size() == 3);
  CHECK(std::count_if(notices.lines.begin(), notices.lines.end(), [](const std::string& line) {
          return line.find("the map is full") != std::string::npos;
        }) == 1);
  const Recorded recorded = read_back(sink.bytes);
  CHECK(recorded.events.size() == drive.recorded.events.size());
  CHECK(recorded.scans.back().verdict.substr(0, 7) != "dropped");
}

TEST_CASE("a disk that takes nothing does not touch the map, is told, and is no whole recording") {
  const RecordedDrive& drive = recorded_drive();
  NoWires wires;
  MemorySink sink;
  sink.refuses = true;
  NoticeList notices;
  Pipeline pipeline(config_of(small_vehicle()),
                    {.ports = {&wires, {&wires, &wires}}, .recording = &sink, .listener = &notices});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feed(drive.recorded.events, feeder);
  CHECK(pipeline.status().is_recording_stalled);
  CHECK_FALSE(end_drive(pipeline));
  CHECK(notices.has("the recording cannot be written"));
  CHECK(are_same_bits(poses_of(pipeline), drive.poses));
}

TEST_CASE("a recording ends at its limit with a whole file, is told, and mapping goes on") {
  const RecordedDrive& drive = recorded_drive();
  NoWires wires;
  MemorySink sink;
  NoticeList notices;
  PipelineConfig config = config_of(small_vehicle());
  config.recording.chunk_bytes = 64 * 1024;
  config.recording_limit_bytes = 1'000'000;
  // clouds are larger than such a chunk, and counted as too large
  Pipeline pipeline(config, {.ports = {&wires, {&wires, &wires}}, .recording = &sink, .listener = &notices});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feed(drive.recorded.events, feeder);
  REQUIRE(end_drive(pipeline));
  CHECK(notices.has("has reached its limit"));
  CHECK_FALSE(pipeline.status().is_recording);
  const Recorded recorded = read_back(sink.bytes);
  CHECK(recorded.is_whole);
  CHECK(sink.bytes.size() < 1'200'000);
  CHECK(recorded.events.size() > 100);
  CHECK(recorded.events.size() < drive.recorded.events.size());
  CHECK(are_same_bits(poses_of(pipeline), drive.poses));
}

TEST_CASE("a scan that fills more cells than there are is downsampled, and told at the first") {
  const RecordedDrive& drive = recorded_drive();
  NoWires wires;
  NoticeList notices;
  PipelineConfig config = config_of(small_vehicle());
  config.records = false;
  config.mapping.mapper.voxel.cell_capacity = 1024;
  Pipeline pipeline(config, {.ports = {&wires, {&wires, &wires}}, .listener = &notices});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  feed(drive.recorded.events, feeder);
  REQUIRE(end_drive(pipeline));
  CHECK(pipeline.counters().scans_thinned > 3);
  CHECK(notices.has(
      "mapper: a scan has more cells than voxel.cell_capacity and is downsampled coarser; its cell in mm"));
}

TEST_CASE(
    "a source that raises thousands of notices is held back in recording and journal, and others are heard") {
  NoWires wires;
  MemorySink sink;
  NoticeList notices;
  Pipeline pipeline(config_of(small_vehicle()),
                    {.ports = {&wires, {&wires, &wires}}, .recording = &sink, .listener = &notices});
  for (int i = 0; i < 7000; ++i) {
    pipeline.raise(
        {ns_per_s + i * 142'857, Severity::warning, "motor", i % 2 == 0 ? "one thing" : "another", i, true});
  }
  pipeline.raise({2 * ns_per_s, Severity::warning, "gps", "no usable fix comes", 0, false});
  pipeline.raise({5 * ns_per_s, Severity::warning, "motor", "one thing more", 0, false});
  CHECK(pipeline.counters().notices_held_back > 6900);
  CHECK(notices.lines.size() < 60);
  CHECK(notices.has("gps: no usable fix comes"));
  CHECK(notices.has("motor: raises so many notices that most are held back; since the last"));
  CHECK(notices.has("motor: one thing more"));
  REQUIRE(end_drive(pipeline));
  CHECK(read_back(sink.bytes).diagnostics.size() < 100);
}

TEST_CASE("notices are recorded as diagnostics, and counters at the end") {
  const RecordedDrive& drive = recorded_drive();
  CHECK(std::count(drive.recorded.diagnostics.begin(), drive.recorded.diagnostics.end(),
                   "pipeline: counters") >= 1);
  CHECK(std::count(drive.recorded.diagnostics.begin(), drive.recorded.diagnostics.end(), "motor: counters") >=
        1);
  CHECK(drive.recorded.diagnostics.size() > drive.notices.lines.size());
  CHECK(drive.notices.has("scanner: "));
}

TEST_CASE("events after the end change nothing and are counted") {
  const RecordedDrive& drive = recorded_drive();
  NoWires wires;
  MemorySink sink;
  Pipeline pipeline(config_of(small_vehicle()), {.ports = {&wires, {&wires, &wires}}, .recording = &sink});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  pipeline.end_events();
  feed(drive.recorded.events, feeder);
  CHECK(pipeline.counters().events_after_end == drive.recorded.events.size());
  CHECK(pipeline.counters().scans == 0);
  CHECK(end_drive(pipeline));
}

TEST_CASE("a configuration that cannot be is refused with a reason and the right exit status") {
  NoWires wires;
  PipelineConfig config = config_of(small_vehicle());
  config.records = false;
  const auto make = [&] { Pipeline pipeline(config, {.ports = {&wires, {&wires, &wires}}}); };
  SECTION("no slot") {
    config.mapping.scan_slots = 0;
  }
  SECTION("a scanner without lasers") {
    config.scanner.assembler.laser_count = 0;
  }
  SECTION("a mapper without a cache") {
    config.mapping.mapper.cache_slots = 0;
  }
  try {
    make();
    FAIL("it was made");
  } catch (const Error& error) {
    CHECK(error.exit_status() == ExitStatus::configuration);
    CHECK(std::string(error.what()).size() > 20);
  }
}
