#include "alces_platform/linux/clock_bridge.h"

#include <catch2/catch.hpp>

#include "linux_support.h"

using alces::ClockBridge;
using alces::ns_per_ms;
using alces::ns_per_s;
using alces::ns_per_us;
using alces::test::FakeClocks;

TEST_CASE("a realtime stamp becomes the monotonic time of the same moment") {
  FakeClocks clocks;
  ClockBridge bridge(clocks);
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t happened_ns = clocks.monotonic;
    const std::int64_t stamp_ns = clocks.stamp_now();
    clocks.pass(300 * ns_per_us);
    CHECK(bridge.monotonic_ns(stamp_ns, clocks.monotonic) == happened_ns);
    clocks.pass(5 * ns_per_ms);
  }
  CHECK(bridge.counters().steps == 0);
  CHECK(bridge.counters().future_stamps == 0);
  CHECK(bridge.counters().stale_stamps == 0);
}

TEST_CASE("the error of a converted stamp is at most half the time it takes to read the clocks") {
  FakeClocks clocks;
  clocks.reading_ns = 2 * ns_per_us;
  ClockBridge bridge(clocks);
  clocks.pass(ns_per_ms);
  const std::int64_t happened_ns = clocks.monotonic;
  const std::int64_t stamp_ns = clocks.stamp_now();
  clocks.pass(ns_per_ms);
  CHECK(std::abs(bridge.monotonic_ns(stamp_ns, clocks.monotonic) - happened_ns) <= 2 * ns_per_us);
}

TEST_CASE("stamps stay right over a step of the clock, before and after it") {
  const auto step_ns = GENERATE(as<std::int64_t>{}, 3600 * ns_per_s, -3600 * ns_per_s, 300 * ns_per_ms,
                                -300 * ns_per_ms, 20 * ns_per_ms, -20 * ns_per_ms, 40'000'000 * ns_per_s);
  CAPTURE(step_ns);
  FakeClocks clocks;
  ClockBridge bridge(clocks);
  REQUIRE(bridge.monotonic_ns(clocks.stamp_now(), clocks.monotonic) == clocks.monotonic);

  // One frame is stamped before the step and read after it, one is stamped after it.
  const std::int64_t before_ns = clocks.monotonic;
  const std::int64_t stamp_before_ns = clocks.stamp_now();
  clocks.pass(ns_per_ms);
  clocks.offset += step_ns;
  const std::int64_t after_ns = clocks.monotonic;
  const std::int64_t stamp_after_ns = clocks.stamp_now();
  clocks.pass(ns_per_ms);
  SECTION("in the order of the queue") {
    CHECK(bridge.monotonic_ns(stamp_before_ns, clocks.monotonic) == before_ns);
    CHECK(bridge.monotonic_ns(stamp_after_ns, clocks.monotonic) == after_ns);
  }
  SECTION("the other way round") {
    CHECK(bridge.monotonic_ns(stamp_after_ns, clocks.monotonic) == after_ns);
    CHECK(bridge.monotonic_ns(stamp_before_ns, clocks.monotonic) == before_ns);
  }
  clocks.pass(2 * ns_per_s);
  CHECK(bridge.monotonic_ns(clocks.stamp_now(), clocks.monotonic) == clocks.monotonic);
  CHECK(bridge.counters().steps == 1);
  CHECK(bridge.counters().future_stamps == 0);
  CHECK(bridge.counters().stale_stamps == 0);
}

TEST_CASE("a clock that is slewed is followed and not taken for one that steps") {
  FakeClocks clocks;
  ClockBridge bridge(clocks);
  for (int i = 0; i < 10'000; ++i) {
    clocks.pass(ns_per_ms);
    clocks.offset += 500;  // 500 ppm
    const std::int64_t converted_ns = bridge.monotonic_ns(clocks.stamp_now(), clocks.monotonic);
    REQUIRE(clocks.monotonic - converted_ns >= 0);
    REQUIRE(clocks.monotonic - converted_ns <= 10 * ns_per_us);
  }
  CHECK(bridge.counters().steps == 0);
  CHECK(bridge.counters().future_stamps == 0);
}

TEST_CASE("absurd stamps fall back to the time of arrival and are counted") {
  FakeClocks clocks;
  ClockBridge bridge(clocks);
  const std::int64_t arrival_ns = clocks.monotonic;
  CHECK(bridge.monotonic_ns(clocks.stamp_now() + ns_per_s, arrival_ns) == arrival_ns);
  CHECK(bridge.monotonic_ns(INT64_MAX, arrival_ns) == arrival_ns);
  CHECK(bridge.counters().future_stamps == 2);
  CHECK(bridge.monotonic_ns(clocks.stamp_now() - 2 * ns_per_s, arrival_ns) == arrival_ns);
  CHECK(bridge.monotonic_ns(0, arrival_ns) == arrival_ns);
  CHECK(bridge.monotonic_ns(INT64_MIN, arrival_ns) == arrival_ns);
  CHECK(bridge.counters().stale_stamps == 3);
  CHECK(bridge.monotonic_ns(clocks.stamp_now() - ns_per_s / 2, arrival_ns) == arrival_ns - ns_per_s / 2);
}

TEST_CASE("the machine's own clocks agree with the bridge") {
  ClockBridge bridge(alces::system_clocks);
  for (int i = 0; i < 100; ++i) {
    const std::int64_t before_ns = alces::now_ns();
    const std::int64_t stamp_ns = alces::system_clocks.realtime_ns();
    const std::int64_t arrival_ns = alces::now_ns();
    const std::int64_t converted_ns = bridge.monotonic_ns(stamp_ns, arrival_ns);
    CHECK(converted_ns <= arrival_ns);
    CHECK(converted_ns > before_ns - 5 * ns_per_ms);
  }
}
