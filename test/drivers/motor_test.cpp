// The motor against a fake drive: up, stopped, and through every fault that a bus and a drive can have.
#include "alces_drivers/motor/motor.h"

#include <catch2/catch.hpp>
#include <memory>
#include <set>
#include <string>

#include "alces_drivers/motor/back_off.h"
#include "alces_drivers/motor/cia402.h"
#include "support/motor_bench.h"

using namespace alces;
using alces::test::FakeNode;
using alces::test::motor_config;
using alces::test::MotorBench;
using cia402::State;

namespace {

constexpr std::uint8_t operational_order = 0x01;

bool is_pdo_of_node(const CanFrame& frame) {
  return frame.id == 0x181 || frame.id == 0x281;
}

}  // namespace

TEST_CASE("statuswords name CiA 402's states whatever their other bits are") {
  const std::pair<std::uint16_t, State> table[] = {
      {0x00, State::not_ready_to_switch_on}, {0x40, State::switch_on_disabled},
      {0x21, State::ready_to_switch_on},     {0x23, State::switched_on},
      {0x27, State::operation_enabled},      {0x07, State::quick_stop_active},
      {0x0F, State::fault_reaction_active},  {0x08, State::fault}};
  for (const auto& [bits, state] : table) {
    for (std::uint32_t others = 0; others < 0x10000; others += 0x10) {
      const auto statusword = static_cast<std::uint16_t>(bits | (others & 0xFF90));
      REQUIRE(cia402::state_of(statusword) == state);
    }
  }
  CHECK(cia402::state_of(0x0618) == State::fault);
  CHECK(cia402::state_of(0x0050) == State::switch_on_disabled);
  CHECK(cia402::state_of(0x0060) == State::switch_on_disabled);  // the quick-stop bit does not matter there
  CHECK(cia402::state_of(0x0022) == State::unknown);
}

TEST_CASE("from every state the controlwords lead to every target, on an ideal drive") {
  const State targets[] = {State::switch_on_disabled, State::ready_to_switch_on, State::switched_on,
                           State::operation_enabled};
  const State starts[] = {State::switch_on_disabled, State::ready_to_switch_on, State::switched_on,
                          State::operation_enabled, State::quick_stop_active};
  // CiA 402-2, table of transitions: what a controlword does in a state.
  const auto drive = [](State now, std::uint16_t word) {
    if ((word & 0x02) == 0) return State::switch_on_disabled;
    if ((word & 0x04) == 0) return now == State::operation_enabled ? State::quick_stop_active : now;
    if (now == State::quick_stop_active) return now;
    switch (word & 0x0F) {
      case 0x06:
        return State::ready_to_switch_on;
      case 0x07:
        return now == State::switch_on_disabled ? now : State::switched_on;
      case 0x0F:
        return now == State::switched_on || now == State::operation_enabled ? State::operation_enabled : now;
      default:
        return now;
    }
  };
  for (const State target : targets) {
    for (const State start : starts) {
      State now = start;
      for (int step = 0; step < 5 && now != target; ++step)
        now = drive(now, cia402::controlword_towards(target, now));
      CHECK(now == target);
      CHECK(drive(now, cia402::controlword_towards(target, now)) == target);  // and it stays there
    }
  }
  CHECK(cia402::controlword_towards(State::quick_stop_active, State::operation_enabled) == 0x02);
  CHECK(cia402::controlword_towards(State::operation_enabled, State::fault) == 0);
}

TEST_CASE("the delay between attempts doubles up to its maximum and does not overflow") {
  const BackOff back_off{.first_ns = 100, .maximum_ns = 1000};
  CHECK(back_off.delay_ns(1) == 100);
  CHECK(back_off.delay_ns(2) == 200);
  CHECK(back_off.delay_ns(4) == 800);
  CHECK(back_off.delay_ns(5) == 1000);
  CHECK(back_off.delay_ns(4000000000U) == 1000);
}

TEST_CASE("the motor comes up: configured, walked through CiA 402's states, at speed") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  CHECK(bench.states == std::vector<MotorState>{MotorState::connecting, MotorState::configuring,
                                                MotorState::enabling, MotorState::ramping,
                                                MotorState::running});
  CHECK(bench.node.walked ==
        std::vector<State>{State::ready_to_switch_on, State::switched_on, State::operation_enabled});
  CHECK(bench.node.get(0x6060, 0) == 3);
  CHECK(bench.node.get(0x6083, 0) == 5000);
  CHECK(bench.node.get(0x1017, 0) == 100);
  CHECK(bench.node.target_velocity_units == 4000);
  CHECK(bench.motor.is_turning());
  CHECK(bench.motor.drive_state() == State::operation_enabled);
  CHECK(std::string(bench.motor.reason()) == "at speed");
  CHECK(bench.orders.front().data[0] == 0x82);
  CHECK(bench.orders.back().data[0] == operational_order);
  CHECK(bench.motor.counters().failures == 0);
}

TEST_CASE("each PDO with a position is handed on, with the stamp of the frame and of its SYNC") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.feedback.feedback.clear();
  bench.run_ms(1000);
  REQUIRE(bench.feedback.feedback.size() == 100);
  for (std::size_t entry = 1; entry < 100; ++entry) {
    const DriveFeedback& before = bench.feedback.feedback[entry - 1];
    const DriveFeedback& now = bench.feedback.feedback[entry];
    CHECK(now.stamp_ns > before.stamp_ns);
    CHECK(now.stamp_ns - now.sync_stamp_ns == ns_per_ms);
    CHECK(std::abs(now.position_counts - before.position_counts - 40) <= 1);
    CHECK(now.velocity_units == 4000);
    CHECK(now.statusword == 0x0237);
  }
  CHECK(bench.motor.counters().pdo.missed == 0);
  CHECK(bench.motor.counters().pdo.extra == 0);
}

TEST_CASE("stop ramps to zero, disables the drive and leaves the node pre-operational") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.motor.stop(bench.now_ns);
  CHECK(bench.motor.state() == MotorState::stopping);
  REQUIRE(bench.run_until(MotorState::stopped, 3000));
  bench.run_ms(5);
  CHECK(bench.node.velocity_units == 0);
  CHECK(bench.node.drive == State::switch_on_disabled);
  CHECK(bench.node.nmt == canopen::NmtState::pre_operational);
  CHECK_FALSE(bench.motor.is_turning());
  CHECK(bench.motor.reason_code() == MotorReason::stop_wanted);
  const std::size_t sent = bench.from_motor.size();
  bench.run_ms(500);
  CHECK(bench.from_motor.size() == sent);  // silence

  REQUIRE(bench.spin_up());  // and it can be started again
}

