// Who lets the head turn: the permit by itself, and the motor that obeys it.
#include "alces_drivers/motor/permit.h"

#include <catch2/catch.hpp>
#include <functional>

#include "support/motor_bench.h"

using namespace alces;
using alces::test::motor_config;
using alces::test::MotorBench;
using cia402::State;

namespace {

constexpr std::uint16_t permit_id = 0x7F0;

CanFrame message(bool is_on) {
  CanFrame frame{.id = permit_id, .size = 2};
  frame.data[1] = is_on ? 0x04 : 0x00;
  return frame;
}

MotorConfig with(PermitSource source) {
  MotorConfig config = motor_config();
  config.permit.source = source;
  config.permit.timeout_ns = 200 * ns_per_ms;
  config.permit.line = 3;
  config.permit.cob_id = permit_id;
  config.permit.byte = 1;
  config.permit.mask = 0x04;
  config.permit.value = 0x04;
  return config;
}

/// A person with a switch: repeats its position every 50 ms as messages, or moves a line.
struct Switch {
  MotorBench& bench;
  PermitSource source;
  bool is_on = false;
  bool speaks = true;
  std::int64_t since_ms = 0;

  void set(bool on) {
    is_on = on;
    if (source == PermitSource::gpio) bench.motor.on_edge({3, on, 0}, bench.now_ns);
    speak();
  }
  void speak() {
    if (!speaks || source == PermitSource::gpio) return;
    if (source == PermitSource::can) bench.motor.on_frame(message(is_on), bench.now_ns);
    if (source == PermitSource::socket) bench.motor.on_permit(is_on, bench.now_ns);
  }
  void run_ms(std::int64_t ms) {
    for (std::int64_t i = 0; i < ms; ++i) {
      bench.step();
      if (++since_ms % 50 == 0) speak();
    }
  }
  bool run_until(MotorState state, std::int64_t limit_ms = 10000) {
    for (std::int64_t i = 0; i < limit_ms && bench.motor.state() != state; ++i) run_ms(1);
    return bench.motor.state() == state;
  }
  /// Off, on, at speed.
  bool spin_up() {
    bench.motor.start(bench.now_ns);
    run_ms(300);
    set(false);
    run_ms(100);
    set(true);
    return run_until(MotorState::running);
  }
};

bool is_shaft_free(const MotorBench& bench) {
  return bench.node.velocity_units == 0 && cia402::has_no_torque(bench.node.drive);
}

const PermitSource sources[] = {PermitSource::gpio, PermitSource::can, PermitSource::socket};

}  // namespace

TEST_CASE("without a permit the drive is disabled, and is never enabled") {
  for (const PermitSource source : sources) {
    MotorBench bench(with(source));
    bench.node.drive = State::switched_on;  // as somebody left it
    bench.motor.start(0);
    bench.run_ms(20000);
    CHECK(bench.motor.state() == MotorState::held);
    CHECK(bench.motor.reason_code() == MotorReason::waits_for_permit);
    CHECK(is_shaft_free(bench));
    CHECK(std::none_of(bench.node.walked.begin(), bench.node.walked.end(),
                       [](State state) { return state == State::operation_enabled; }));
    CHECK(bench.notices.count("no torque and stands") == 1);
    CHECK(bench.motor.counters().failures == 0);
  }
}

TEST_CASE("a permit's edge lets the head turn, and a permit that goes stops it by quick stop") {
  for (const PermitSource source : sources) {
    MotorBench bench(with(source));
    Switch person{bench, source};
    REQUIRE(person.spin_up());
    bench.node.walked.clear();
    person.set(false);
    CHECK(bench.motor.state() == MotorState::held);  // at once
    CHECK(bench.motor.reason_code() == MotorReason::permit_gone);
    person.run_ms(400);
    CHECK(bench.node.walked == std::vector<State>{State::quick_stop_active, State::switch_on_disabled});
    CHECK(is_shaft_free(bench));
    CHECK(bench.notices.count("no torque and stands") >= 1);
    person.run_ms(60000);
    CHECK(is_shaft_free(bench));
    person.set(true);  // a new one
    CHECK(person.run_until(MotorState::running));
    CHECK(bench.motor.counters().permit.given == 2);
  }
}

