// Odometry, GPS, the clock, the disk.
#include <array>
#include <catch2/catch.hpp>

#include "fault_table.h"

namespace alces {
namespace {

using sim::Fault;
using enum ScannerPart;
constexpr unsigned others = FaultBench::drive | FaultBench::index | FaultBench::laser;

TEST_CASE("fault: odometry frozen") {
  FaultBench bench("odometry frozen");
  bench.suffer(Fault::odometry_frozen, 5);
  bench.is_told("odometry", "the sender's alive counter stands still");
  bench.is_told("assembler", "no odometry: scans are made as if the vehicle stood");
  bench.is_counted(odometry, "freezes");
  bench.is_counted(assembler, "scans_without_odometry", 2);
  bench.goes_on(others | FaultBench::gps);
  bench.scans_go_on();
  bench.is_whole_again(4);
  bench.is_told("odometry", "frames come again; the pose goes on from where it was");
  CHECK(bench.harness.scans.back().has_odometry);
  bench.all_is_well();
}

TEST_CASE("fault: odometry silent") {
  FaultBench bench("odometry silent");
  bench.suffer(Fault::odometry_silent, 5);
  bench.is_told("odometry", "no believable odometry frames any more");
  bench.is_counted(odometry, "gaps");
  bench.goes_on(others | FaultBench::gps);
  bench.scans_go_on();
  bench.is_whole_again(4);
  CHECK(bench.harness.times_told("odometry", "the sender's alive counter stands still") == 0);
  bench.all_is_well();
}

TEST_CASE("fault: odometry jump") {
  FaultBench bench("odometry jump");
  const Pose before = bench.harness.scans.back().odometry_from_body;
  bench.suffer(Fault::odometry_jump, 6);
  bench.is_told("odometry", "a speed or rate beyond what the vehicle can do was not believed");
  bench.is_counted(odometry, "values_implausible");
  bench.goes_on(FaultBench::all);
  bench.scans_go_on();
  const Pose after = bench.harness.scans.back().odometry_from_body;
  CHECK((after.translation_m - before.translation_m).norm() < 20);  // 7 s at 1.1 m/s, and not 30 m/s
  bench.all_is_well();
}

TEST_CASE("fault: clock set back by 30 s") {
  FaultBench bench("clock set back by 30 s");
  bench.harness.stamp_offset_ns = -30 * ns_per_s;
  bench.endure(1);
  bench.is_told("scanner", "the clock was set back; scans begin anew");
  bench.is_counted(scanner, "time_went_back");
  bench.is_counted(motor, "clock_steps");
  bench.is_whole_again(5);
  CHECK(bench.harness.counter(motor, "motor_failures") == 0);  // the motor turns on
  CHECK(bench.harness.counter(assembler, "profiles_absurd") == 0);
  CHECK(bench.harness.counter(laser_a, "mirror_turns_missed") == 0);
  const ScannerHarness::Delivery before = bench.harness.delivery();
  bench.harness.run_s(5);
  CHECK(bench.harness.delivery().fixes - before.fixes >= 4);
  bench.all_is_well();
}

TEST_CASE("fault: clock set forward by 30 s") {
  FaultBench bench("clock set forward by 30 s");
  bench.harness.stamp_offset_ns = 30 * ns_per_s;
  bench.endure(1);
  bench.is_told("motor", "the drive's position no longer comes");
  bench.is_told("laser a", "no measured values come; bringing the laser up again");
  bench.is_whole_again(8);
  bench.all_is_well();
}

TEST_CASE("fault: an event at a time that cannot be") {
  FaultBench bench("an event at a time that cannot be");
  bench.endure(0.1);
  const std::array<std::int64_t, 4> stamps_ns{INT64_MIN, -1, INT64_MAX / 4 + 1, INT64_MAX};
  constexpr int kinds = static_cast<int>(EventKind::stop) + 1;
  std::uint64_t absurd = 0;
  for (int kind = 0; kind < kinds; ++kind) {
    for (const std::int64_t stamp_ns : stamps_ns) {
      Event event;
      event.kind = static_cast<EventKind>(kind);
      event.stamp_ns = stamp_ns;
      event.is_up = false;
      event.frame.id = 0x181;  // the drive's position
      event.frame.size = 8;
      bench.harness.on_event(event);
      ++absurd;
    }
  }
  bench.is_told("scanner", "an event has a time that cannot be, and is left out; so far");
  bench.is_counted(scanner, "stamps_absurd", absurd);
  bench.endure(6);
  bench.goes_on(FaultBench::all);
  bench.scans_go_on();
  bench.all_is_well();
}

TEST_CASE("fault: wheels that say that they stand") {
  FaultBench bench("wheels that say that they stand");
  bench.suffer(Fault::odometry_frozen, 25, 2);
  bench.is_told("odometry", "the wheels say that they stand though the gyro turns: are their sensors dead?");
  bench.is_counted(odometry, "freezes");
  bench.goes_on(others | FaultBench::gps);
  bench.scans_go_on();
  bench.is_whole_again(4);
  CHECK(bench.harness.scans.back().has_odometry);
  bench.all_is_well();
}

TEST_CASE("fault: GPS absurd") {
  FaultBench bench("GPS absurd");
  bench.suffer(Fault::gps_absurd, 6);
  bench.is_told("gps", "a position that cannot be reached is not believed");
  bench.is_counted(gps, "jumps", 5);
  bench.goes_on(others | FaultBench::odometry);
  bench.scans_go_on();
  for (const ScannerHarness::ScanSeen& scan : bench.harness.scans) CHECK(scan.gps_position_m.norm() < 1000);
  bench.is_whole_again(4);
  CHECK(bench.harness.scans.back().has_gps);
  bench.all_is_well();
}

TEST_CASE("fault: GPS silent") {
  FaultBench bench("GPS silent");
  bench.suffer(Fault::gps_silent, 13);
  bench.is_told("gps", "no usable fix comes");
  bench.goes_on(others | FaultBench::odometry);
  bench.scans_go_on();
  CHECK_FALSE(bench.harness.scans.back().has_gps);
  bench.is_whole_again(5);
  bench.is_told("gps", "fixes come again");
  CHECK(bench.harness.scans.back().has_gps);
  bench.all_is_well();
}

TEST_CASE("fault: disk full") {
  FaultBench bench("disk full");
  const std::uint64_t before = bench.harness.recording().file_counters().messages_written;
  bench.harness.disk.is_full = true;
  bench.endure(6);
  bench.is_told("recording", "the recording cannot be written; make room on its disk");
  bench.goes_on(FaultBench::all);
  bench.scans_go_on();
  bench.harness.disk.is_full = false;
  bench.is_whole_again(4);
  bench.is_told("recording", "the recording goes on; messages lost meanwhile");
  CHECK_FALSE(bench.harness.recording().is_stalled());
  CHECK(bench.harness.account() == "");  // written and lost are all there were
  const mcap::Writer::Counters& file = bench.harness.recording().file_counters();
  CHECK(file.messages_lost > 0);
  CHECK(file.messages_written > before);
  CHECK(bench.harness.scanner().motor().state() == MotorState::running);
}

}  // namespace
}  // namespace alces