TEST_CASE("quick stop uses the drive's quick stop") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.node.walked.clear();
  bench.motor.quick_stop(bench.now_ns);
  REQUIRE(bench.run_until(MotorState::stopped, 3000));
  CHECK(bench.node.walked == std::vector<State>{State::quick_stop_active, State::switch_on_disabled});
  CHECK(bench.motor.reason_code() == MotorReason::quick_stop_wanted);
}

TEST_CASE("our own ramp limits how fast the target velocity changes, up and down") {
  MotorConfig config = motor_config();
  config.ramp_units_per_s = 4000;
  MotorBench bench(config);
  bench.node.acceleration_units_per_s = 1e9;
  REQUIRE(bench.spin_up());
  bench.motor.stop(bench.now_ns);
  REQUIRE(bench.run_until(MotorState::stopped));
  std::int32_t before = 0;
  std::int32_t highest = 0;
  for (const CanFrame& frame : bench.from_motor) {
    if (frame.id != 0x201) continue;
    const auto target = static_cast<std::int32_t>(canopen::load(std::span(frame.data).subspan(2, 4), 4));
    CHECK(std::abs(target - before) <= 41);  // 10 ms at 4000 a second, rounded
    before = target;
    highest = std::max(highest, target);
  }
  CHECK(highest == 4000);
  CHECK(before == 0);
}

TEST_CASE("what a drive has fixed, or lacks, is left as it is") {
  MotorConfig config = motor_config();
  config.heartbeat_period_ms = 0;
  config.writes_mode = false;
  for (std::size_t pdo = 0; pdo < 2; ++pdo) config.tpdos[pdo].keeps_transmission_type = true;
  MotorBench bench(config);
  bench.node.set(0x6060, 0, 1, 3);  // its only mode
  bench.node.aborts[{0x1017, 0}] = 0x06020000;
  bench.node.aborts[{0x6060, 0}] = 0x06010002;
  bench.node.aborts[{0x1800, 2}] = bench.node.aborts[{0x1801, 2}] = 0x06010002;
  bench.motor.start(0);
  // This drive's transmission types are 1 already.
  REQUIRE(bench.run_until(MotorState::configuring));
  bench.node.set(0x1800, 2, 1, 1);
  bench.node.set(0x1801, 2, 1, 1);
  CHECK(bench.run_until(MotorState::running));
  CHECK(bench.motor.counters().failures == 0);
}

TEST_CASE("an RPDO's bit 30 that the drive's maker insists on is taken over") {
  MotorBench bench;
  bench.node.insists_on_rpdo_bit_30 = true;
  REQUIRE(bench.spin_up());
  CHECK((bench.node.get(0x1400, 1) & 0x40000000U) != 0);
  CHECK(bench.motor.counters().failures == 0);
}

TEST_CASE("the second axis of a node has its objects at 0x6800, and PDOs of its own") {
  MotorConfig config = motor_config();
  config.axis = 1;
  config.writes = {};
  for (canopen::PdoConfig* pdo : {&config.tpdos[0], &config.tpdos[1], &config.rpdos[0]}) {
    for (std::size_t i = 0; i < pdo->entries.size(); ++i)
      pdo->entries[i].index = static_cast<std::uint16_t>(pdo->entries[i].index + 0x800);
  }
  REQUIRE(validate(config) == MotorConfigStatus::ok);
  MotorBench bench(config);
  bench.node.axis = 1;
  REQUIRE(bench.spin_up());
  CHECK(bench.node.get(0x6860, 0) == 3);
  CHECK(bench.node.objects.count({0x6060, 0}) == 0);
  bench.motor.stop(bench.now_ns);
  bench.run_ms(20);
  bench.node.sends_pdos = false;  // the rest by SDO
  REQUIRE(bench.run_until(MotorState::stopped, 10000));
  CHECK(bench.node.velocity_units == 0);
  CHECK(cia402::has_no_torque(bench.node.drive));
  config.axis = 8;
  CHECK(validate(config) == MotorConfigStatus::bad_node);
}

TEST_CASE("a negative speed is a speed") {
  MotorConfig config = motor_config();
  config.target_velocity_units = -4000;
  MotorBench bench(config);
  REQUIRE(bench.spin_up());
  CHECK(bench.node.velocity_units == -4000);
}

TEST_CASE("a clock that jumps by decades, forward and back, again and again overflows nothing") {
  MotorBench bench;
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::running));
  for (int jump = 0; jump < 12; ++jump) {
    bench.motor.on_tick(latest_stamp_ns);
    for (std::int64_t tick = 1; tick <= 50; ++tick) bench.motor.on_tick(tick * 10 * ns_per_ms);
    if (bench.motor.next_sync_ns() != no_stamp_ns) CHECK(bench.motor.next_sync_ns() <= 2 * latest_stamp_ns);
  }
  CHECK(bench.motor.counters().clock_steps > 2);
  for (const Notice& notice : bench.notices.notices) CHECK(notice.stamp_ns >= 0);
}

TEST_CASE("without SYNC the RPDOs go out by the clock and event-driven TPDOs are taken") {
  MotorConfig config = motor_config();
  config.sync.period_ns = 0;
  config.control_period_ns = 20 * ns_per_ms;
  config.pdo_timeout_ns = 0;
  for (std::size_t pdo = 0; pdo < 2; ++pdo) config.tpdos[pdo].transmission_type = 255;
  config.rpdos[0].transmission_type = 255;
  config.heartbeat_period_ms = 0;
  MotorBench bench(config);
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::enabling));
  CHECK(std::none_of(bench.from_motor.begin(), bench.from_motor.end(),
                     [](const CanFrame& f) { return f.id == 0x080; }));
  // The fake drive sends on SYNC only: what an event-driven one would send on each change.
  for (int ms = 0; ms < 5000 && bench.motor.state() != MotorState::running; ++ms) {
    bench.step();
    if (ms % 10 != 0) continue;
    CanFrame status{.id = 0x181, .size = 6};
    canopen::store(bench.node.statusword(), status.data, 2);
    CanFrame velocity{.id = 0x281, .size = 4};
    canopen::store(static_cast<std::uint32_t>(bench.node.velocity_units), velocity.data, 4);
    bench.node.out.push_back(status);
    bench.node.out.push_back(velocity);
  }
  CHECK(bench.motor.state() == MotorState::running);
}

