#include "alces_platform/replay/trace_folder.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>

#include "alces_platform/recording/channels.h"
#include "alces_platform/recording/mcap_format.h"
#include "alces_platform/replay/nmea_trace.h"
#include "alces_platform/replay/raw_bytes.h"
#include "alces_platform/replay/recording_source.h"
#include "alces_platform/replay/trace_writer.h"
#include "ordered_source.h"

namespace alces::replay {
namespace {

namespace fs = std::filesystem;

enum class Format : std::uint8_t {
  unknown,
  recording,
  candump,
  gpiomon,
  nmea,
  bytes,
  byte_times,
  configuration,
  order
};

constexpr int lines_sniffed = 20;

bool begins_with_magic(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw TraceError(file.string() + ": cannot be opened (" + std::strerror(errno) + ")");
  std::array<char, 5> begin{};
  stream.read(begin.data(), begin.size());
  return stream && std::equal(begin.begin(), begin.end(), mcap::magic.begin(),
                              [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; });
}

/// By the name where the name says it, else by what the first lines are.
Format format_of(const fs::path& file) {
  const std::string name = file.filename().string();
  const std::string extension = file.extension().string();
  if (name == order_name) return Format::order;
  if (name == recording::configuration_name) return Format::configuration;
  if (extension == ".bin" && byte_channel_of(name) >= 0) return Format::bytes;
  if (extension == ".times") return Format::byte_times;
  if (extension == ".mcap" || begins_with_magic(file)) return Format::recording;
  LineReader lines(file);
  std::string_view line;
  Event event;
  for (int i = 0; i < lines_sniffed && lines.next(line); ++i) {
    if (CandumpReader::is_frame(line, event)) return Format::candump;
    if (GpiomonReader::is_edge(line)) return Format::gpiomon;
    if (NmeaTraceReader::is_sentence(line)) return Format::nmea;
  }
  // Nothing happened on that bus or line: still its trace.
  if (extension == ".log") return Format::candump;
  if (extension == ".nmea") return Format::nmea;
  return name == "gpio.txt" ? Format::gpiomon : Format::unknown;
}

std::unique_ptr<EventSource> open_bytes(const fs::path& file, const TraceOptions& options) {
  const std::string name = file.filename().string();
  RawBytesOptions raw;
  raw.channel = static_cast<std::uint8_t>(byte_channel_of(name));
  raw.is_sent = name.find(".sent") != std::string::npos;
  raw.baud = options.baud;
  return std::make_unique<RawBytesReader>(file, fs::path(file).replace_extension(".times"), raw);
}

std::unique_ptr<EventSource> open_trace(const fs::path& file, Format format, const TraceOptions& options) {
  switch (format) {
    case Format::candump:
      return std::make_unique<CandumpReader>(file, options.candump);
    case Format::gpiomon:
      return std::make_unique<GpiomonReader>(file, options.gpiomon);
    case Format::nmea:
      return std::make_unique<NmeaTraceReader>(file);
    case Format::bytes:
      return open_bytes(file, options);
    default:
      return nullptr;
  }
}

std::string text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string text;
  std::array<char, 65536> piece{};
  while (stream) {
    stream.read(piece.data(), piece.size());
    text.append(piece.data(), static_cast<std::size_t>(stream.gcount()));
  }
  if (!stream.is_open() || stream.bad())
    throw TraceError(file.string() + ": cannot be read to its end; check the disk");
  return text;
}

std::uint64_t size_of(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  return error ? 0 : size;
}

std::int64_t utc_offset_in(const fs::path& order) {
  LineReader lines(order);
  std::string_view line;
  std::int64_t offset_ns = 0;
  while (lines.next(line) && line.starts_with('#')) {
    if (line.starts_with(order_utc_offset) && parse_signed(line.substr(order_utc_offset.size()), offset_ns))
      break;
  }
  return offset_ns;
}

std::int64_t offset_of(const fs::path& file, const TraceOptions& options) {
  const auto found = options.clock_offsets_ns.find(file.filename().string());
  return found == options.clock_offsets_ns.end() ? 0 : found->second;
}

Traces open_recording(const fs::path& file) {
  auto source = std::make_unique<RecordingSource>(file);
  Traces traces;
  traces.configuration = source->reader().configuration();
  traces.utc_offset_ns = source->reader().utc_offset_ns();
  traces.total_bytes = size_of(file);
  traces.files.push_back(file.string());
  traces.is_recording = true;
  traces.events = std::move(source);
  return traces;
}

/// How events.txt calls a file of this name.
std::string order_word(const fs::path& file, Format format) {
  return format == Format::gpiomon ? "edge" : file.stem().string();
}

Traces open_folder(const fs::path& folder, const TraceOptions& options) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::ranges::sort(files);

