#include "alces_platform/linux/can/can_bus.h"

#include <linux/can/error.h>

#include <catch2/catch.hpp>

#include "linux_support.h"

using namespace alces;
using alces::test::LoopBench;

namespace {

CanFrame error_frame(std::uint32_t classes, std::uint8_t controller = 0) {
  return {.id = classes, .size = 8, .is_error = true, .data = {0, controller}};
}

struct BusBench : LoopBench {
  CanBus bus{loop, "can0", 3};
  std::int64_t now = 1000 * ns_per_s;

  BusBench() { bus.on_interface(true, true, now); }
  [[nodiscard]] std::vector<bool> links() const {
    std::vector<bool> result;
    for (const auto& kept : sink.of(EventKind::can_link)) result.push_back(kept.event.is_up);
    return result;
  }
};

}  // namespace

TEST_CASE("every frame is an event with its stamp and channel, error frames too") {
  BusBench bench;
  bench.bus.on_frame({.id = 0x181, .size = 2, .data = {1, 2}}, 77);
  bench.bus.on_frame(error_frame(CAN_ERR_LOSTARB), 78);
  const auto events = bench.sink.of(EventKind::can_frame);
  REQUIRE(events.size() == 2);
  CHECK(events[0].event.stamp_ns == 77);
  CHECK(events[0].event.channel == 3);
  CHECK(events[0].event.frame.id == 0x181);
  CHECK(events[1].event.frame.is_error);
  CHECK(bench.bus.counters().frames == 1);
  CHECK(bench.bus.counters().error_frames == 1);
  CHECK(bench.bus.counters().lost_arbitrations == 1);
}

TEST_CASE("bus-off takes the link down once, a restart brings it up") {
  BusBench bench;
  CHECK(bench.links() == std::vector{true});
  bench.bus.on_frame(error_frame(CAN_ERR_BUSOFF), bench.now);
  bench.bus.on_frame(error_frame(CAN_ERR_BUSOFF), bench.now + 1);
  CHECK(bench.bus.state() == CanBusState::bus_off);
  CHECK(bench.links() == std::vector{true, false});
  CHECK(bench.notices.count("bus-off") == 1);
  bench.bus.on_frame(error_frame(CAN_ERR_RESTARTED), bench.now + 2);
  CHECK(bench.bus.state() == CanBusState::error_active);
  CHECK(bench.links() == std::vector{true, false, true});
  CHECK(bench.bus.counters().bus_offs == 1);
  CHECK(bench.bus.counters().restarts == 1);
}

TEST_CASE("after bus-off the interface's flags are believed only when they had time to follow") {
  BusBench bench;
  bench.bus.on_frame(error_frame(CAN_ERR_BUSOFF), bench.now);
  bench.bus.on_interface(true, true, bench.now + ns_per_s);
  CHECK_FALSE(bench.bus.is_up());
  bench.bus.on_interface(true, true, bench.now + 3 * ns_per_s);
  CHECK(bench.bus.is_up());
}

TEST_CASE("a frame received is proof that the bus is up, whatever was missed") {
  BusBench bench;
  bench.bus.on_frame(error_frame(CAN_ERR_BUSOFF), bench.now);
  bench.bus.on_frame({.id = 0x701, .size = 1}, bench.now + 1);
  CHECK(bench.bus.state() == CanBusState::error_active);
}

TEST_CASE("a missed bus-off shows in the interface's flags, and so does an interface that is down") {
  BusBench bench;
  bench.bus.on_interface(true, false, bench.now);
  CHECK(bench.bus.state() == CanBusState::bus_off);
  bench.bus.on_interface(false, false, bench.now + 1);
  CHECK(bench.bus.state() == CanBusState::down);
  bench.bus.on_interface(true, true, bench.now + 2);
  CHECK(bench.bus.is_up());
  CHECK(bench.links() == std::vector{true, false, true});
}

TEST_CASE("error-passive is no loss of the link, and a flood of it is one notice") {
  BusBench bench;
  for (int i = 0; i < 1000; ++i) {
    bench.bus.on_frame(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE), bench.now + i * ns_per_ms);
    if (i % 2 == 0)
      bench.bus.on_frame(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE), bench.now + i * ns_per_ms);
  }
  CHECK(bench.bus.is_up());
  CHECK(bench.links() == std::vector{true});
  CHECK(bench.notices.count("error-passive") == 1);
  CHECK(bench.bus.counters().error_passives == 501);
  CHECK(bench.sink.of(EventKind::can_frame).size() == 1500);
}

TEST_CASE("a bus on which nobody acknowledges says so, not a thousand times") {
  BusBench bench;
  for (int i = 0; i < 1000; ++i) bench.bus.on_frame(error_frame(CAN_ERR_ACK), bench.now + i);
  CHECK(bench.notices.count("acknowledges") == 1);
  CHECK(bench.bus.counters().missing_acknowledges == 1000);
}
