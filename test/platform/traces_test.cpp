// gpiomon's text, raw bytes, NMEA, their merging, and the pace of a replay.
#include <catch2/catch.hpp>

#include "alces_platform/replay/event_merger.h"
#include "alces_platform/replay/gpiomon.h"
#include "alces_platform/replay/nmea_trace.h"
#include "alces_platform/replay/player.h"
#include "alces_platform/replay/raw_bytes.h"
#include "trace_bench.h"

namespace alces::replay {
namespace {

TEST_CASE("gpiomon's text of libgpiod 1 and 2") {
  const TraceBench bench;
  const auto file = bench.write("gpio.txt",
                                "event:  RISING EDGE offset: 3 timestamp: [    1608.012345678]\n"
                                "event: FALLING EDGE offset: 3 timestamp: [12345678.000000001]\n"
                                "1608.012345678\trising\tgpiochip0 3\n"
                                "1608.012345678\tfalling\tgpiochip0 3 \"index\"\n"
                                "2015-07-10T06:17:32.249713001Z\trising\tgpiochip0 3\n"
                                "Monitoring lines 'index' and 'a'...\n"
                                "\"index\"=active \"a\"=inactive\n");
  GpiomonReader reader(file);
  const auto events = all_events(reader);
  CHECK(reader.problems().count == 0);
  REQUIRE(events.size() == 5);
  const std::vector<std::int64_t> stamps = {1'608'012'345'678, 12'345'678'000'000'001, 1'608'012'345'678,
                                            1'608'012'345'678, 1'436'509'052'249'713'001};
  for (std::size_t i = 0; i < events.size(); ++i) {
    CHECK(events[i].event.kind == EventKind::edge);
    CHECK(events[i].event.edge.line == 3);
    CHECK(events[i].event.edge.is_rising == (i % 2 == 0));
    CHECK(events[i].event.edge.sequence == 0);
    CHECK(events[i].event.stamp_ns == stamps[i]);
  }
}

TEST_CASE("edges on named lines, and lines in the configured order") {
  const TraceBench bench;
  const auto file = bench.write("gpio.txt",
                                "1.000000000\trising\t\"index\"\n"
                                "2.000000000\trising\tencoder a\n"
                                "3.000000000\trising\tgpiochip0 17\n"
                                "4.000000000\trising\tgpiochip1 5 \"other\"\n");
  GpiomonOptions options;
  options.lines = {"17", "index", "encoder a"};
  GpiomonReader reader(file, options);
  std::vector<int> lines;
  for (const sample::OwnedEvent& owned : all_events(reader)) lines.push_back(owned.event.edge.line);
  CHECK(lines == std::vector<int>{1, 2, 0});
  CHECK(reader.problems().count == 1);

  GpiomonReader unconfigured(file);
  CHECK(all_events(unconfigured).size() == 2);  // offsets say it, names do not
  CHECK(unconfigured.problems().count == 2);
}

TEST_CASE("lines that are no edges are counted and named") {
  const TraceBench bench;
  GpiomonReader reader(bench.write("gpio.txt",
                                   "event: SIDEWAYS EDGE offset: 3 timestamp: [1.0]\n"
                                   "event:  RISING EDGE offset: x timestamp: [1.0]\n"
                                   "event:  RISING EDGE offset: 300 timestamp: [1.0]\n"
                                   "event:  RISING EDGE offset: 3 timestamp: [1.0\n"
                                   "1.0\tup\tgpiochip0 3\n"
                                   "x\trising\tgpiochip0 3\n"
                                   "1.0\trising\n"
                                   "1.000000000\trising\tgpiochip0 3\n"
                                   "1.0000000000\trising\tgpiochip0 3\n"));
  CHECK(all_events(reader).size() == 1);
  CHECK(reader.problems().count == 8);
  CHECK_THAT(reader.problems().sentences[0], Catch::Contains("gpio.txt:1: "));
}

TEST_CASE("both forms of gpiomon's text carry an edge to the nanosecond") {
  const TraceBench bench;
  for (const GpiomonForm form : {GpiomonForm::libgpiod_1, GpiomonForm::libgpiod_2}) {
    Event edge;
    edge.kind = EventKind::edge;
    edge.stamp_ns = 1'608'012'345'678;
    edge.edge.line = 1;
    edge.edge.is_rising = false;
    std::string text;
    append_gpiomon(text, edge, "27", form);
    CHECK(text == (form == GpiomonForm::libgpiod_1
                       ? "event: FALLING EDGE offset: 27 timestamp: [    1608.012345678]\n"
                       : "1608.012345678\tfalling\tgpiochip0 27\n"));
    GpiomonOptions options;
    options.lines = {"17", "27"};
    GpiomonReader reader(bench.write("edge.txt", text), options);
    Event back;
    REQUIRE(reader.next(back));
    CHECK(sample::same(back, edge));
  }
}

TEST_CASE("raw bytes come in the pieces and at the times that were recorded") {
  const TraceBench bench;
  const auto bytes = bench.write("laser_b.bin", "abcdefg");
  const auto times = bench.write("laser_b.times", "# stamp_ns byte_count\n1000 3\n2000 0\n2500 4\n");
  RawBytesOptions options;
  options.channel = laser_b_channel;
  options.is_sent = true;
  RawBytesReader reader(bytes, times, options);
  const auto events = all_events(reader);
  CHECK(reader.problems().count == 0);
  REQUIRE(events.size() == 3);
  CHECK(events[0].event.kind == EventKind::bytes_sent);
  CHECK(events[0].event.channel == laser_b_channel);
  CHECK(std::string(events[0].bytes.begin(), events[0].bytes.end()) == "abc");
  CHECK(events[1].bytes.empty());
  CHECK(events[1].event.stamp_ns == 2000);
  CHECK(std::string(events[2].bytes.begin(), events[2].bytes.end()) == "defg");
}

TEST_CASE("raw bytes without times come at the pace of their line") {
  const TraceBench bench;
  RawBytesOptions options;
  options.baud = 38'400;
  options.begin_ns = 5 * ns_per_s;
  RawBytesReader reader(bench.write("laser_a.bin", std::string(100, 'x')), bench.folder / "none.times",
                        options);
  const auto events = all_events(reader);
  REQUIRE(events.size() == 3);  // 38 bytes in 10 ms
  CHECK(events[0].bytes.size() == 38);
  CHECK(events[2].bytes.size() == 24);
  CHECK(events[2].event.stamp_ns ==
        5 * ns_per_s + 2 * 38 * 10 * ns_per_s / 38'400 + 24 * 10 * ns_per_s / 38'400);
}

TEST_CASE("times that do not fit the bytes are told, and no byte is lost") {
  const TraceBench bench;
  const auto bytes = bench.write("laser_a.bin", "abcdefg");
  RawBytesReader few(bytes, bench.write("few.times", "1000 3\nnonsense\n-1 x\n1 99999999999\n"), {});
  auto events = all_events(few);
  REQUIRE(events.size() == 2);
  CHECK(std::string(events[1].bytes.begin(), events[1].bytes.end()) == "defg");
  CHECK(few.problems().count == 4);
  RawBytesReader many(bytes, bench.write("many.times", "1000 3\n2000 10\n3000 5\n"), {});
  events = all_events(many);
  REQUIRE(events.size() == 2);
  CHECK(events[1].bytes.size() == 4);
  CHECK(many.problems().count == 2);
  CHECK_THAT(many.problems().sentences[0], Catch::Contains("many.times:2: the bytes end 6 bytes before"));
}

TEST_CASE("stamps at either end of 64 bits are told, and overflow nothing") {
  const TraceBench bench;
  const auto bytes = bench.write("laser_a.bin", "abcdefg");
  RawBytesReader late(bytes, bench.write("late.times", "9223372036854775807 3\n"), {});
  const auto events = all_events(late);
  REQUIRE(events.size() == 2);
  CHECK(events[1].event.stamp_ns == INT64_MAX);  // the rest comes after it

  EventMerger merger;
  merger.add(std::make_unique<RawBytesReader>(
                 bytes, bench.write("both.times", "-9223372036854775808 3\n9223372036854775807 4\n"),
                 RawBytesOptions{}),
             -ns_per_s);
  std::size_t pieces = 0;
  Event event;
  while (merger.next(event)) {
    CHECK(std::abs(event.stamp_ns) <= latest_stamp_ns);
    if (event.kind == EventKind::bytes) ++pieces;
  }
  CHECK(pieces == 2);
  CHECK_THAT(merger.problems().sentences.front(), Catch::Contains("a stamp beyond 73 years"));
}

TEST_CASE("NMEA sentences come at their own time of day, or at the one written before them") {
  const TraceBench bench;
  NmeaTraceReader reader(
      bench.write("gps.nmea",
                  "$GPGGA,235959.50,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n"
                  "$GPGSV,3,1,11,03,03,111,00*74\n"
                  "$GPRMC,000000.25,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W*6A\n"
                  "nonsense\n"
                  "$GPRMC,000000,A*6A\n"));
  const auto events = all_events(reader);
  REQUIRE(events.size() == 4);
  CHECK(events[0].event.channel == gps_channel);
  CHECK(events[0].event.stamp_ns == 0);
  CHECK(events[1].event.stamp_ns == 0);
  CHECK(events[2].event.stamp_ns == 750 * ns_per_ms);
  CHECK(events[3].event.stamp_ns == 750 * ns_per_ms);  // the receiver's clock went back
  CHECK(std::string(events[0].bytes.end() - 2, events[0].bytes.end()) == "\r\n");
  CHECK(reader.problems().count == 1);

  NmeaTraceReader stamped(
      bench.write("stamped.nmea",
                  "1608.5 $GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\n"
                  "(1609.000000001) $GPGGA,123520,4807.038,N,01131.000,E,1*47\n"));
  const auto with_stamps = all_events(stamped);
  REQUIRE(with_stamps.size() == 2);
  CHECK(with_stamps[0].event.stamp_ns == 1'608'500'000'000);
  CHECK(with_stamps[1].event.stamp_ns == 1'609'000'000'001);
  CHECK(with_stamps[1].bytes.front() == '$');
}

/// Edges at given stamps, told apart by their line.
class ListSource final : public EventSource {
 public:
  ListSource(std::string name, std::uint8_t line, std::vector<std::int64_t> stamps_ns)
      : name_(std::move(name)), line_(line), stamps_ns_(std::move(stamps_ns)) {}
  bool next(Event& event) override {
    if (at_ == stamps_ns_.size()) return false;
    event = {};
    event.kind = EventKind::edge;
    event.edge.line = line_;
    event.stamp_ns = stamps_ns_[at_++];
    return true;
  }
  std::string name() const override { return name_; }
  TraceProblems problems() const override { return {}; }
  std::uint64_t bytes_read() const override { return at_; }