TEST_CASE("a level that is on at the start is no edge") {
  for (const PermitSource source : {PermitSource::can, PermitSource::socket}) {
    MotorBench bench(with(source));
    Switch person{bench, source};
    person.is_on = true;
    SECTION("since before the start") {
      person.run_ms(500);
    }
    SECTION("since the start") {}
    SECTION("a permit of before the start") {
      person.set(false);
      person.run_ms(100);
      person.set(true);
      person.run_ms(100);
    }
    bench.motor.start(bench.now_ns);
    person.run_ms(10000);
    CHECK(bench.motor.state() == MotorState::held);
    CHECK(is_shaft_free(bench));
    CHECK(bench.motor.counters().permit.without_edge >= 1);
    person.set(false);
    person.set(true);
    CHECK(person.run_until(MotorState::running));
  }
}

TEST_CASE("messages that stay away take the permit, and coming back on gives none") {
  for (const PermitSource source : {PermitSource::can, PermitSource::socket}) {
    MotorBench bench(with(source));
    Switch person{bench, source};
    REQUIRE(person.spin_up());
    person.speaks = false;
    person.run_ms(255);  // 200, and what had passed since the last one
    CHECK(bench.motor.state() == MotorState::held);
    CHECK(bench.motor.counters().permit.timed_out == 1);
    person.run_ms(2000);
    CHECK(is_shaft_free(bench));
    person.speaks = true;  // the cable is mended; the switch is still on
    person.run_ms(5000);
    CHECK(bench.motor.state() == MotorState::held);
    CHECK(is_shaft_free(bench));
    person.set(false);
    person.run_ms(100);
    person.set(true);
    CHECK(person.run_until(MotorState::running));
  }
}

TEST_CASE("a line that bounces gives a permit only once it is quiet") {
  MotorBench bench(with(PermitSource::gpio));
  bench.motor.start(0);
  bench.run_ms(500);
  for (int bounce = 0; bounce < 20; ++bounce) {
    bench.motor.on_edge({3, true, 0}, bench.now_ns);
    bench.run_ms(10);
    bench.motor.on_edge({3, false, 0}, bench.now_ns);
    bench.run_ms(10);
  }
  CHECK(bench.motor.counters().permit.given == 0);
  bench.motor.on_edge({2, true, 0}, bench.now_ns);  // another line
  bench.run_ms(100);
  CHECK(bench.motor.counters().permit.given == 0);
  bench.motor.on_edge({3, true, 0}, bench.now_ns);
  CHECK(bench.run_until(MotorState::running));
}

TEST_CASE("a line that gives the permit when it is low") {
  MotorConfig config = with(PermitSource::gpio);
  config.permit.is_active_low = true;
  MotorBench bench(config);
  bench.motor.start(0);
  bench.run_ms(500);
  bench.motor.on_edge({3, true, 0}, bench.now_ns);
  bench.run_ms(1000);
  CHECK(bench.motor.state() == MotorState::held);
  bench.motor.on_edge({3, false, 0}, bench.now_ns);
  CHECK(bench.run_until(MotorState::running));
}

TEST_CASE("edges that were lost, a machine that was suspended and ticks that stayed away take the permit") {
  MotorBench bench(with(PermitSource::gpio));
  Switch person{bench, PermitSource::gpio};
  REQUIRE(person.spin_up());
  SECTION("edges lost") {
    bench.motor.on_edges_lost(2, bench.now_ns);
    CHECK(bench.motor.state() == MotorState::running);
    bench.motor.on_edges_lost(3, bench.now_ns);
  }
  SECTION("suspended") {
    bench.motor.on_resumed(bench.now_ns);
  }
  SECTION("no ticks") {
    bench.now_ns += 600 * ns_per_ms;
    bench.motor.on_tick(bench.now_ns);
  }
  CHECK(bench.motor.state() == MotorState::held);
  CHECK(bench.motor.counters().permit.not_watched == 1);
  bench.run_ms(5000);
  CHECK(bench.motor.state() == MotorState::held);
  CHECK(is_shaft_free(bench));
  person.set(false);
  person.set(true);
  CHECK(bench.run_until(MotorState::running));
}