TEST_CASE("a master's SYNC drives a motor that makes none") {
  MotorConfig config = motor_config();
  config.is_sync_producer = false;
  test::FakeCanPort port;
  test::NoticeLog notices;
  test::FeedbackLog feedback;
  FakeNode node{1};
  Motor motor(config, port, notices, feedback);
  canopen::Master master({.sync = {.period_ns = 10 * ns_per_ms}}, port);
  REQUIRE(master.add(motor, motor.cob_ids()));
  motor.start(0);
  std::int64_t now_ns = 0;
  int syncs = 0;
  for (; now_ns < 10 * ns_per_s && motor.state() != MotorState::running; now_ns += ns_per_ms) {
    node.tick(now_ns);
    for (const CanFrame& frame : std::exchange(node.out, {})) master.on_frame(frame, now_ns);
    master.on_tick(now_ns);
    for (const CanFrame& frame : std::exchange(port.sent, {})) {
      if (frame.id == 0x080) ++syncs;
      node.on_frame(frame, now_ns);
    }
  }
  CHECK(motor.state() == MotorState::running);
  CHECK(syncs == (now_ns + 9 * ns_per_ms) / (10 * ns_per_ms));  // the master's alone
}

// Faults
// ------------------------------------------------------------------------------------------------------------

TEST_CASE("fault: the node is absent, it is said, retried with growing delays, and then given up for good") {
  MotorBench bench;
  bench.node.is_present = false;
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::failed, 20000));
  CHECK(bench.motor.reason_code() == MotorReason::node_absent);
  CHECK(bench.motor.counters().failures == 4);
  CHECK(bench.notices.count("does not answer") == 4);
  CHECK(bench.notices.count("--reset-motor") == 1);
  CHECK(bench.notices.notices.back().severity == Severity::error);
  bench.run_ms(200000);
  CHECK(bench.motor.state() == MotorState::failed);
  CHECK(bench.motor.counters().failures == 4);
}

TEST_CASE(
    "a motor that was given up stays so through boot-up and a bus that comes back, until a person resets "
    "it") {
  MotorBench bench;
  SECTION("the node was absent") {
    bench.node.is_present = false;
    bench.motor.start(0);
    REQUIRE(bench.run_until(MotorState::failed, 20000));
    bench.node.is_present = true;
  }
  SECTION("it had a fault") {
    REQUIRE(bench.spin_up());
    bench.node.is_fault_for_ever = true;
    bench.node.raise_fault(0x3210);
    REQUIRE(bench.run_until(MotorState::failed, 20000));
    bench.node.is_fault_for_ever = false;
  }
  SECTION("communication was lost, and the shaft turns on") {
    REQUIRE(bench.spin_up());
    bench.node.is_present = false;
    REQUIRE(bench.run_until(MotorState::failed, 20000));
    bench.node.is_present = true;
    REQUIRE(bench.node.velocity_units == 4000);
    bench.run_ms(2000);
    CHECK(bench.node.velocity_units == 0);  // disabled as soon as it can be spoken with
    CHECK(bench.node.drive == State::switch_on_disabled);
  }
  bench.node.restart(bench.now_ns);
  bench.run_ms(70000);
  bench.motor.on_link(false, bench.now_ns);
  bench.run_ms(100);
  bench.motor.on_link(true, bench.now_ns);
  bench.run_ms(70000);
  CHECK(bench.motor.state() == MotorState::failed);
  CHECK(bench.node.drive != State::operation_enabled);
  CHECK(bench.node.velocity_units == 0);
  bench.motor.reset(bench.now_ns);
  CHECK(bench.run_until(MotorState::running, 10000));
  CHECK(bench.motor.counters().resets_by_person == 1);
  bench.motor.reset(bench.now_ns);  // of a motor that runs: nothing
  CHECK(bench.motor.state() == MotorState::running);
}

TEST_CASE("fault: the boot-up message comes late, the node is taken as soon as it comes") {
  MotorBench bench;
  bench.node.is_present = false;
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::recovering));
  bench.node.is_present = true;
  bench.node.restart(bench.now_ns);
  bench.run_ms(60);
  CHECK(bench.run_until(MotorState::running, 5000));
  CHECK(bench.motor.counters().node_resets == 0);
}

TEST_CASE("fault: the drive warns on and off, that does not flood") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.bus = [](const CanFrame& frame, std::int64_t now_ns) {
    CanFrame out = frame;
    if (frame.id == 0x181 && (now_ns / (200 * ns_per_ms)) % 2 == 0) out.data[0] |= 0x80;
    return std::vector<CanFrame>{out};
  };
  bench.run_ms(200000);  // 500 times
  CHECK(bench.motor.state() == MotorState::running);
  CHECK(bench.notices.count("the drive warns") >= 7);
  CHECK(bench.notices.count("the drive warns") <= 9);  // at 0, 1, 3, 7, 15, 31, 63, 127, 191 s
}

TEST_CASE("fault: the drive's statusword is no state at all, that is told") {
  MotorBench bench;
  bench.bus = [](const CanFrame& frame, std::int64_t) {
    CanFrame out = frame;
    if (frame.id == 0x181) out.data[0] = 0x6C;
    return std::vector<CanFrame>{out};
  };
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::recovering));
  CHECK(bench.motor.reason_code() == MotorReason::transition_refused);
  CHECK(std::string(bench.motor.detail()) == "its statusword is no state of CiA 402");
}

TEST_CASE("fault: the boot-up message comes while we already configure") {
  MotorConfig config = motor_config();
  config.boot_timeout_ns = 30 * ns_per_ms;  // less than the node needs
  MotorBench bench(config);
  REQUIRE(bench.spin_up());
  CHECK(bench.motor.counters().node_resets == 0);
  CHECK(bench.motor.counters().failures == 0);
}

TEST_CASE("fault: the boot-up message is lost, the node is found by SDO") {
  MotorBench bench;
  bench.bus = [](const CanFrame& frame, std::int64_t) {
    const bool is_boot_up = frame.id == 0x701 && frame.data[0] == 0;
    return is_boot_up ? std::vector<CanFrame>{} : std::vector<CanFrame>{frame};
  };
  CHECK(bench.spin_up());
  CHECK(bench.motor.counters().failures == 0);
}

TEST_CASE("fault: the node starts anew in mid-drive, it is configured and run again at once") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.node.written.clear();
  bench.node.restart(bench.now_ns);
  REQUIRE(bench.run_until(MotorState::configuring, 100));
  CHECK(bench.notices.count("started anew") == 1);
  CHECK(bench.run_until(MotorState::running, 5000));
  CHECK(bench.motor.counters().node_resets == 1);
  CHECK(bench.motor.counters().heartbeat.resets_detected == 1);
  CHECK(bench.node.written.size() > 15);  // all of it again
  bench.run_ms(11000);
  CHECK(bench.motor.failures_in_a_row() == 0);  // forgotten after a while
}

