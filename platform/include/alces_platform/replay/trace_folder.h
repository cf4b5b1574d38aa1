// A drive as a folder of traces in the formats of can-utils and libgpiod, or a single such file, or a
// recording: opened alike. docs/recordings.md describes the folder.
//
//   can0.log, can1.log ...            candump -l -x
//   gpio.txt                          gpiomon, either form
//   laser_a.bin, laser_a.times        raw bytes and when they came; laser_b, gps; laser_a.sent.bin: what we
//   sent gps.nmea                          NMEA sentences, where there is no gps.bin vehicle.toml the
//   configuration events.txt                        the order of all events, and what the other files cannot
//   hold
//
// With events.txt a folder gives exactly the events that were written into it. Without it (traces of other
// programs) the files are merged by their time stamps, with ticks in between.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "alces_platform/replay/candump.h"
#include "alces_platform/replay/event_merger.h"
#include "alces_platform/replay/event_source.h"
#include "alces_platform/replay/gpiomon.h"

namespace alces::replay {

struct TraceOptions {
  CandumpOptions candump;
  GpiomonOptions gpiomon;
  std::uint32_t baud = 500'000;  ///< pace of raw bytes without times
  EventMergerOptions merging;
  /// Added to the stamps of a file, by its name ("gpio.txt"). When there are any, or starts are aligned,
  /// events.txt is not used.
  std::map<std::string, std::int64_t> clock_offsets_ns;
};

struct Traces {
  std::unique_ptr<EventSource> events;
  std::string configuration;  ///< the text of vehicle.toml; empty: none
  std::int64_t utc_offset_ns = 0;
  std::uint64_t total_bytes = 0;           ///< what EventSource::bytes_read() ends with, about
  std::vector<std::string> files;          ///< that are read
  std::vector<std::string> unknown_files;  ///< in the folder, and not understood
  bool is_recording = false;
};

/// TraceError: nothing there that can be read.
[[nodiscard]] Traces open_traces(const std::filesystem::path& path, const TraceOptions& options = {});

/// How many CAN buses the traces have: goes through them once.
[[nodiscard]] std::uint8_t count_can_buses(const std::filesystem::path& path,
                                           const TraceOptions& options = {});

}  // namespace alces::replay
