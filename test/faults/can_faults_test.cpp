// The CAN bus and its frames.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

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
  bench.scans_go_on();
  bench.all_is_well();
}

TEST_CASE("fault: PDOs delayed") {
  FaultBench bench("PDOs delayed");
  bench.suffer(Fault::pdo_delayed, 6);
  bench.nobody_is_told();
  bench.is_counted(motor, "pdos_missed");
  bench.goes_on(FaultBench::all);
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
  bench.scans_go_on();
  bench.all_is_well();
}

}  // namespace
}  // namespace alces