  Traces traces;
  const fs::path order = folder / order_name;
  const bool is_merged =
      !fs::exists(order) || !options.clock_offsets_ns.empty() || options.merging.align_starts;
  std::unique_ptr<OrderedSource> ordered;
  auto merged = std::make_unique<EventMerger>(options.merging);
  TraceOptions file_options = options;
  if (!is_merged) {
    ordered = std::make_unique<OrderedSource>(order);
    traces.utc_offset_ns = utc_offset_in(order);
    file_options.candump = {};  // events.txt says which bus it is
  }
  bool has_trace = false;
  for (const fs::path& file : files) {
    const Format format = format_of(file);
    if (format == Format::configuration) traces.configuration = text_of(file);
    if (format == Format::order) has_trace = has_trace || !is_merged;
    std::unique_ptr<EventSource> source = open_trace(file, format, file_options);
    if (source) {
      traces.total_bytes += size_of(file);
      traces.files.push_back(file.filename().string());
      has_trace = true;
      if (is_merged) {
        merged->add(std::move(source), offset_of(file, options));
      } else {
        ordered->add(order_word(file, format), std::move(source));
      }
    } else if (format == Format::unknown || format == Format::recording) {
      traces.unknown_files.push_back(file.filename().string());
    }
  }
  if (!has_trace)
    throw TraceError(
        folder.string() +
        ": holds no trace that alces knows (candump's .log, gpiomon's gpio.txt, laser_a.bin, ...)");
  for (const auto& [name, offset] : options.clock_offsets_ns) {
    if (std::ranges::find(traces.files, name) == traces.files.end())
      throw TraceError(folder.string() + ": a clock offset is given for " + name + ", which is not there");
  }
  if (!is_merged) traces.total_bytes += size_of(order);
  traces.events = is_merged ? std::unique_ptr<EventSource>(std::move(merged)) : std::move(ordered);
  return traces;
}

}  // namespace

Traces open_traces(const fs::path& path, const TraceOptions& options) {
  std::error_code error;
  if (!fs::exists(path, error)) throw TraceError(path.string() + ": does not exist; check the path");
  if (fs::is_directory(path)) return open_folder(path, options);
  const Format format = format_of(path);
  if (format == Format::recording) return open_recording(path);
  std::unique_ptr<EventSource> source = open_trace(path, format, options);
  if (!source)
    throw TraceError(
        path.string() +
        ": is neither a recording nor a trace of candump, gpiomon or a GPS receiver (raw bytes: let "
        "the name be laser_a.bin, laser_b.bin or gps.bin)");
  Traces traces;
  auto merged = std::make_unique<EventMerger>(options.merging);
  merged->add(std::move(source), offset_of(path, options));
  traces.events = std::move(merged);
  traces.total_bytes = size_of(path);
  traces.files.push_back(path.string());
  return traces;
}

std::uint8_t count_can_buses(const fs::path& path, const TraceOptions& options) {
  const Traces traces = open_traces(path, options);
  std::uint8_t count = 0;
  Event event;
  while (traces.events->next(event)) {
    const bool is_can = event.kind == EventKind::can_frame || event.kind == EventKind::can_sent ||
                        event.kind == EventKind::can_link;
    if (is_can) count = std::max(count, static_cast<std::uint8_t>(event.channel + 1));
  }
  return count;
}

}  // namespace alces::replay
