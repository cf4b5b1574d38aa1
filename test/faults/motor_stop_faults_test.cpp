// Stopping, against the simulated drive's shaft: "stopped" is said only of a shaft that stands without
// torque, and a drive that can be spoken with is stopped, whatever state the driver is in.
#include <catch2/catch.hpp>

#include "support/drive_bench.h"

namespace alces {
namespace {

using test::DriveBench;

/// Stops, and the shaft stands and goes on standing.
void is_stopped_for_good(DriveBench& bench, bool is_quick = false) {
  const std::int64_t took_ms = bench.stop_ms(is_quick);
  INFO("took " << took_ms << " ms, " << bench.motor->reason() << "; " << bench.motor->detail());
  REQUIRE(bench.motor->state() == MotorState::stopped);
  REQUIRE(bench.turns_per_s() == 0);
  REQUIRE_FALSE(bench.has_torque());
  bench.run_ms(3000);
  REQUIRE(bench.is_shaft_free());
}

}  // namespace

TEST_CASE("a motor at speed is stopped, and stands without torque when it is said to") {
  for (const bool is_quick : {false, true}) {
    DriveBench bench;
    REQUIRE(bench.spin_up());
    REQUIRE(bench.turns_per_s() > 0.4);
    is_stopped_for_good(bench, is_quick);
    CHECK(bench.motor->counters().stops_by_sdo == 0);
  }
}

TEST_CASE("a stop after a drop-out of 0.35 s, at any time after it, stops the shaft") {
  for (std::int64_t after_ms = 0; after_ms <= 3000; after_ms += 30) {
    INFO("stopped " << after_ms << " ms after the drop-out");
    DriveBench bench;
    REQUIRE(bench.spin_up());
    bench.is_cable_cut = true;
    bench.run_ms(350);
    bench.is_cable_cut = false;
    bench.run_ms(after_ms);
    is_stopped_for_good(bench);
  }
}

TEST_CASE("a stop after, or during, a cable that is cut and comes back stops the shaft") {
  for (const std::int64_t cut_ms : {100, 260, 500, 1000, 3000, 8000}) {
    for (const std::int64_t stop_at_ms : {0, 50, 250, 400, 900, 1500, 2500, 5000}) {
      INFO("cut for " << cut_ms << " ms, stopped " << stop_at_ms << " ms after the cut");
      DriveBench bench;
      REQUIRE(bench.spin_up());
      bench.is_cable_cut = true;
      std::int64_t passed_ms = 0;
      const std::int64_t first_ms = std::min(cut_ms, stop_at_ms);
      bench.run_ms(first_ms);
      passed_ms = first_ms;
      if (stop_at_ms > cut_ms) {
        bench.is_cable_cut = false;
        bench.run_ms(stop_at_ms - passed_ms);
        is_stopped_for_good(bench);
        continue;
      }
      bench.motor->stop(bench.now_ns);
      bench.run_ms(cut_ms - passed_ms);
      REQUIRE_FALSE(bench.motor->state() == MotorState::stopped);  // nobody can know
      bench.is_cable_cut = false;
      for (int ms = 0; ms < 20000 && !bench.motor->has_ended(); ++ms) bench.step();
      REQUIRE(bench.motor->state() == MotorState::stopped);
      REQUIRE(bench.is_shaft_free());
      bench.run_ms(3000);
      REQUIRE(bench.is_shaft_free());
    }
  }
}

TEST_CASE("a stop at any moment of a bring-up over a head that turns already stops it") {
  for (std::int64_t at_ms = 0; at_ms <= 1200; at_ms += 17) {
    INFO("stopped " << at_ms << " ms after the start");
    DriveBench bench;
    REQUIRE(bench.spin_up());
    bench.kill_program();
    bench.run_ms(5000);
    REQUIRE(bench.turns_per_s() > 0.4);  // this drive does not watch its master
    bench.begin_program();
    bench.motor->start(bench.now_ns);
    bench.run_ms(at_ms);
    is_stopped_for_good(bench);
  }
}

TEST_CASE("a drive that is silent is not said to be stopped") {
  DriveBench bench;
  REQUIRE(bench.spin_up());
  SECTION("the cable is cut for good") {
    bench.is_cable_cut = true;
  }
  SECTION("it answers nothing") {
    bench.drive.set_sdo_silent(true);
    bench.drive.set_pdo_silent(true);
    bench.drive.set_heartbeat_silent(true);
  }
  SECTION("it is silent since a while") {
    bench.is_cable_cut = true;
    bench.run_ms(2000);
  }
  const std::int64_t took_ms = bench.stop_ms();
  CHECK(bench.motor->state() == MotorState::unconfirmed);
  CHECK(bench.motor->reason_code() == MotorReason::stop_not_confirmed);
  CHECK(took_ms <= Motor::stop_limit_ns(bench.config) / ns_per_ms);
  CHECK(bench.notices.count("did not confirm") == 1);
  CHECK(bench.notices.notices.back().severity == Severity::error);
}

TEST_CASE("a shaft that coasts is said to be stopped only once it stands") {
  // Quick stop without a ramp: the drive is switch-on disabled at once, and the shaft runs out in 3 s.
  MotorConfig config = settings::default_vehicle_settings().scanner.motor;
  REQUIRE(config.writes.add({0x605A, 0, 2, 0}));
  DriveBench bench(config);
  REQUIRE(bench.spin_up());
  const std::int64_t took_ms = bench.stop_ms(true);
  CHECK(bench.motor->state() == MotorState::stopped);
  CHECK(bench.turns_per_s() == 0);
  CHECK(took_ms > 2500);
}

TEST_CASE("a drive in fault, freshly started, or in another NMT state is stopped") {
  DriveBench bench;
  REQUIRE(bench.spin_up());
  SECTION("fault") {
    bench.drive.raise_fault(0x3210, bench.now_ns, DriveBench::Drive::Clearing::never);
    bench.run_ms(100);
  }
  SECTION("reset while it stops") {
    bench.motor->stop(bench.now_ns);
    bench.run_ms(50);
    bench.drive.reset(bench.now_ns);
  }
  SECTION("NMT stopped: no PDO, no SDO") {
    bench.drive.on_frame(canopen::nmt_frame({canopen::NmtCommand::stop, 1}), bench.now_ns);
  }
  SECTION("quick stop option 6: it stays in quick stop active, with torque") {
    bench.drive.objects().set(0x605A, 0, 6);
    bench.motor->quick_stop(bench.now_ns);
  }
  for (int ms = 0; ms < 20000 && !bench.motor->has_ended(); ++ms) {
    if (bench.motor->state() != MotorState::stopping) bench.motor->stop(bench.now_ns);
    bench.step();
  }
  CHECK(bench.motor->state() == MotorState::stopped);
  CHECK(bench.is_shaft_free());
  bench.run_ms(3000);
  CHECK(bench.is_shaft_free());
}

}  // namespace alces
