#include "alces_onboard/status_report.h"

#include <array>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "alces_onboard/console.h"
#include "onboard/vehicle_bench.h"

using namespace alces;
using namespace alces::onboard;
using Catch::Matchers::Contains;

namespace {

StatusReport full_report() {
  StatusReport report;
  report.phase = "scanning";
  report.scans_per_s = 0.8333;
  report.scans_dropped = 2;
  report.is_mapping = true;
  report.scans_mapped = 412;
  report.scan_capacity = 1000;
  report.has_pose = true;
  report.map_from_body.translation_m = {12.34, -4.5, 0.1};
  report.map_from_body.rotation = Eigen::AngleAxisd(1.5707963, Eigen::Vector3d::UnitZ());
  report.loops_closed = 5;
  report.has_loop = true;
  report.last_loop.first = 17;
  report.last_loop.last = 402;
  report.last_loop.verdict = LoopVerdict::closed;
  report.last_loop.correction_m = 0.34;
  report.waiting_scans = 1;
  report.scan_slots = 4;
  report.pool_used_bytes = 12'300'000;
  report.pool_bytes = 33'100'000;
  report.bus = {"can0", "error-active", 1000, 3};
  report.frames_per_s = 1240;
  report.is_recording = true;
  report.recording_bytes = 153'200'000;
  return report;
}

std::string line_of(const StatusReport& report) {
  std::array<char, 512> room{};
  return std::string(format(report, room));
}

std::string text_of(const MemorySink& sink) {
  return {sink.bytes.begin(), sink.bytes.end()};
}

}  // namespace

TEST_CASE("the status line has rate, pose, last loop, queue, drops, memory, bus and recording") {
  CHECK(line_of(full_report()) ==
        "scanning: 0.83 scans/s, 412 of 1000 mapped | at 12.3 -4.5 0.1 m, 90 deg | 5 loops, last 17-402 "
        "moved 0.34 m | map good | "
        "queue 1/4, 2 dropped | pool 12.3 of 33.1 MB | can0 error-active 1240 frames/s, 3 errors | recorded "
        "153.2 MB");
}

TEST_CASE("the status line says what is wrong") {
  StatusReport report = full_report();
  report.reason = "no heartbeat";
  report.is_map_full = true;
  report.is_recording_stalled = true;
  report.last_loop.verdict = LoopVerdict::refused_overlap;
  CHECK_THAT(line_of(report), Contains("scanning (no heartbeat)") && Contains("MAP FULL") &&
                                  Contains("RECORDING STALLED") && Contains("17-402 refused"));
  report.health.verdict = MapVerdict::doubtful;
  report.health.doubt = MapDoubt::drift;
  CHECK_THAT(line_of(report),
             Contains(" | map doubtful: its steps can be off by more than a map may | queue"));
  report.health.verdict = MapVerdict::bad;
  report.health.doubt = MapDoubt::parts;
  report.health.parts = 3;
  report.health.on_odometry = 12;
  CHECK_THAT(
      line_of(report),
      Contains(" | MAP BAD: it is in parts that no loop joins, 3 parts, 12 steps on odometry | queue"));
  report.is_mapping = false;
  report.is_recording = report.is_recording_stalled = false;
  report.bus = {};
  CHECK_THAT(line_of(report), Contains("not mapping") && Contains("not recording") && !Contains("frames/s"));
}

TEST_CASE("a status line is cut to the room it has") {
  std::array<char, 20> room{};
  CHECK(format(full_report(), room) == "scanning: 0.83 scan");
  CHECK(format(full_report(), {}).empty());
}

TEST_CASE("a pipeline's status tells its rate, its pose and its recording") {
  const RecordedDrive& drive = recorded_drive();
  NoWires wires;
  MemorySink sink;
  Pipeline pipeline(config_of(small_vehicle()), {.ports = {&wires, {&wires, &wires}}, .recording = &sink});
  pipeline.start_scanner();
  CHECK(pipeline.status().scans_per_s == 0);
  CHECK_FALSE(pipeline.status().has_pose);
  Feeder feeder(pipeline);
  feed(drive.recorded.events, feeder);
  const StatusReport report = pipeline.status();
  CHECK(std::string(report.phase) == "scanning");
  CHECK(report.scans_per_s == Approx(1 / 1.2).epsilon(0.05));
  CHECK(report.has_pose);
  CHECK(report.scans_mapped == drive.counters.scans_mapped);
  CHECK(report.map_from_body.translation_m == drive.poses.back().translation_m);
  CHECK(report.pool_used_bytes > 0);
  CHECK(report.recording_bytes > 1'000'000);

  Event tick;
  tick.stamp_ns = drive.recorded.events.back().event.stamp_ns + 60 * ns_per_s;
  pipeline.on_event(tick);  // no scan for a minute
  CHECK(pipeline.status().scans_per_s == 0);
}

TEST_CASE("on a terminal the status is one line that is refreshed, and notices come above it") {
  MemorySink sink;
  Console console({.is_terminal = true, .columns = 12, .begin_ns = 0}, sink);
  console.show_status("status that is longer", ns_per_s);
  console.show_status("short", 2 * ns_per_s);
  console.raise({2'500'000'000, Severity::warning, "motor", "heartbeat lost", 7, true});
  console.show_status("again", 3 * ns_per_s);
  console.end();
  CHECK(text_of(sink) ==
        "\r\033[Kstatus that\r\033[Kshort\r\033[K[    2.500] warning: motor: heartbeat lost "
        "(7)\n\r\033[Kagain\n");
}

TEST_CASE("elsewhere the status is a line every ten seconds, and under systemd lines carry a priority") {
  MemorySink sink;
  Console console({.begin_ns = ns_per_s}, sink);
  for (int second = 1; second <= 12; ++second) console.show_status("fine", second * ns_per_s);
  CHECK(text_of(sink) == "[    0.000] fine\n[   10.000] fine\n");

  MemorySink journal;
  Console journalled({.has_journal = true}, journal);
  journalled.raise({0, Severity::error, "can0", "bus off"});
  journalled.show_status("fine", 0);
  CHECK(text_of(journal) == "<3>error: can0: bus off\n<6>fine\n");
}

TEST_CASE("lines that cannot be written are counted") {
  MemorySink sink;
  sink.refuses = true;
  Console console({}, sink);
  console.raise({});
  console.show_status("fine", 0);
  CHECK(console.lines_lost() == 2);
}