TEST_CASE("fault: the node starts anew again and again, that has a limit") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  for (int round = 0; round < 200; ++round) {
    bench.node.restart(bench.now_ns);
    bench.run_ms(200);
  }
  CHECK(bench.motor.state() == MotorState::failed);
  CHECK(bench.motor.reason_code() == MotorReason::node_reset);
  CHECK(bench.motor.counters().failures_final == 1);
  CHECK(bench.node.drive != State::operation_enabled);
  CHECK(bench.notices.notices.size() < 800);
}

TEST_CASE("fault: the heartbeat is lost while PDOs go on") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.node.beats = false;
  REQUIRE(bench.run_until(MotorState::recovering, 500));
  CHECK(bench.motor.reason_code() == MotorReason::heartbeat_lost);
  bench.node.beats = true;
  CHECK(bench.run_until(MotorState::running, 5000));
}

TEST_CASE("fault: the cable is cut and mended") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.is_wire_whole = false;
  bench.node.is_present = false;
  REQUIRE(bench.run_until(MotorState::recovering, 500));
  CHECK((bench.motor.reason_code() == MotorReason::heartbeat_lost ||
         bench.motor.reason_code() == MotorReason::pdo_lost));
  bench.run_ms(2000);
  CHECK_FALSE(bench.motor.is_turning());
  bench.is_wire_whole = true;
  bench.node.is_present = true;
  CHECK(bench.run_until(MotorState::running, 10000));
}

TEST_CASE("fault: an EMCY alone is told, not obeyed, a storm of them is told once a second") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  for (int message = 0; message < 1000; ++message) {
    bench.node.out.push_back(canopen::emcy_frame({.node = 1, .code = 0x4210, .error_register = 8}));
    bench.run_ms(1);
  }
  CHECK(bench.motor.state() == MotorState::running);
  CHECK(bench.notices.count("device too hot") == 1);
  CHECK(bench.motor.counters().emcys == 1000);
  CHECK(bench.motor.counters().emcys_not_told == 999);
  bench.node.out.push_back(canopen::emcy_frame({.node = 1}));
  bench.node.out.push_back(CanFrame{.id = 0x081, .size = 3});
  bench.node.out.push_back(canopen::emcy_frame({.node = 2, .code = 0x1000}));
  bench.run_ms(2);
  CHECK(bench.notices.count("error is gone") == 1);
  CHECK(bench.motor.counters().emcys_malformed == 1);
  CHECK(bench.motor.counters().emcys == 1000);
}

TEST_CASE("fault: the drive refuses an object, the object and the reason are told") {
  MotorBench bench;
  bench.node.aborts[{0x6084, 0}] = 0x06010002;
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::failed));
  CHECK(bench.motor.reason_code() == MotorReason::sdo_aborted);
  CHECK(std::string(bench.motor.detail()) == "the object can only be read");
  const bool is_object_told = std::any_of(bench.notices.notices.begin(), bench.notices.notices.end(),
                                          [](const Notice& notice) { return notice.value == 0x608400; });
  CHECK(is_object_told);
  CHECK(bench.notices.count("profile deceleration") >= 1);  // its name
  const auto is_hexadecimal = [](const Notice& notice) { return notice.is_hexadecimal; };
  CHECK(std::count_if(bench.notices.notices.begin(), bench.notices.notices.end(), is_hexadecimal) >= 2);
  bench.node.aborts.clear();
  bench.motor.reset(bench.now_ns);
  CHECK(bench.run_until(MotorState::running, 10000));
}

TEST_CASE("fault: another device answers, nothing is written to it") {
  MotorBench bench;
  bench.node.set(0x1000, 0, 4, 0x00020191);
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::recovering));
  CHECK(bench.motor.reason_code() == MotorReason::wrong_device);
  CHECK(bench.node.written.empty());
}

TEST_CASE("fault: SDO answers stop in the middle of the configuration") {
  MotorBench bench;
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::configuring));
  bench.run_ms(10);
  bench.node.answers_sdo = false;
  REQUIRE(bench.run_until(MotorState::recovering));
  CHECK(bench.motor.reason_code() == MotorReason::sdo_timed_out);
  CHECK(bench.motor.counters().sdo.timeouts == 2);
  bench.node.answers_sdo = true;
  CHECK(bench.run_until(MotorState::running));
}

TEST_CASE("fault: one SDO answer in five is lost or repeated, and it comes up all the same") {
  MotorBench bench;
  int answers = 0;
  bench.bus = [&answers](const CanFrame& frame, std::int64_t) {
    if (frame.id != 0x581) return std::vector<CanFrame>{frame};
    ++answers;
    if (answers % 5 == 0) return std::vector<CanFrame>{};
    if (answers % 5 == 2) return std::vector<CanFrame>{frame, frame};
    return std::vector<CanFrame>{frame};
  };
  CHECK(bench.spin_up());
  CHECK(bench.motor.counters().sdo.retries > 0);
  CHECK(bench.motor.counters().sdo.answers_late + bench.motor.counters().sdo.answers_foreign > 0);
  CHECK(bench.motor.counters().failures == 0);
}

TEST_CASE("fault: the drive's fault state, once: reset after a delay, and on") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  const std::int64_t before_ns = bench.now_ns;
  bench.node.raise_fault(0x2310);
  REQUIRE(bench.run_until(MotorState::recovering, 100));
  CHECK(bench.motor.reason_code() == MotorReason::drive_fault);
  CHECK(std::string(bench.motor.detail()) == "continuous over-current at the output");
  REQUIRE(bench.run_until(MotorState::running, 5000));
  CHECK(bench.now_ns - before_ns >= 100 * ns_per_ms);
  CHECK(bench.motor.counters().drive_faults == 1);
  CHECK(bench.motor.counters().fault_resets == 1);
  CHECK(bench.motor.counters().failures == 1);
}

TEST_CASE("fault: the drive is in fault when it is met, the first reset is no failure") {
  MotorBench bench;
  bench.node.drive = State::fault;
  REQUIRE(bench.spin_up());
  CHECK(bench.motor.counters().fault_resets == 1);
  CHECK(bench.motor.counters().failures == 0);
  CHECK(bench.notices.count("resets the drive's fault") == 1);
}

