// Drives: recordings (MCAP), and folders of traces by other programs.
#include <string>

#include "../memory_file.h"
#include "alces_drivers/stamp.h"
#include "alces_platform/recording/byte_source.h"
#include "alces_platform/recording/recording_reader.h"
#include "alces_platform/replay/candump.h"
#include "alces_platform/replay/event_source.h"
#include "alces_platform/replay/trace_folder.h"

namespace alces::fuzz {
namespace {

ALCES_FUZZ_TARGET(mcap) {
  MemorySource source(bytes);
  RecordingReader reader(source);
  std::size_t messages = 0;
  if (reader.open()) {
    RecordedMessage message;
    while (reader.next(message)) ++messages;
    (void)reader.configuration();
    (void)reader.utc_offset_ns();
    (void)reader.can_bus_count();
  }
  (void)reader.is_whole();
  MemorySource again(bytes);
  const RecordingSummary summary = summarise_recording(again);
  require(!summary.is_whole || summary.is_recording, "what is whole is a recording");
  require(messages == 0 || summary.is_recording, "what has messages is a recording");
}

void read_all(replay::EventSource& events) {
  Event event;
  std::size_t count = 0;
  std::string text;
  while (count < 20'000 && events.next(event)) {
    ++count;
    if (event.kind != EventKind::can_frame) continue;
    text.clear();
    replay::append_candump(text, event, "can0");
    require(text.size() > 5, "every frame can be written");
  }
  (void)events.problems();
}

ALCES_FUZZ_TARGET(candump) {
  const MemoryFile file(bytes);
  try {
    replay::CandumpReader reader(file.path());
    read_all(reader);
  } catch (const replay::TraceError&) {
  }
}

ALCES_FUZZ_TARGET(trace_folder) {
  const MemoryFolder folder;
  for_each_file(bytes,
                {"can0.log", "gpio.txt", "laser_a.bin", "laser_a.times", "laser_b.bin", "gps.nmea",
                 "events.txt", "vehicle.toml", "laser_a.sent.bin"},
                [&](std::string_view name, std::string_view content) { folder.write(name, content); });
  try {
    const replay::Traces traces = replay::open_traces(folder.path());
    read_all(*traces.events);
  } catch (const replay::TraceError&) {
  }
}

}  // namespace
}  // namespace alces::fuzz
