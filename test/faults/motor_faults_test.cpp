// The drive and its node on the bus.
#include <catch2/catch.hpp>

#include "fault_table.h"

namespace alces {
namespace {

using sim::Fault;
using enum ScannerPart;
constexpr unsigned others = FaultBench::laser | FaultBench::odometry | FaultBench::gps;

TEST_CASE("fault: node absent") {
  FaultBench bench("node absent");
  bench.suffer(Fault::node_absent, 6);
  bench.is_told("motor", "the drive's position no longer comes");
  bench.is_told("motor", "the drive does not answer: check its supply, wiring, bit rate and node number");
  bench.goes_on(others);
  bench.is_whole_again(8);
  bench.all_is_well();
}

TEST_CASE("fault: late boot-up") {
  FaultBench bench("late boot-up");
  bench.suffer(Fault::late_boot_up, 7);
  bench.is_told("motor", "waits for the drive's boot-up message");
  bench.goes_on(others);
  bench.is_whole_again(10);
  bench.all_is_well();
}

TEST_CASE("fault: node reset in mid-drive") {
  FaultBench bench("node reset in mid-drive");
  bench.harness.simulated().drive().set_boot_ns(100 * ns_per_ms);
  bench.suffer(Fault::node_reset, 1);
  bench.is_told("motor", "the drive started anew by itself: check its supply");
  bench.is_told("encoder", "the drive's position jumped (was it reset?); waiting for the next index pulse");
  bench.is_counted(motor, "node_resets");
  bench.goes_on(others);
  bench.is_whole_again(6);
  bench.all_is_well();
}

TEST_CASE("fault: heartbeat lost") {
  FaultBench bench("heartbeat lost");
  bench.suffer(Fault::heartbeat_lost, 3);
  bench.is_told("motor", "the drive's heartbeat is lost");
  bench.is_counted(motor, "heartbeat_losses");
  bench.goes_on(others);
  bench.is_whole_again(8);
  bench.all_is_well();
}

TEST_CASE("fault: EMCY without a fault") {
  FaultBench bench("EMCY without a fault");
  bench.suffer(Fault::emergency, 6);
  bench.is_told("motor", "CAN overrun, objects lost");
  bench.is_counted(motor, "emcys");
  bench.goes_on(FaultBench::all);
  bench.scans_go_on();
  bench.all_is_well();
}

TEST_CASE("fault: SDO abort") {
  FaultBench bench("SDO abort");
  bench.harness.inject(Fault::sdo_abort, 4);
  bench.suffer(Fault::node_reset, 5);
  bench.is_told("motor", "the drive refused an object");
  bench.is_told("motor", "general error");
  bench.is_counted(motor, "sdo_aborts_received");
  bench.goes_on(others);
  bench.is_whole_again(10);
  bench.all_is_well();
}

TEST_CASE("fault: SDO time-out") {
  FaultBench bench("SDO time-out");
  bench.harness.inject(Fault::sdo_silence, 4);
  bench.suffer(Fault::node_reset, 5);
  bench.is_told("motor", "the drive did not answer about an object");
  bench.is_counted(motor, "sdo_timeouts");
  bench.goes_on(others);
  bench.is_whole_again(10);
  bench.all_is_well();
}

TEST_CASE("fault: drive fault, once") {
  FaultBench bench("drive fault, once");
  bench.suffer(Fault::drive_fault_once, 3);
  bench.is_told("motor", "the drive reports a fault");
  bench.is_told("motor", "DC link over-voltage");
  bench.is_counted(motor, "fault_resets");
  bench.goes_on(FaultBench::all & ~FaultBench::index);
  bench.is_whole_again(6);
  bench.all_is_well();
}

TEST_CASE("fault: drive fault, for ever") {
  FaultBench bench("drive fault, for ever");
  bench.suffer(Fault::drive_fault_for_ever, 25);
  bench.is_told("motor", "the drive's fault cannot be reset");
  bench.is_told("motor", "failures in a row; the motor is given up");
  bench.is_told("assembler", "the head stands: no scans until it turns again");
  bench.is_counted(motor, "motor_failures_final");
  bench.goes_on(others);
  bench.harness.simulated().drive().remove_fault_cause();
  bench.is_whole_again(65);
  bench.all_is_well();
}

TEST_CASE("fault: motor stalled") {
  FaultBench bench("motor stalled");
  bench.harness.simulated().drive().set_stalled(true, bench.harness.now_ns());
  bench.endure(4);
  bench.is_told("motor", "the motor stands although it should turn");
  bench.is_told("assembler", "the head stands: no scans until it turns again");
  bench.is_counted(motor, "speed_deviations");
  bench.goes_on(others | FaultBench::drive);
  bench.harness.simulated().drive().set_stalled(false, bench.harness.now_ns());
  bench.is_whole_again(8);
  bench.all_is_well();
}

}  // namespace
}  // namespace alces