TEST_CASE(
    "fault: the drive's fault state for ever: given up, pre-operational, with the drive's own error code") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.node.is_fault_for_ever = true;
  bench.node.raise_fault(0x3210);
  REQUIRE(bench.run_until(MotorState::failed, 20000));
  CHECK(bench.motor.reason_code() == MotorReason::fault_not_cleared);
  CHECK(bench.motor.counters().failures == 4);
  bench.run_ms(500);
  CHECK(std::string(bench.motor.detail()) == "DC link over-voltage");
  CHECK(bench.node.nmt == canopen::NmtState::pre_operational);
  const std::size_t sent = bench.from_motor.size();
  bench.run_ms(10000);
  CHECK(bench.from_motor.size() == sent);
  bench.motor.stop(bench.now_ns);
  CHECK(bench.run_until(MotorState::stopped, 200));  // asked once more
}

TEST_CASE("fault: a fault whenever it is switched on is limited too") {
  MotorBench bench;
  bench.motor.start(0);
  for (int ms = 0; ms < 20000 && bench.motor.state() != MotorState::failed; ++ms) {
    if (bench.node.drive == State::switched_on) bench.node.raise_fault(0x7121);
    bench.step();
  }
  CHECK(bench.motor.state() == MotorState::failed);
  CHECK(bench.motor.counters().failures == 4);
}

TEST_CASE("fault: bus-off and back, it is waited for, and counts as nobody's failure") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  for (int round = 0; round < 20; ++round) {
    bench.motor.on_link(false, bench.now_ns);
    CHECK(bench.motor.state() == MotorState::connecting);
    CHECK(bench.motor.reason_code() == MotorReason::bus_down);
    const std::size_t sent = bench.from_motor.size();
    bench.run_ms(300);
    CHECK(bench.from_motor.size() == sent);
    bench.motor.on_link(true, bench.now_ns);
    REQUIRE(bench.run_until(MotorState::running, 5000));
  }
  CHECK(bench.motor.counters().link_downs == 20);
  CHECK(bench.motor.counters().failures == 0);
}

TEST_CASE("fault: the bus is down at the start, and goes down while it stops") {
  MotorBench bench;
  bench.motor.on_link(false, 0);
  bench.motor.start(0);
  bench.run_ms(100);
  CHECK(bench.motor.reason_code() == MotorReason::bus_down);
  CHECK(bench.from_motor.empty());
  bench.motor.on_link(true, bench.now_ns);
  REQUIRE(bench.run_until(MotorState::running));
  bench.motor.stop(bench.now_ns);
  bench.motor.on_link(false, bench.now_ns);
  SECTION("for good: nobody says that it stands") {
    bench.run_ms(6900);
    CHECK(bench.motor.state() == MotorState::stopping);
    bench.run_ms(200);
    CHECK(bench.motor.state() == MotorState::unconfirmed);
    CHECK(bench.motor.reason_code() == MotorReason::stop_not_confirmed);
    CHECK(bench.notices.notices.back().severity == Severity::error);
  }
  SECTION("and up again: it is stopped by SDO") {
    bench.run_ms(1000);
    bench.motor.on_link(true, bench.now_ns);
    REQUIRE(bench.run_until(MotorState::stopped, 3000));
    CHECK(bench.node.velocity_units == 0);
    CHECK(cia402::has_no_torque(bench.node.drive));
    CHECK(bench.motor.counters().stops_by_sdo == 1);
  }
}

TEST_CASE("fault: one PDO in ten is lost, it is counted and nothing else") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  int pdos = 0;
  bench.bus = [&pdos](const CanFrame& frame, std::int64_t) {
    const bool is_lost = frame.id == 0x181 && ++pdos % 10 == 0;
    return is_lost ? std::vector<CanFrame>{} : std::vector<CanFrame>{frame};
  };
  bench.feedback.feedback.clear();
  bench.run_ms(10000);
  CHECK(bench.feedback.feedback.size() == 900);
  bench.bus = nullptr;
  bench.run_ms(20);  // the last one is missed when the next SYNC goes out
  CHECK(bench.motor.state() == MotorState::running);
  CHECK(bench.motor.counters().pdo.missed == 100);
}

TEST_CASE("fault: all PDOs are lost, the drive is begun anew") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.node.sends_pdos = false;
  REQUIRE(bench.run_until(MotorState::recovering, 300));
  CHECK(bench.motor.reason_code() == MotorReason::pdo_lost);
  bench.run_ms(2);
  CHECK_FALSE(bench.motor.is_turning());
  bench.node.sends_pdos = true;
  CHECK(bench.run_until(MotorState::running, 5000));
}

TEST_CASE("fault: no PDO ever comes") {
  MotorBench bench;
  bench.node.sends_pdos = false;
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::recovering, 5000));
  CHECK(bench.motor.reason_code() == MotorReason::no_process_data);
}

TEST_CASE("fault: PDOs come twice, the second is dropped") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.bus = [](const CanFrame& frame, std::int64_t) {
    return is_pdo_of_node(frame) ? std::vector<CanFrame>{frame, frame} : std::vector<CanFrame>{frame};
  };
  bench.feedback.feedback.clear();
  bench.run_ms(1000);
  CHECK(bench.motor.state() == MotorState::running);
  CHECK(bench.motor.counters().pdo.repeated == 200);
  CHECK(bench.feedback.feedback.size() == 100);
}

TEST_CASE("fault: a PDO comes one beat late, after the next one, stamps still rise and the drive runs on") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  int pdos = 0;
  std::vector<CanFrame> held;
  bench.bus = [&](const CanFrame& frame, std::int64_t) {
    if (frame.id != 0x181) return std::vector<CanFrame>{frame};
    if (++pdos % 10 == 0) {
      held = {frame};
      return std::vector<CanFrame>{};
    }
    std::vector<CanFrame> frames{frame};
    frames.insert(frames.end(), held.begin(), held.end());  // reordered
    held.clear();
    return frames;
  };
  bench.feedback.feedback.clear();
  bench.run_ms(5020);
  CHECK(bench.motor.state() == MotorState::running);
  CHECK(bench.motor.counters().pdo.missed == 50);
  CHECK(bench.motor.counters().pdo.extra >= 49);
  CHECK(bench.motor.counters().pdo.extra <= 50);
  const auto extra_count = std::count_if(bench.feedback.feedback.begin(), bench.feedback.feedback.end(),
                                         [](const DriveFeedback& one) { return one.is_extra; });
  CHECK(static_cast<std::uint64_t>(extra_count) == bench.motor.counters().pdo.extra);
  for (std::size_t entry = 1; entry < bench.feedback.feedback.size(); ++entry) {
    REQUIRE(bench.feedback.feedback[entry].stamp_ns > bench.feedback.feedback[entry - 1].stamp_ns);
  }
}