 private:
  std::string name_;
  std::uint8_t line_;
  std::vector<std::int64_t> stamps_ns_;
  std::size_t at_ = 0;
};

std::string order_of(EventSource& source) {
  std::string order;
  for (const sample::OwnedEvent& owned : all_events(source)) {
    order += owned.event.kind == EventKind::tick ? "t" : std::to_string(owned.event.edge.line);
    order += std::to_string(owned.event.stamp_ns / ns_per_ms) + " ";
  }
  return order;
}

std::vector<std::int64_t> ms(std::vector<std::int64_t> stamps) {
  for (std::int64_t& stamp : stamps) stamp *= ns_per_ms;
  return stamps;
}

TEST_CASE("sources are merged by time, of equal stamps the earlier source first, with ticks between") {
  EventMerger merger;
  merger.add(std::make_unique<ListSource>("a", 1, ms({100, 105, 125})));
  merger.add(std::make_unique<ListSource>("b", 2, ms({95, 105, 105})), 5 * ns_per_ms);
  CHECK(order_of(merger) == "t100 1100 2100 1105 t110 2110 2110 t120 1125 ");
}

TEST_CASE("an event out of order within its source keeps its place and its stamp") {
  EventMerger merger({0, INT64_MAX, false});
  merger.add(std::make_unique<ListSource>("a", 1, ms({100, 90, 110})));
  merger.add(std::make_unique<ListSource>("b", 2, ms({95, 105})));
  CHECK(order_of(merger) == "295 1100 190 2105 1110 ");
}

TEST_CASE("clocks that do not fit each other are refused, or their starts aligned") {
  const auto fill = [](EventMerger& merger) {
    merger.add(
        std::make_unique<ListSource>("can0.log", 1, std::vector<std::int64_t>{1'436'509'052 * ns_per_s}));
    merger.add(std::make_unique<ListSource>("gpio.txt", 2, ms({7, 9})));
  };
  EventMerger merger;
  fill(merger);
  CHECK_THROWS_WITH(order_of(merger), Catch::Contains("can0.log") && Catch::Contains("gpio.txt") &&
                                          Catch::Contains("1436509051 s"));
  EventMergerOptions options;
  options.align_starts = true;
  EventMerger aligned(options);
  fill(aligned);
  CHECK(order_of(aligned) == "t0 10 20 22 ");
}

TEST_CASE("a clock that is set within a trace is taken out of it, in all sources alike, and told") {
  EventMergerOptions options;
  options.tick_interval_ns = 0;
  constexpr std::int64_t step_ms = 90'541 * std::int64_t{1'000'000};  // from a made-up 2021 to now
  EventMerger merger(options);
  merger.add(std::make_unique<ListSource>("can0.log", 1, ms({100, 120, step_ms + 140, step_ms + 160})));
  merger.add(std::make_unique<ListSource>("gpio.txt", 2, ms({110, 130, step_ms + 150, step_ms + 170})));
  CHECK(order_of(merger) == "1100 2110 1120 1120 2130 2130 1140 2150 ");
  REQUIRE(merger.problems().count == 2);
  CHECK_THAT(merger.problems().sentences[0],
             Catch::Contains("can0.log: its clock was set 90541000 s forward"));
  CHECK_THAT(merger.problems().sentences[1], Catch::Contains("gpio.txt"));

  EventMerger back(options);
  back.add(std::make_unique<ListSource>("can0.log", 1, ms({5'000, 5'020, 1'000, 1'020})));
  CHECK(order_of(back) == "15000 15020 15020 15040 ");
  CHECK_THAT(back.problems().sentences.at(0), Catch::Contains("4 s back"));
}

TEST_CASE("no sources, or empty ones, are no events") {
  EventMerger merger;
  Event event;
  CHECK_FALSE(merger.next(event));
  EventMerger empty;
  empty.add(std::make_unique<ListSource>("a", 1, std::vector<std::int64_t>{}));
  CHECK_FALSE(empty.next(event));
  CHECK_FALSE(empty.next(event));
}

/// Time passes by sleeping only.
class ClockByHand final : public ReplayClock {
 public:
  std::int64_t now_ns() override { return now; }
  void sleep_until(std::int64_t time_ns) override {
    longest_sleep = std::max(longest_sleep, time_ns - now);
    now = time_ns;
  }
  std::int64_t now = 1'000'000;
  std::int64_t longest_sleep = 0;
};

class TimesHandedOn final : public EventSink {
 public:
  explicit TimesHandedOn(ClockByHand& clock) : clock_(clock) {}
  void on_event(const Event& event) override {
    static_cast<void>(event);
    times_ms.push_back((clock_.now - 1'000'000) / ns_per_ms);
    clock_.now += delay_ns;
  }
  std::vector<std::int64_t> times_ms;
  std::int64_t delay_ns = 0;

 private:
  ClockByHand& clock_;
};

TEST_CASE("events are handed on at the recorded pace, a multiple of it, or at once") {
  for (const auto& [speed, expected] : std::vector<std::pair<double, std::vector<std::int64_t>>>{
           {1, {0, 100, 100, 400}}, {2, {0, 50, 50, 200}}, {0.5, {0, 200, 200, 800}}, {0, {0, 0, 0, 0}}}) {
    ListSource source("a", 1, ms({5000, 5100, 5050, 5400}));
    ClockByHand clock;
    TimesHandedOn sink(clock);
    PlayerOptions options;
    options.speed = speed;
    CHECK(play(source, sink, clock, options) == 4);
    CHECK(sink.times_ms == expected);
    CHECK(clock.longest_sleep <= 50 * ns_per_ms);
  }
}

TEST_CASE("what is late is handed on at once, and the pace is caught up with") {
  ListSource source("a", 1, ms({0, 100, 200, 300, 400}));
  ClockByHand clock;
  TimesHandedOn sink(clock);
  sink.delay_ns = 130 * ns_per_ms;
  PlayerOptions options;
  options.speed = 1;
  play(source, sink, clock, options);
  CHECK(sink.times_ms == std::vector<std::int64_t>{0, 130, 260, 390, 520});
}

TEST_CASE("a replay can be stopped while it waits") {
  ListSource source("a", 1, ms({0, 3'600'000}));
  ClockByHand clock;
  TimesHandedOn sink(clock);
  int asked = 0;
  PlayerOptions options;
  options.speed = 1;
  options.is_stopped = [&asked] { return ++asked > 10; };
  CHECK(play(source, sink, clock, options) == 1);
  CHECK(clock.now < ns_per_s);
}

}  // namespace
}  // namespace alces::replay
