#include "alces_platform/linux/gpio/gpio_lines.h"

#include <sys/stat.h>

#include <catch2/catch.hpp>

#include "linux_support.h"

using namespace alces;
using alces::test::FakeClocks;
using alces::test::LoopBench;

TEST_CASE("numbered edges: a gap is the number of edges lost") {
  EdgeCheck check;
  CHECK_FALSE(check.missing_before({.sequence = 1}));
  CHECK_FALSE(check.missing_before({.is_rising = false, .sequence = 2}));
  CHECK(check.missing_before({.is_rising = false, .sequence = 10}) == 7U);
  CHECK_FALSE(check.missing_before({.sequence = 11}));
}

TEST_CASE("numbered edges: those lost before the first one read are known, too") {
  EdgeCheck check;
  CHECK(check.missing_before({.sequence = 5}) == 4U);
  check.restart();
  CHECK_FALSE(check.missing_before({.sequence = 1}));
}

TEST_CASE("numbered edges: a number twice or backwards is a loss of unknown size") {
  EdgeCheck check;
  CHECK_FALSE(check.missing_before({.sequence = 1}));
  CHECK(check.missing_before({.sequence = 1}) == 0U);
  CHECK_FALSE(check.missing_before({.sequence = 2}));
}

TEST_CASE("unnumbered edges: two of the same direction have lost the one between") {
  EdgeCheck check;
  CHECK_FALSE(check.missing_before({.is_rising = true}));
  CHECK_FALSE(check.missing_before({.is_rising = false}));
  CHECK(check.missing_before({.is_rising = false}) == 0U);
  CHECK_FALSE(check.missing_before({.is_rising = true}));
  check.restart();
  CHECK_FALSE(check.missing_before({.is_rising = true}));
}

TEST_CASE("unnumbered edges of one direction only say nothing about losses") {
  EdgeCheck check(false);
  CHECK_FALSE(check.missing_before({.is_rising = true}));
  CHECK_FALSE(check.missing_before({.is_rising = true}));
}

TEST_CASE("an edge's stamp is monotonic on today's kernels and realtime on those before 5.7") {
  FakeClocks clocks;
  ClockBridge bridge(clocks);
  std::uint64_t implausible = 0;
  const std::int64_t now = clocks.monotonic;
  CHECK(edge_stamp_ns(now - 3 * ns_per_ms, now, bridge, implausible) == now - 3 * ns_per_ms);
  CHECK(edge_stamp_ns(now, now, bridge, implausible) == now);
  CHECK(edge_stamp_ns(clocks.stamp_now() - 2 * ns_per_ms, now, bridge, implausible) == now - 2 * ns_per_ms);
  CHECK(implausible == 0);
  CHECK(edge_stamp_ns(0, now, bridge, implausible) == now);
  CHECK(edge_stamp_ns(-5, now, bridge, implausible) == now);
  CHECK(edge_stamp_ns(now + ns_per_s, now, bridge, implausible) == now);
  CHECK(edge_stamp_ns(INT64_MAX, now, bridge, implausible) == now);
  CHECK(implausible == 4);
}

TEST_CASE("a chip that is not there, or is none, is named with what to do") {
  Name path;
  Message error;
  CHECK_FALSE(find_gpio_chip("/dev/gpiochip250", path, error));
  CHECK(std::string(error.text()) == "/dev/gpiochip250: no such GPIO chip; `gpiodetect` lists them");
  CHECK_FALSE(find_gpio_chip("250", path, error));
  CHECK(std::string(error.text()).find("/dev/gpiochip250: ") == 0);
  CHECK_FALSE(find_gpio_chip("gpiochip250", path, error));
  CHECK(std::string(error.text()).find("/dev/gpiochip250: ") == 0);
  CHECK_FALSE(find_gpio_chip("no-such-label", path, error));
  CHECK(std::string(error.text()).find("no-such-label: no GPIO chip has this label") == 0);
  CHECK_FALSE(find_gpio_chip("/dev/null", path, error));
  CHECK(std::string(error.text()).find("/dev/null: is no GPIO chip") == 0);
}

TEST_CASE("lines of an absent chip are refused with a sentence, and waiting for them costs nothing") {
  LoopBench bench;
  const std::vector<GpioLine> lines{{.line = "17"}, {.line = "encoder-index", .edges = GpioEdges::rising}};
  GpioLines gpio(bench.loop, {.chip = "gpiochip250", .lines = lines});
  CHECK_FALSE(gpio.open());
  CHECK_FALSE(gpio.is_open());
  CHECK(std::string(gpio.error()).find("gpiochip250") != std::string::npos);
  bench.run_for(50 * ns_per_ms);
  CHECK(bench.sink.of(EventKind::edge).empty());
}

TEST_CASE("no lines, or more than can be, are refused") {
  LoopBench bench;
  GpioLines none(bench.loop, {.chip = "gpiochip0"});
  CHECK_FALSE(none.open());
  const std::vector<GpioLine> many(GpioRequest::line_capacity + 1, GpioLine{.line = "1"});
  GpioLines too_many(bench.loop, {.chip = "gpiochip0", .lines = many});
  CHECK_FALSE(too_many.open());
  CHECK(std::string(too_many.error()).find("between 1 and 8 lines") != std::string::npos);
}
