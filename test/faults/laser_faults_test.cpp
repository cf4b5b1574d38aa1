// The lasers and their lines.
#include <catch2/catch.hpp>

#include "fault_table.h"

namespace alces {
namespace {

using sim::Fault;
using enum ScannerPart;
constexpr unsigned others = FaultBench::drive | FaultBench::index | FaultBench::odometry | FaultBench::gps;

TEST_CASE("fault: laser garbage") {
  FaultBench bench("laser garbage");
  bench.suffer(Fault::laser_garbage, 5);
  bench.is_told("laser a", "no measured values come; bringing the laser up again");
  bench.is_counted(laser_a, "bytes_skipped", 5000);
  bench.goes_on(others);
  bench.is_whole_again(8);
  bench.all_is_well();
}

TEST_CASE("fault: CRC errors") {
  FaultBench bench("CRC errors");
  bench.suffer(Fault::laser_crc_errors, 6);
  bench.nobody_is_told();
  bench.is_counted(laser_a, "crc_errors", 30);
  bench.is_counted(assembler, "profiles_missing", 30);
  bench.goes_on(others);
  bench.scans_go_on();
  bench.all_is_well();
}

TEST_CASE("fault: wrong baud rate") {
  FaultBench bench("wrong baud rate");
  bench.suffer(Fault::laser_wrong_baud, 3, 38400 << 8);
  bench.is_told("laser a", "no measured values come; bringing the laser up again");
  bench.is_counted(laser_a, "baud_rate_searches");
  bench.goes_on(others);
  bench.is_whole_again(4);
  bench.is_told("laser a", "measuring; baud rate");
  bench.all_is_well();
}

TEST_CASE("fault: half a telegram") {
  FaultBench bench("half a telegram");
  bench.suffer(Fault::laser_half_telegram, 6, 186 << 8);
  bench.nobody_is_told();
  bench.is_counted(laser_a, "bytes_skipped", 180);
  bench.is_counted(assembler, "profiles_missing");
  bench.goes_on(others);
  bench.scans_go_on();
  bench.all_is_well();
}

TEST_CASE("fault: laser unplugged and back") {
  FaultBench bench("laser unplugged and back");
  bench.suffer(Fault::laser_unplugged, 4);
  bench.is_told("laser a", "the serial line went down");
  bench.goes_on(others);
  bench.is_whole_again(4);
  bench.is_told("laser a", "the serial line is up");
  bench.all_is_well();
}

TEST_CASE("fault: laser reset") {
  FaultBench bench("laser reset");
  bench.suffer(Fault::laser_reset, 3);
  bench.is_told("laser a", "no measured values come; bringing the laser up again");
  bench.is_counted(laser_a, "silences");
  bench.goes_on(others);
  bench.is_whole_again(4);
  bench.all_is_well();
}

TEST_CASE("fault: laser switched off for long") {
  FaultBench bench("laser switched off for long");
  bench.harness.simulated().laser(0).switch_off();
  bench.endure(20);
  bench.is_told("laser a", "no answer at any baud rate: is the laser powered and connected?");
  CHECK(bench.harness.times_told("laser a", "no answer at any baud rate") == 1);  // once an outage
  bench.goes_on(others);
  bench.harness.simulated().laser(0).switch_on(bench.harness.now_ns());
  bench.is_whole_again(14);
  bench.all_is_well();
}

TEST_CASE("fault: laser silent while only listened to") {
  HarnessSettings settings = harness_settings();
  settings.simulated.lasers[0].is_streaming = true;
  settings.scanner.lms2xx[0].is_listen_only = true;
  FaultBench bench("laser silent while only listened to", settings);
  bench.harness.simulated().laser(0).set_connected(false);
  bench.endure(12);
  bench.is_told("scanner", "a laser measures but delivers nothing; it is begun anew");
  bench.is_counted(scanner, "laser_restarts", 2);
  bench.goes_on(others);
  bench.harness.simulated().laser(0).set_connected(true);
  bench.is_whole_again(4);
  bench.all_is_well();
}

TEST_CASE("fault: one of two lasers lost") {
  FaultBench bench("one of two lasers lost", harness_settings(2));
  bench.suffer(Fault::laser_unplugged, 6, 1);
  bench.is_told("laser b", "the serial line went down");
  bench.is_told("assembler", "a scan is incomplete; profiles in it");
  bench.goes_on(others);
  CHECK(bench.harness.incomplete_scans() >= 3);  // and yet they come, marked
  bench.is_whole_again(5);
  bench.all_is_well();
}

TEST_CASE("fault: both lasers lost") {
  FaultBench bench("both lasers lost", harness_settings(2));
  bench.harness.inject(Fault::laser_unplugged, 6, 0);
  bench.suffer(Fault::laser_unplugged, 6, 1);
  bench.is_told("laser a", "the serial line went down");
  bench.is_told("laser b", "the serial line went down");
  bench.goes_on(others);
  bench.is_whole_again(5);
  bench.all_is_well();
}

}  // namespace
}  // namespace alces