TEST_CASE("fault: an old statusword that comes late is not believed at once") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.run_ms(5);
  CanFrame old{.id = 0x181, .size = 6};
  canopen::store(0x0233, old.data, 2);
  bench.node.out.push_back(old);
  bench.run_ms(100);
  CHECK(bench.motor.state() == MotorState::running);
  CHECK(bench.motor.counters().pdo.states_ignored == 1);
}

TEST_CASE("fault: PDOs too short, and stamps that run backwards, are dropped and counted") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.node.out.push_back(CanFrame{.id = 0x181, .size = 3});
  bench.run_ms(1);
  CHECK(bench.motor.counters().pdo.malformed == 1);
  CanFrame pdo{.id = 0x181, .size = 6};
  bench.motor.on_frame(pdo, bench.now_ns - 500 * ns_per_ms);
  CHECK(bench.motor.counters().pdo.stale == 1);
  CHECK(bench.motor.state() == MotorState::running);
}

TEST_CASE("fault: another node's traffic at 90 % load changes nothing") {
  MotorBench bench;
  std::uint32_t seed = 7;
  const auto next = [&seed] {
    seed = seed * 1664525U + 1013904223U;
    return seed >> 8;
  };
  // 1 Mbit/s carries about 8 frames of 8 bytes a millisecond.
  bench.motor.start(0);
  for (int ms = 0; ms < 10000 && bench.motor.state() != MotorState::running; ++ms) {
    for (int frame_number = 0; frame_number < 7; ++frame_number) {
      CanFrame frame{.size = 8};
      const std::uint32_t node = 2 + next() % 126;
      const std::uint32_t bases[] = {0x080, 0x180, 0x280, 0x380, 0x480, 0x580, 0x700};
      frame.id = bases[next() % 7] + node;
      for (std::uint8_t& byte : frame.data) byte = 0;
      for (std::size_t byte = 0; byte < 8; ++byte) frame.data[byte] = static_cast<std::uint8_t>(next());
      bench.motor.on_frame(frame, bench.now_ns);
    }
    bench.step();
  }
  CHECK(bench.motor.state() == MotorState::running);
  CHECK(bench.motor.counters().failures == 0);
  CHECK(bench.motor.counters().frames_foreign > 1000);
}

TEST_CASE("fault: error frames, remote, extended and FD frames are counted and left alone") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  CanFrame frame{.id = 0x701, .size = 1};
  frame.is_error = true;
  bench.motor.on_frame(frame, bench.now_ns);
  frame.is_error = false;
  frame.is_extended = true;
  bench.motor.on_frame(frame, bench.now_ns);
  frame.is_extended = false;
  frame.is_remote = true;
  bench.motor.on_frame(frame, bench.now_ns);
  frame.is_remote = false;
  frame.is_fd = true;
  bench.motor.on_frame(frame, bench.now_ns);
  CHECK(bench.motor.state() == MotorState::running);
  CHECK(bench.motor.counters().error_frames == 1);
  CHECK(bench.motor.counters().frames_not_canopen == 3);
}

TEST_CASE("fault: the send queue is full for a while, at any moment of the bring-up and in mid-drive") {
  for (const std::int64_t full_at_ms : {0, 20, 51, 55, 60, 80, 100, 150, 1500}) {
    MotorBench bench;
    bench.motor.start(0);
    bench.run_ms(full_at_ms);
    bench.port.is_full = true;
    bench.run_ms(40);
    bench.port.is_full = false;
    CHECK(bench.run_until(MotorState::running, 20000));
    CHECK(bench.motor.counters().failures <= 1);
  }
  MotorBench bench;
  bench.port.is_full = true;
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::recovering));
  CHECK(bench.motor.reason_code() == MotorReason::sdo_not_sent);
  CHECK(bench.motor.counters().nmt_not_taken > 0);
}

TEST_CASE("fault: the motor stalls, turns too slowly, too fast, the wrong way: each has its name") {
  const std::pair<std::int32_t, MotorReason> cases[] = {
      {0, MotorReason::stalled},           {3000, MotorReason::too_slow},
      {5000, MotorReason::too_fast},       {-4000, MotorReason::wrong_way},
      {INT32_MIN, MotorReason::wrong_way}, {INT32_MAX, MotorReason::too_fast}};
  for (const auto& [velocity, reason] : cases) {
    MotorBench bench;
    REQUIRE(bench.spin_up());
    bench.node.velocity_override = velocity;
    bench.run_ms(900);
    CHECK(bench.motor.state() == MotorState::running);  // not yet for long enough
    REQUIRE(bench.run_until(MotorState::recovering, 300));
    CHECK(bench.motor.reason_code() == reason);
    bench.run_ms(30);
    CHECK(bench.node.drive != State::operation_enabled);  // quick stop
    bench.node.velocity_override.reset();
    CHECK(bench.run_until(MotorState::running, 5000));
    CHECK(bench.motor.counters().speed_deviations == 1);
  }
}

TEST_CASE("a speed that is off for a moment only is no failure") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  for (int round = 0; round < 10; ++round) {
    bench.node.velocity_override = 3000;
    bench.run_ms(800);
    bench.node.velocity_override.reset();
    bench.run_ms(200);
  }
  CHECK(bench.motor.state() == MotorState::running);
}

TEST_CASE("fault: it never comes to speed") {
  MotorBench bench;
  bench.node.velocity_override = 1000;
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::recovering, 10000));
  CHECK(bench.motor.reason_code() == MotorReason::speed_not_reached);
}

TEST_CASE("fault: the drive does not obey, does not take the mode, or switches off by itself") {
  MotorBench bench;
  SECTION("does not obey") {
    bench.node.obeys_controlword = false;
    bench.motor.start(0);
    REQUIRE(bench.run_until(MotorState::recovering, 10000));
    CHECK(bench.motor.reason_code() == MotorReason::transition_refused);
    CHECK(std::string(bench.motor.detail()) == "switch-on disabled");
  }
  SECTION("another mode") {
    bench.node.mode_display_override = 1;
    bench.motor.start(0);
    REQUIRE(bench.run_until(MotorState::recovering, 10000));
    CHECK(bench.motor.reason_code() == MotorReason::wrong_mode);
  }
  SECTION("switches off") {
    REQUIRE(bench.spin_up());
    bench.node.drive = State::switch_on_disabled;
    bench.node.obeys_controlword = false;
    REQUIRE(bench.run_until(MotorState::recovering, 100));
    CHECK(bench.motor.reason_code() == MotorReason::operation_left);
    bench.node.obeys_controlword = true;
    CHECK(bench.run_until(MotorState::running, 5000));
  }
  SECTION("leaves the operational state") {
    REQUIRE(bench.spin_up());
    bench.node.nmt = canopen::NmtState::pre_operational;
    REQUIRE(bench.run_until(MotorState::recovering, 300));
    CHECK((bench.motor.reason_code() == MotorReason::node_not_operational ||
           bench.motor.reason_code() == MotorReason::pdo_lost));
    CHECK(bench.run_until(MotorState::running, 5000));
  }
}

