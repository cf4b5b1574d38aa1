// The CAN bus and its frames.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "fault_table.h"

namespace alces {
namespace {

using sim::Fault;
using enum ScannerPart;

TEST_CASE("fault: bus-off") {
  FaultBench bench("bus-off");
  bench.suffer(Fault::bus_off, 3);
  bench.is_told("motor", "the CAN bus is down");
  bench.is_told("odometry", "no believable odometry frames any more");
  bench.is_counted(motor, "link_downs");
  bench.goes_on(FaultBench::laser | FaultBench::gps);
  bench.is_whole_again(8);
  bench.is_told("motor", "the CAN bus is up");
  bench.all_is_well();
}

TEST_CASE("fault: error-passive flood") {
  FaultBench bench("error-passive flood");
  bench.suffer(Fault::error_passive_flood, 6, 300);
  bench.nobody_is_told();
  bench.is_counted(motor, "error_frames", 1500);
  bench.goes_on(FaultBench::all);
  bench.angle_is_true("0.05");
  bench.scans_go_on();
  bench.all_is_well();
}

TEST_CASE("fault: error frames that fill the bus") {
  FaultBench bench("error frames that fill the bus");
  bench.suffer(Fault::error_passive_flood, 6, 1000);
  bench.is_told("motor", "the drive's position no longer comes");
  bench.is_told("motor", "the bus takes no frames");
  bench.is_counted(motor, "error_frames", 5000);
  bench.goes_on(FaultBench::laser | FaultBench::gps);
  bench.is_whole_again(8);
  bench.all_is_well();
}

TEST_CASE("fault: PDOs lost, three of ten") {
  FaultBench bench("PDOs lost, three of ten");
  bench.suffer(Fault::pdo_lost, 6, 300);
  bench.nobody_is_told();
  bench.is_counted(motor, "pdos_missed", 200);
  bench.goes_on(FaultBench::all & ~FaultBench::drive);
  bench.angle_is_true("0.05");
  bench.scans_go_on();
  bench.all_is_well();
}

TEST_CASE("fault: PDOs lost, all") {
  FaultBench bench("PDOs lost, all");
  bench.suffer(Fault::pdo_lost, 5);
  bench.is_told("motor", "the drive's position no longer comes");
  bench.is_told("motor", "the drive sends no statusword: check its TPDO configuration");
  bench.goes_on(FaultBench::laser | FaultBench::odometry | FaultBench::gps);
  bench.is_whole_again(10);
  bench.all_is_well();
}

TEST_CASE("fault: PDOs duplicated") {
  FaultBench bench("PDOs duplicated");
  bench.suffer(Fault::pdo_duplicated, 6);
  bench.nobody_is_told();
  bench.is_counted(motor, "pdos_repeated", 1000);
  bench.goes_on(FaultBench::all);
  bench.angle_is_true("0.05");
  bench.scans_go_on();
  bench.all_is_well();
}

TEST_CASE("fault: PDOs delayed") {
  FaultBench bench("PDOs delayed");
  bench.suffer(Fault::pdo_delayed, 6);
  bench.nobody_is_told();
  bench.is_counted(motor, "pdos_missed");
  bench.goes_on(FaultBench::all);
  bench.angle_is_true("1.6");
  bench.scans_go_on();
  const std::int64_t stamp_ns = bench.harness.now_ns() - ns_per_s;
  const double true_rad =
      1 + 2 * std::numbers::pi * bench.harness.simulated().drive().head_turns_at(stamp_ns);
  const AngleAnswer answer = bench.harness.scanner().encoder().angle_at(stamp_ns);
  CHECK(answer.status == AngleStatus::ok);
  CHECK(std::abs(std::remainder(answer.angle_rad - true_rad, 2 * std::numbers::pi)) < 2e-3);
  bench.all_is_well();
}

TEST_CASE("fault: PDOs reordered") {
  FaultBench bench("PDOs reordered");
  bench.suffer(Fault::pdo_reordered, 6);
  bench.nobody_is_told();
  bench.goes_on(FaultBench::all);
  bench.angle_is_true("0.05");
  bench.scans_go_on();
  bench.all_is_well();
}

TEST_CASE("fault: other nodes' traffic at 90 % load") {
  FaultBench bench("other nodes' traffic at 90 % load");
  bench.suffer(Fault::bus_load, 6);
  bench.nobody_is_told();
  bench.is_counted(motor, "frames_foreign", 10000);
  bench.is_counted(motor, "frames_not_canopen", 1000);
  bench.goes_on(FaultBench::all);
  bench.angle_is_true("0.05");
  bench.scans_go_on();
  bench.all_is_well();
}

/// How far the encoder's angle is from the shaft's at most, in degrees, at 90 % load.
double worst_under_load_deg(const HarnessSettings& settings) {
  ScannerHarness harness(settings);
  REQUIRE(harness.bring_up());
  harness.run_s(7);
  harness.inject(Fault::bus_load, 6);
  double worst_rad = 0;
  for (int i = 0; i < 580; ++i) {
    harness.run_s(0.01);
    const std::int64_t stamp_ns = harness.now_ns() - 200 * ns_per_ms;
    const AngleAnswer answer = harness.scanner().encoder().angle_at(stamp_ns);
    REQUIRE(answer.status == AngleStatus::ok);
    const double true_rad = settings.simulated.first_head_angle_rad +
                            2 * std::numbers::pi * harness.simulated().drive().head_turns_at(stamp_ns);
    worst_rad =
        std::max(worst_rad, std::abs(std::remainder(answer.angle_rad - true_rad, 2 * std::numbers::pi)));
  }
  return worst_rad * 180 / std::numbers::pi;
}

TEST_CASE("SYNC's time is when it left: a bus or a host that makes it wait does not turn the head's angle") {
  HarnessSettings settings = harness_settings();
  SECTION("a bus at 90 % load") {}
  SECTION("a host that takes its time, as well") {
    settings.simulated.rig.tick_late_us = 300;
    settings.simulated.rig.can.queue_us = 500;
  }
  const double with_echo_deg = worst_under_load_deg(settings);
  settings.simulated.rig.can.echoes_sync = false;
  const double without_echo_deg = worst_under_load_deg(settings);
  INFO("off by " << with_echo_deg << " deg with, " << without_echo_deg << " deg without an echo");
  CHECK(with_echo_deg < 0.05);
  CHECK(without_echo_deg > 1.5 * with_echo_deg);  // what the echo is for
}

TEST_CASE("an interface that does not echo is told of, once, and its SYNC has the queue's time") {
  HarnessSettings settings = harness_settings();
  settings.simulated.rig.can.echoes_sync = false;
  ScannerHarness harness(settings);
  REQUIRE(harness.bring_up());
  harness.run_s(10);
  CHECK(harness.times_told("motor", "the interface does not echo SYNC") == 1);
  settings.simulated.rig.can.echoes_sync = true;
  ScannerHarness echoing(settings);
  REQUIRE(echoing.bring_up());
  CHECK(echoing.times_told("motor", "the interface does not echo SYNC") == 0);
}

TEST_CASE("a SYNC period that is no multiple of the ticks is kept") {
  for (const std::int64_t period_ms : {4, 15}) {
    INFO(period_ms << " ms");
    HarnessSettings settings = harness_settings();
    settings.scanner.motor.sync.period_ns = period_ms * ns_per_ms;
    ScannerHarness harness(settings);
    std::vector<std::int64_t> left_ns;
    harness.also = [&](const Event& event) {
      if (event.kind == EventKind::sync_sent) left_ns.push_back(event.stamp_ns);
    };
    REQUIRE(harness.bring_up());
    left_ns.clear();
    harness.run_s(3);
    REQUIRE(left_ns.size() + 2 >= static_cast<std::size_t>(3000 / period_ms));
    std::int64_t worst_ns = 0;
    for (std::size_t i = 1; i < left_ns.size(); ++i)
      worst_ns = std::max(worst_ns, std::abs(left_ns[i] - left_ns[i - 1] - period_ms * ns_per_ms));
    CHECK(worst_ns < 2 * ns_per_ms);  // a frame of others on the wire, and the simulation's steps
    CHECK(harness.scanner().motor().counters().sync.skipped == 0);
  }
}

}  // namespace
}  // namespace alces
