// A drive as a folder of traces, and back.
#include "alces_platform/replay/trace_folder.h"

#include <catch2/catch.hpp>

#include "alces_platform/replay/recording_source.h"
#include "alces_platform/replay/trace_writer.h"
#include "recording_bench.h"
#include "trace_bench.h"

namespace alces::replay {
namespace {

constexpr std::uint32_t event_count = 500;

void write_sample(const std::filesystem::path& folder, TraceWriterOptions options = {}) {
  TraceFolderWriter writer(folder, options, sample::utc_offset_ns);
  writer.write_configuration(sample::configuration);
  for (std::uint32_t i = 0; i < event_count; ++i) {
    sample::OwnedEvent owned = sample::event_at(i);
    owned.event.bytes = owned.bytes;
    writer.on_event(owned.event);
  }
  writer.finish();
  CHECK(writer.frames_altered() == 0);
  CHECK(writer.events() == event_count);
}

TEST_CASE("a folder of traces gives back exactly the events that were written, in either form of gpiomon") {
  for (const GpiomonForm form : {GpiomonForm::libgpiod_1, GpiomonForm::libgpiod_2}) {
    const TraceBench bench;
    TraceWriterOptions options;
    options.gpiomon = form;
    options.lines = {"17", "27", "300"};
    write_sample(bench.folder / "traces", options);
    TraceOptions reading;
    reading.gpiomon.lines = options.lines;
    const Traces traces = open_traces(bench.folder / "traces", reading);
    CHECK(traces.configuration == sample::configuration);
    CHECK(traces.utc_offset_ns == sample::utc_offset_ns);
    CHECK(traces.unknown_files.empty());
    const auto events = all_events(*traces.events);
    CHECK(traces.events->problems().count == 0);
    CHECK(traces.events->bytes_read() >= traces.total_bytes / 2);
    REQUIRE(events.size() == event_count);
    std::size_t different = 0;
    for (std::uint32_t i = 0; i < event_count; ++i) {
      if (!sample::same(events[i].event, sample::event_at(i).event)) ++different;
    }
    CHECK(different == 0);
    CHECK(count_can_buses(bench.folder / "traces", reading) == 2);
  }
}

TEST_CASE("recording to traces to recording: the same bytes") {
  const TraceBench bench;
  RecordingConfig config = RecordingBench::small();
  config.begin_stamp_ns = 0;
  RecordingBench first(config);
  for (std::uint32_t i = 0; i < event_count; ++i) first.writer->on_event(sample::event_at(i).event);
  REQUIRE(first.writer->finish());
  const std::string bytes(first.sink.bytes.begin(), first.sink.bytes.end());
  const Traces recorded = open_traces(bench.write("first.mcap", bytes));
  CHECK(recorded.is_recording);
  TraceFolderWriter writer(bench.folder / "traces", {}, recorded.utc_offset_ns);
  Event event;
  while (recorded.events->next(event)) writer.on_event(event);
  writer.write_configuration(recorded.configuration);
  writer.finish();

  const Traces traces = open_traces(bench.folder / "traces");
  config.configuration = traces.configuration;
  config.utc_offset_ns = traces.utc_offset_ns;
  RecordingBench second(config);
  while (traces.events->next(event)) second.writer->on_event(event);
  REQUIRE(second.writer->finish());
  CHECK(second.sink.bytes == first.sink.bytes);
}

TEST_CASE("without events.txt the traces are merged by their stamps") {
  const TraceBench bench;
  write_sample(bench.folder);
  std::filesystem::remove(bench.folder / "events.txt");
  const Traces traces = open_traces(bench.folder);
  std::size_t counts[16] = {};
  std::int64_t last_ns = 0;
  std::size_t backwards = 0;
  for (const sample::OwnedEvent& owned : all_events(*traces.events)) {
    ++counts[static_cast<std::size_t>(owned.event.kind)];
    if (owned.event.stamp_ns < last_ns - 1000) ++backwards;
    last_ns = owned.event.stamp_ns;
  }
  std::size_t expected[16] = {};
  for (std::uint32_t i = 0; i < event_count; ++i)
    ++expected[static_cast<std::size_t>(sample::event_at(i).event.kind)];
  CHECK(backwards == 0);
  for (const EventKind kind : {EventKind::can_frame, EventKind::can_sent, EventKind::edge, EventKind::bytes,
                               EventKind::bytes_sent}) {
    CHECK(counts[static_cast<std::size_t>(kind)] == expected[static_cast<std::size_t>(kind)]);
  }
  CHECK(counts[static_cast<std::size_t>(EventKind::tick)] == 62);  // every 10 ms of 617
  CHECK(counts[static_cast<std::size_t>(EventKind::edges_lost)] == 0);
}

TEST_CASE("an events.txt that does not fit its files is refused, with its line and what to do") {
  const TraceBench bench;
  write_sample(bench.folder);
  const auto read_all = [&bench] {
    const Traces traces = open_traces(bench.folder);
    return all_events(*traces.events).size();
  };
  const std::string order = content_of(bench.folder / "events.txt");
  SECTION("a frame is missing") {
    const std::string log = content_of(bench.folder / "can0.log");
    bench.write("can0.log", log.substr(log.find('\n') + 1));
    CHECK_THROWS_WITH(read_all(), Catch::Contains("events.txt:") && Catch::Contains("another time stamp") &&
                                      Catch::Contains("remove this file"));
  }
  SECTION("a file is cut") {
    const std::string log = content_of(bench.folder / "gpio.txt");
    bench.write("gpio.txt", log.substr(0, log.size() / 2));
    CHECK_THROWS_WITH(read_all(), Catch::Contains("fewer entries"));
  }
  SECTION("a file is gone") {
    std::filesystem::remove(bench.folder / "laser_b.sent.bin");
    CHECK_THROWS_WITH(read_all(), Catch::Contains("missing"));
  }
  SECTION("a line makes no sense") {
    for (const char* line :
         {"x tick\n", "1 tock\n", "1 tick 2\n", "1 edge 1\n", "1 edge 1 2 99999999999\n", "1 can0 sideways\n",
          "1 laser_c up\n", "1\n", "1 can0 up up\n", "1 edges_lost 0 0\n"}) {
      bench.write("events.txt", order + line);
      CHECK_THROWS_AS(read_all(), TraceError);
    }
  }
  SECTION("more in the files than in the order: told, and the rest is given") {
    bench.write("events.txt", order.substr(0, order.find('\n', order.size() / 2) + 1));
    const Traces traces = open_traces(bench.folder);
    CHECK(all_events(*traces.events).size() > event_count / 3);
    CHECK(traces.events->problems().count >= 3);
  }
}

TEST_CASE("foreign traces of any name are recognised by what is in them") {
  const TraceBench bench;
  bench.write("candump-2015-07-10_081732.log", "(0000000010.000000) can1 181#11\n");
  bench.write("dump.txt", "  can0  181   [1]  21\n");
  bench.write("edges", "event:  RISING EDGE offset: 3 timestamp: [      10.000000001]\n");
  bench.write("gps.txt", "10.5 $GPGGA,123519,4807.038,N,01131.000,E,1*47\n");
  bench.write("notes.md", "# how the drive went\n");
  TraceOptions options;
  options.clock_offsets_ns["dump.txt"] = 10 * ns_per_s;
  const Traces traces = open_traces(bench.folder, options);
  CHECK(traces.files.size() == 4);
  CHECK(traces.unknown_files == std::vector<std::string>{"notes.md"});
  std::size_t events = 0;
  for (const sample::OwnedEvent& owned : all_events(*traces.events)) {
    if (owned.event.kind != EventKind::tick) ++events;
    CHECK(owned.event.stamp_ns >= 10 * ns_per_s);
  }
  CHECK(events == 4);
}

TEST_CASE("paths that hold no trace are refused in a sentence") {
  const TraceBench bench;
  CHECK_THROWS_WITH(open_traces(bench.folder / "none"), Catch::Contains("does not exist"));
  CHECK_THROWS_WITH(open_traces(bench.folder), Catch::Contains("holds no trace"));
  CHECK_THROWS_WITH(open_traces(bench.write("a.txt", "hello\n")), Catch::Contains("is neither"));
  CHECK_THROWS_WITH(open_traces(bench.write("a.bin", "hello\n")), Catch::Contains("laser_a"));
  CHECK_THROWS_WITH(open_traces(bench.write("a.mcap", "hello\n")), Catch::Contains("no MCAP file"));
  CHECK_THROWS_WITH(TraceFileWriter(bench.folder / "a.xyz", {}), Catch::Contains(".log"));
  CHECK_THROWS_WITH(TraceFileWriter(bench.folder / "a.bin", {}), Catch::Contains("laser_a"));
  CHECK_THROWS_AS(TraceFileWriter("/nowhere/at/all.log", {}), TraceWriteError);
  CHECK_THROWS_AS(TraceFolderWriter("/proc/traces", {}), TraceWriteError);
  TraceOptions options;
  options.clock_offsets_ns["typo.log"] = 1;
  bench.write("can0.log", "(1.0) can0 181#11\n");
  CHECK_THROWS_WITH(open_traces(bench.folder, options), Catch::Contains("typo.log"));
}

TEST_CASE("a damaged recording replays what is left, and the source says what is missing") {
  const TraceBench bench;
  std::vector<std::uint8_t> bytes = sample_recording(300);
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2), 6000, std::uint8_t{0});
  const std::string text(bytes.begin(), bytes.end());
  RecordingSource source(bench.write("damaged.mcap", text));
  const std::size_t events = all_events(source).size();
  CHECK(events > 100);
  CHECK(events < 300);
  CHECK(source.problems().count >= 2);
}

TEST_CASE("one kind of event into one file") {
  const TraceBench bench;
  for (const auto& [name, expected] : std::vector<std::pair<const char*, std::size_t>>{
           {"all.log", 195}, {"edges.txt", 76}, {"laser_a_only.bin", 26}}) {
    TraceFileWriter writer(bench.folder / name, {});
    for (std::uint32_t i = 0; i < event_count; ++i) {
      const sample::OwnedEvent owned = sample::event_at(i);
      Event event = owned.event;
      event.bytes = owned.bytes;
      writer.on_event(event);
    }
    writer.finish();
    CHECK(writer.events() == expected);
    CHECK(writer.events() + writer.events_left_out() == event_count - 39);  // without the ticks
    const Traces traces = open_traces(bench.folder / name);
    std::size_t read = 0;
    for (const sample::OwnedEvent& owned : all_events(*traces.events)) {
      if (owned.event.kind != EventKind::tick) ++read;
    }
    CHECK(read == expected);
  }
}

}  // namespace
}  // namespace alces::replay