TEST_CASE("fault: the NMT start is lost, the heartbeat shows it and it is sent again") {
  MotorBench bench;
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::enabling));
  bench.node.nmt = canopen::NmtState::pre_operational;
  CHECK(bench.run_until(MotorState::running, 5000));
  CHECK(bench.motor.counters().failures == 0);
}

TEST_CASE("fault: a drive that does not slow down is not said to be stopped") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.node.velocity_override = 4000;
  bench.node.obeys_controlword = false;
  bench.motor.stop(bench.now_ns);
  REQUIRE(bench.run_until(MotorState::unconfirmed, Motor::stop_limit_ns(bench.config) / ns_per_ms + 10));
  CHECK(bench.motor.reason_code() == MotorReason::stop_not_confirmed);
  CHECK(std::string(bench.motor.detail()) == "operation enabled");
  CHECK(bench.notices.count("did not come to rest") >= 2);
  CHECK(bench.notices.notices.back().value == 4000);
  CHECK(bench.motor.counters().stops_unconfirmed == 1);
  bench.node.velocity_override.reset();
  bench.node.obeys_controlword = true;
  CHECK(bench.spin_up());  // and it can be started again
}

TEST_CASE("stop works in every state, and start after it") {
  for (std::int64_t ms = 0; ms < 1200; ms += 7) {
    MotorBench bench;
    bench.motor.start(0);
    bench.run_ms(ms);
    bench.motor.stop(bench.now_ns);
    REQUIRE(bench.run_until(MotorState::stopped, 5000));
    bench.run_ms(100);
    REQUIRE(bench.node.drive != State::operation_enabled);
    REQUIRE(bench.node.nmt != canopen::NmtState::operational);
    REQUIRE(bench.spin_up());
  }
}

TEST_CASE("a drive that is not enabled yet is not enabled by stop") {
  MotorConfig config = motor_config();
  config.is_sync_producer = false;
  MotorBench bench(config);
  bench.motor.start(0);
  bench.node.obeys_controlword = false;
  bench.node.drive = State::switched_on;
  for (int ms = 0; ms < 300; ++ms) {
    bench.step();
    if (ms % 10 != 0) continue;
    const CanFrame sync{.id = 0x080};
    bench.motor.on_frame(sync, bench.now_ns);
    bench.node.on_frame(sync, bench.now_ns);
  }
  REQUIRE(bench.motor.state() == MotorState::enabling);
  bench.motor.stop(bench.now_ns);
  bench.port.sent.clear();
  bench.motor.on_frame(CanFrame{.id = 0x080}, bench.now_ns + 1);  // before the next tick
  REQUIRE_FALSE(bench.port.sent.empty());
  CHECK(bench.port.sent.front().id == 0x201);
  CHECK(bench.port.sent.front().data[0] == cia402::controlword::shutdown);
}

TEST_CASE("nothing goes to the drive's RPDOs before it was ordered to be operational") {
  MotorBench bench;
  bench.motor.start(0);
  REQUIRE(bench.run_until(MotorState::configuring));
  bench.run_ms(2);
  bench.port.refused_id = 0x000;
  bench.run_ms(100);
  REQUIRE(bench.motor.state() == MotorState::enabling);
  CHECK(bench.motor.counters().nmt_not_taken > 0);
  CHECK(std::none_of(bench.from_motor.begin(), bench.from_motor.end(),
                     [](const CanFrame& f) { return f.id == 0x201; }));
  bench.port.refused_id.reset();
  CHECK(bench.run_until(MotorState::running));
}

TEST_CASE(
    "fault: a drive in fault loses its power before the next attempt, the attempt begins with the node") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.node.raise_fault(0x2310);
  REQUIRE(bench.run_until(MotorState::recovering, 100));
  bench.node.is_present = false;
  bench.motor.on_tick(bench.now_ns);
  bench.run_ms(99);
  while (bench.motor.state() == MotorState::recovering) bench.step();
  // The PDOs' time-out is longer than the first delay: found out while enabling, or before.
  REQUIRE(bench.run_until(MotorState::recovering, 500));
  CHECK(bench.motor.reason_code() != MotorReason::fault_not_cleared);
  bench.node.is_present = true;
  bench.node.restart(bench.now_ns);
  CHECK(bench.run_until(MotorState::running, 5000));

  bench.node.raise_fault(0x2310);
  REQUIRE(bench.run_until(MotorState::recovering, 100));
  bench.node.is_present = false;
  bench.states.clear();
  bench.run_ms(600);  // the third delay is longer than the time-out
  REQUIRE(bench.states.size() >= 2);
  CHECK(bench.states[0] == MotorState::recovering);
  CHECK(bench.states[1] == MotorState::connecting);
}

TEST_CASE("late ticks and ticks out of order do no harm") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  bench.motor.on_tick(bench.now_ns - 5 * ns_per_s);
  bench.motor.on_tick(bench.now_ns);
  bench.motor.on_frame(CanFrame{.id = 0x701, .size = 1, .data = {0x05}}, bench.now_ns - 5 * ns_per_s);
  bench.run_ms(100);
  CHECK(bench.motor.state() == MotorState::running);
}

TEST_CASE("random frames with the drive's own identifiers do not break the motor") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  std::uint32_t seed = 99;
  const auto next = [&seed] {
    seed = seed * 1664525U + 1013904223U;
    return static_cast<std::uint8_t>(seed >> 24);
  };
  const std::uint32_t ids[] = {0x081, 0x181, 0x281, 0x581, 0x701, 0x080};
  for (int round = 0; round < 30000; ++round) {
    CanFrame frame{.id = ids[next() % 6], .size = static_cast<std::uint8_t>(next() % 9)};
    for (std::size_t byte = 0; byte < frame.size; ++byte) frame.data[byte] = next();
    if (frame.id == 0x701 && next() % 4 != 0) frame.data[0] = 5;
    bench.node.out.push_back(frame);
    bench.step();
  }
  CHECK(bench.motor.counters().failures > 0);
  bench.run_ms(1000);
  bench.motor.stop(bench.now_ns);
  REQUIRE(bench.run_until(MotorState::stopped, 5000));
  CHECK(bench.spin_up());
}