TEST_CASE("a permit that goes while the drive is brought up, or is not heard, stops it all the same") {
  for (const std::int64_t ms : {3, 20, 52, 60, 70, 80, 100, 130, 200, 400, 800}) {
    MotorBench bench(with(PermitSource::gpio));
    bench.motor.start(0);
    bench.run_ms(300);
    bench.motor.on_edge({3, true, 0}, bench.now_ns);
    bench.run_ms(20 + ms);
    bench.motor.on_edge({3, false, 0}, bench.now_ns);
    CHECK(bench.motor.state() == MotorState::held);
    bench.run_ms(1500);
    INFO(ms);
    CHECK(is_shaft_free(bench));
    CHECK(bench.motor.state() == MotorState::held);
  }
  MotorBench bench(with(PermitSource::gpio));
  Switch person{bench, PermitSource::gpio};
  REQUIRE(person.spin_up());
  bench.node.is_present = false;
  bench.run_ms(500);
  REQUIRE(bench.motor.state() != MotorState::running);
  person.set(false);
  bench.run_ms(3000);
  CHECK(bench.node.velocity_units == 4000);  // nobody can be told
  bench.node.is_present = true;
  bench.run_ms(2000);
  CHECK(is_shaft_free(bench));
}

TEST_CASE("a motor that was given up is reset by a new permit, not by an order, a boot-up or the bus") {
  MotorBench bench(with(PermitSource::can));
  Switch person{bench, PermitSource::can};
  REQUIRE(person.spin_up());
  bench.node.is_fault_for_ever = true;
  bench.node.raise_fault(0x3210);
  REQUIRE(person.run_until(MotorState::failed, 20000));
  bench.node.is_fault_for_ever = false;
  bench.motor.reset(bench.now_ns);
  person.run_ms(10000);
  CHECK(bench.motor.state() == MotorState::failed);
  bench.node.restart(bench.now_ns);
  person.run_ms(10000);
  bench.motor.on_link(false, bench.now_ns);
  person.run_ms(100);
  bench.motor.on_link(true, bench.now_ns);
  person.run_ms(10000);
  CHECK(bench.motor.state() == MotorState::failed);
  CHECK(is_shaft_free(bench));
  person.set(false);
  person.run_ms(1000);
  CHECK(bench.motor.state() == MotorState::failed);
  person.set(true);
  CHECK(person.run_until(MotorState::running));
}

TEST_CASE("a permit survives transient faults, and their attempts are limited") {
  MotorBench bench(with(PermitSource::can));
  Switch person{bench, PermitSource::can};
  REQUIRE(person.spin_up());
  bench.node.raise_fault(0x3210);
  REQUIRE(person.run_until(MotorState::recovering));
  CHECK(person.run_until(MotorState::running));
  CHECK(bench.motor.counters().permit.given == 1);
}

TEST_CASE("a held motor stops in order, and messages that are too short are counted") {
  MotorBench bench(with(PermitSource::can));
  Switch person{bench, PermitSource::can};
  REQUIRE(person.spin_up());
  bench.motor.on_frame(CanFrame{.id = permit_id, .size = 1}, bench.now_ns);
  CHECK(bench.motor.counters().permit.malformed == 1);
  person.set(false);
  person.run_ms(20);
  bench.motor.stop(bench.now_ns);
  person.set(true);  // too late
  REQUIRE(person.run_until(MotorState::stopped, 3000));
  CHECK(is_shaft_free(bench));
  person.run_ms(1000);
  CHECK(is_shaft_free(bench));
}
