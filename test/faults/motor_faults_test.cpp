// The drive and its node on the bus.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

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

/// Whatever comes, the shaft stands and has no torque.
void stays_disabled(FaultBench& bench, double duration_s) {
  sim::SimulatedCia402Drive& drive = bench.harness.simulated().drive();
  double fastest = 0;
  bool has_torque = false;
  for (double t_s = 0; t_s < duration_s; t_s += 0.05) {
    bench.harness.run_s(0.05);
    fastest = std::max(fastest, std::abs(drive.head_turns_per_s_at(bench.harness.now_ns())));
    has_torque = has_torque || drive.state() == sim::Cia402State::operation_enabled;
  }
  CHECK(fastest == 0);
  CHECK_FALSE(has_torque);
}

void reset_by_person(FaultBench& bench) {
  Event reset;
  reset.kind = EventKind::order;
  reset.order = MotorOrder::reset;
  reset.stamp_ns = bench.harness.now_ns();
  bench.harness.on_event(reset);
}

TEST_CASE("fault: drive fault, for ever") {
  FaultBench bench("drive fault, for ever");
  bench.suffer(Fault::drive_fault_for_ever, 25);
  bench.is_told("motor", "the drive's fault cannot be reset");
  bench.is_told("motor",
                "failures in a row; the motor is given up until a person resets it: alcesd --reset-motor");
  bench.is_told("assembler", "the head stands: no scans until it turns again");
  bench.is_counted(motor, "motor_failures_final");
  bench.goes_on(others);
  sim::SimulatedCia402Drive& drive = bench.harness.simulated().drive();
  drive.remove_fault_cause();
  stays_disabled(bench, 70);
  drive.power_off(bench.harness.now_ns());  // and on again
  bench.harness.run_s(1);
  drive.power_on(bench.harness.now_ns());
  stays_disabled(bench, 70);
  bench.harness.suffer(Fault::bus_off, 1);
  stays_disabled(bench, 70);
  reset_by_person(bench);
  bench.is_whole_again(8);
  bench.all_is_well();
}

TEST_CASE("fault: drive silent for longer than six attempts") {
  FaultBench bench("drive silent for longer than six attempts");
  sim::SimulatedCia402Drive& drive = bench.harness.simulated().drive();
  bench.suffer(Fault::node_absent, 60);
  bench.is_told("motor", "the drive does not answer: check its supply, wiring, bit rate and node number");
  bench.is_told("motor",
                "failures in a row; the motor is given up until a person resets it: alcesd --reset-motor");
  bench.goes_on(others);
  // It did not hear anybody meanwhile, and turned on: this drive does not watch its master.
  CHECK(std::abs(drive.head_turns_per_s_at(bench.harness.now_ns())) > 0.4);
  bench.harness.run_s(3);
  stays_disabled(bench, 70);
  reset_by_person(bench);
  bench.is_whole_again(8);
  bench.all_is_well();
}

TEST_CASE("fault: permit withdrawn") {
  HarnessSettings settings = harness_settings();
  settings.scanner.motor.permit.source = PermitSource::socket;
  ScannerHarness harness(settings);
  const auto say = [&](ScannerHarness& to, bool is_given) {
    Event message;
    message.kind = EventKind::order;
    message.order = MotorOrder::permit;
    message.is_up = is_given;
    message.stamp_ns = to.now_ns();
    to.on_event(message);
  };
  const auto run_s = [&](double duration_s, bool is_given) {
    for (double t_s = 0; t_s < duration_s; t_s += 0.1) {
      say(harness, is_given);
      harness.run_s(0.1);
    }
  };
  const auto is_whole_within = [&](double limit_s) {
    const std::size_t before = harness.whole_scans();
    for (double t_s = 0; t_s < limit_s && harness.whole_scans() < before + 2; t_s += 0.1) run_s(0.1, true);
    return harness.whole_scans() >= before + 2;
  };
  sim::SimulatedCia402Drive& drive = harness.simulated().drive();
  harness.scanner().start();
  run_s(5, true);  // a level, no edge
  CHECK(drive.head_turns_per_s_at(harness.now_ns()) == 0);
  CHECK(harness.scanner().motor().state() == MotorState::held);
  run_s(0.5, false);
  REQUIRE(is_whole_within(15));

  const std::int64_t withdrawn_ns = harness.now_ns();
  say(harness, false);
  harness.run_s(0.5);
  CHECK(harness.times_told("motor", "the permit is gone: the motor is stopped") == 1);
  CHECK(harness.counter(motor, "motor_holds") == 2);
  CHECK(drive.head_turns_per_s_at(withdrawn_ns + 300 * ns_per_ms) == 0);  // 1500 rpm at 6000 rpm/s: 0.25 s
  CHECK(drive.state() == sim::Cia402State::switch_on_disabled);
  run_s(5, false);
  CHECK(drive.head_turns_per_s_at(harness.now_ns()) == 0);
  CHECK(is_whole_within(8));
  // And one that merely stops coming.
  harness.run_s(1.2);
  CHECK(drive.head_turns_per_s_at(harness.now_ns()) == 0);
  run_s(5, true);
  CHECK(drive.head_turns_per_s_at(harness.now_ns()) == 0);
  CHECK(harness.account() == "");
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