TEST_CASE("the same events give the same frames") {
  const auto drive = [] {
    auto bench = std::make_unique<MotorBench>();
    bench->spin_up();
    bench->node.raise_fault(0x2310);
    bench->run_ms(3000);
    return bench->from_motor;
  };
  CHECK(drive() == drive());
}

TEST_CASE("configurations that cannot work are refused with the reason") {
  const auto status = [](auto change) {
    MotorConfig config = motor_config();
    change(config);
    return validate(config);
  };
  using Status = MotorConfigStatus;
  CHECK(status([](MotorConfig&) {}) == Status::ok);
  CHECK(status([](MotorConfig& c) { c.node = 0; }) == Status::bad_node);
  CHECK(status([](MotorConfig& c) { c.node = 128; }) == Status::bad_node);
  CHECK(status([](MotorConfig& c) { c.own_node = 1; }) == Status::bad_node);
  CHECK(status([](MotorConfig& c) { c.sync.period_ns = -1; }) == Status::bad_period);
  CHECK(status([](MotorConfig& c) { c.sync.counter_overflow = 1; }) == Status::bad_period);
  CHECK(status([](MotorConfig& c) { c.heartbeat_timeout_ns = 100 * ns_per_ms; }) == Status::bad_heartbeat);
  CHECK(status([](MotorConfig& c) { c.writes = {{0x6083, 0, 5, 0}}; }) == Status::bad_write);
  CHECK(status([](MotorConfig& c) {
          c.tpdos = {c.tpdos[0], c.tpdos[0], c.tpdos[0], c.tpdos[0], c.tpdos[0]};
        }) == Status::table_overflow);
  CHECK(status([](MotorConfig& c) { c.tpdos[0].entries = {}; }) == Status::bad_pdo);
  CHECK(status([](MotorConfig& c) { c.rpdos_to_disable = {c.rpdos[0]}; }) == Status::ok);
  CHECK(status([](MotorConfig& c) {
          c.rpdos_to_disable = {c.rpdos[0]};
          c.rpdos_to_disable[0].number = 0;
        }) == Status::bad_pdo);
  CHECK(status([](MotorConfig& c) { c.tpdos[1].number = 1; }) == Status::same_cob_id);
  CHECK(status([](MotorConfig& c) { c.tpdos = {c.tpdos[0]}; }) == Status::missing_in_tpdos);
  CHECK(status([](MotorConfig& c) { c.rpdos[0].entries = {{0x6040, 0, 16}}; }) == Status::missing_in_rpdos);
  CHECK(status([](MotorConfig& c) {
          c.rpdos[0].entries = {{0x6040, 0, 16}, {0x60FF, 0, 32}, {0x607A, 0, 16}};
        }) == Status::foreign_in_rpdos);
  CHECK(status([](MotorConfig& c) { c.tpdos[0].transmission_type = 255; }) == Status::pdo_never_comes);
  CHECK(status([](MotorConfig& c) { c.tpdos[1].transmission_type = 0; }) == Status::pdo_never_comes);
  CHECK(status([](MotorConfig& c) { c.tpdos[1].transmission_type = 20; }) == Status::pdo_timeout_too_short);
  CHECK(status([](MotorConfig& c) { c.sync.period_ns = 200 * ns_per_ms; }) == Status::pdo_timeout_too_short);
  CHECK(status([](MotorConfig& c) { c.target_velocity_units = 0; }) == Status::bad_speed);
  CHECK(status([](MotorConfig& c) { c.target_velocity_units = INT32_MIN; }) == Status::ok);
  CHECK(status([](MotorConfig& c) { c.velocity_tolerance_units = 4000; }) == Status::bad_speed);
  CHECK(status([](MotorConfig& c) { c.stall_velocity_units = 3900; }) == Status::bad_speed);
  CHECK(status([](MotorConfig& c) { c.ramp_units_per_s = 100; }) == Status::ramp_too_slow);
  CHECK(status([](MotorConfig& c) { c.back_off.first_ns = 0; }) == Status::bad_back_off);
  CHECK(status([](MotorConfig& c) { c.permit.source = PermitSource::can; }) == Status::bad_permit);
  CHECK(status([](MotorConfig& c) {
          c.permit.source = PermitSource::can;
          c.permit.cob_id = 0x7F0;
        }) == Status::ok);
  CHECK(status([](MotorConfig& c) {
          c.permit.source = PermitSource::socket;
          c.permit.timeout_ns = 0;
        }) == Status::bad_permit);

  MotorConfig config = motor_config();
  config.target_velocity_units = 0;
  MotorBench bench(config);
  bench.motor.start(0);
  bench.run_ms(100);
  CHECK(bench.motor.state() == MotorState::failed);
  CHECK(bench.motor.reason_code() == MotorReason::bad_configuration);
  CHECK(bench.from_motor.empty());
}

TEST_CASE("every counter of a motor has a name of its own") {
  MotorBench bench;
  REQUIRE(bench.spin_up());
  std::set<std::string> names;
  std::uint64_t sum = 0;
  std::size_t count = 0;
  bench.motor.counters().visit([&](const char* name, std::uint64_t value) {
    names.insert(name);
    sum += value;
    ++count;
  });
  CHECK(names.size() == count);
  CHECK(count * sizeof(std::uint64_t) == sizeof(Motor::Counters));
  CHECK(sum > 0);
  CHECK(sizeof(Motor) < 12 * 1024);
}

TEST_CASE("a drive is begun without a reset when the configuration says so") {
  MotorConfig config = motor_config();
  config.reset = MotorReset::none;
  config.own_heartbeat_period_ns = 100 * ns_per_ms;
  config.own_heartbeat_timeout_ms = 300;
  canopen::PdoConfig unwanted;
  unwanted.number = 3;
  unwanted.forbids_remote_frames = true;
  config.tpdos_to_disable = {unwanted};
  MotorBench bench(config);
  REQUIRE(bench.spin_up());
  CHECK(bench.node.boots == 0);
  CHECK(bench.orders.front().data[0] == 0x80);
  CHECK(bench.node.get(0x1016, 1) == 0x007F012C);
  CHECK(bench.node.get(0x1802, 1) == 0xC0000381);
  CHECK(std::any_of(bench.from_motor.begin(), bench.from_motor.end(),
                    [](const CanFrame& f) { return f.id == 0x77F; }));
}
