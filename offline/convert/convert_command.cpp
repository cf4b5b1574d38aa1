// alces convert: a drive from one form into another (recording, folder of traces, single trace), and clouds,
// maps, trajectories and pose graphs into the forms of other programs.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "alces_platform/replay/recording_source.h"
#include "alces_platform/replay/trace_folder.h"
#include "alces_platform/replay/trace_writer.h"
#include "alces_platform/settings/settings_error.h"
#include "alces_platform/settings/vehicle_settings.h"
#include "convert_map.h"
#include "offline/io/bags/bag_trajectory.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/files/staged_folder.h"
#include "offline/io/scans/scan_source.h"
#include "offline/program/bag_options.h"
#include "offline/program/command.h"
#include "recording_file.h"
#include "settings_conversion.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;
using namespace replay;

constexpr const char* convert_footer = R"(Examples:
  alces convert drive.mcap traces/               a recording -> candump logs, gpiomon text, raw bytes
  alces convert traces/ drive.mcap               and back: exactly the same events
  alces convert candump.log drive.mcap           a single trace; candump's screen text will do as well
  alces convert drive.mcap can0.log              all CAN frames, for canplayer and log2asc
  alces convert drive.mcap laser_a.bin           what laser a sent
  alces convert cut.mcap whole.mcap              what can be read of a damaged recording, as a whole file
  alces convert town town.las                    a map as LAS; also .ply, .pcd (binary), .csv, .bin (KITTI)
  alces convert town town.kitti                  its trajectory; also .tum, and a folder called frames (3DTK)
  alces convert town town.mcap                   its scans, poses, edges and loops, for Foxglove and ROS 2
  alces convert old.toml new.toml                a configuration of an earlier version by today's names
  alces convert intel.g2o intel.graph            a pose graph as TORO's; .tum, .kitti: its poses
  alces convert scans/ all.pcd --odometry p.tum  a folder of scans, each at its pose, as one cloud
  alces convert bag/ scans/                      a bag of ROS: its scans as PCD, with odometry.tum beside them
  alces convert bag.db3:/odom odom.tum           a trajectory in a bag
  alces convert drive.mcap drive.las             what alcesd mapped during the drive

Clouds come in as PLY, PCD, LAS, 3DTK .3d, KITTI .bin and CSV. Not LAZ and E57: Debian has no library for them.

What is in a folder of traces, and what each form can hold: docs/recordings.md. Traces of other programs are merged by
their time stamps; where their clocks differ, --clock-offset gpio.txt=12.5 adds seconds to the stamps of a file, and
--align-starts lets all begin at the same time.

What cannot be read is passed over, counted, and named on stderr with file and line.)";

constexpr std::size_t most_warnings = 10;

struct ConvertOptions {
  std::string in;
  std::string out;
  std::string to;
  std::string odometry;
  double scale = 1;
  std::string format;
  BagTopics bag;
  std::string stamps = "auto";
  std::string gpiomon = "2";
  std::vector<std::string> lines;
  std::vector<std::string> interfaces;
  std::vector<std::string> clock_offsets;
  std::uint32_t baud = 500'000;
  bool align_starts = false;
};

TraceOptions trace_options(const ConvertOptions& options) {
  TraceOptions traces;
  if (options.stamps == "as-written") traces.candump.stamps = CandumpOptions::Stamps::as_written;
  if (options.stamps == "differences") traces.candump.stamps = CandumpOptions::Stamps::differences;
  traces.candump.interfaces = options.interfaces;
  traces.gpiomon.lines = options.lines;
  traces.baud = options.baud;
  traces.merging.align_starts = options.align_starts;
  for (const std::string& text : options.clock_offsets) {
    const std::size_t equals = text.rfind('=');
    std::size_t end = 0;
    double offset_s = 0;
    if (equals != std::string::npos && equals > 0) {
      try {
        offset_s = std::stod(text.substr(equals + 1), &end);
      } catch (const std::exception&) {
        end = 0;
      }
    }
    if (end == 0 || end != text.size() - equals - 1 || !(std::abs(offset_s) < 2e9))
      throw UsageError(fmt::format("--clock-offset {}: write FILE=SECONDS, as gpio.txt=12.5", text));
    traces.clock_offsets_ns[text.substr(0, equals)] = std::llround(offset_s * 1e9);
  }
  return traces;
}

/// The encoder's lines as the drive's own configuration names them; none: each by its place. TraceError: what
/// cannot be read now is no drive without a configuration.
std::vector<std::string> configured_lines(const std::string& in) {
  const Traces traces = open_traces(in);
  if (traces.configuration.empty()) return {};
  try {
    return settings::parse_vehicle_settings(traces.configuration, in).gpio_lines;
  } catch (const settings::Error&) {
    return {};  // what is wrong with a configuration is no matter of traces
  }
}

TraceWriterOptions writer_options(const ConvertOptions& options) {
  return {options.gpiomon == "1" ? GpiomonForm::libgpiod_1 : GpiomonForm::libgpiod_2, options.lines};
}

void print_problems(const TraceProblems& problems) {
  const std::size_t shown = std::min(problems.sentences.size(), most_warnings);
  for (std::size_t i = 0; i < shown; ++i) fmt::print(stderr, "alces: warning: {}\n", problems.sentences[i]);
  if (problems.count > shown)
    fmt::print(stderr, "alces: warning: {} more like these\n", problems.count - shown);
}

void warn_of_files(const Traces& traces) {
  for (const std::string& file : traces.unknown_files)
    fmt::print(stderr, "alces: warning: {}: is no trace that alces knows; left out\n", file);
}

void require_events(std::uint64_t events, const Traces& traces, const std::string& in) {
  if (events > 0) return;
  const TraceProblems problems = traces.events->problems();
  print_problems(problems);
  throw InputError(in, "holds no event that could be read; nothing is written");
}

void report(const RecordingWriter& writer, const std::string& in, const std::string& out) {
  const RecordingWriter::Counters& counters = writer.counters();
  if (const std::uint64_t lost = counters.events_unknown + counters.messages_too_large; lost > 0)
    fmt::print(stderr, "alces: warning: {} messages do not fit a recording and are left out\n", lost);
  fmt::print("{} -> {}: {} events, {} bytes\n", in, out, counters.events,
             writer.file_counters().bytes_written);
}

/// Results and all. What was damaged is left out.
void copy_recording(const ConvertOptions& options) {
  static_cast<void>(RecordingSource{fs::path(options.in)});  // says it when this is none
  FileSource file(options.in.c_str());
  RecordingReader reader(file);
  reader.open();
  const std::string configuration = reader.configuration();
  RecordingFile recording(
      options.out, desk_recording_config(configuration, reader.utc_offset_ns(), reader.can_bus_count()));
  RecordingWriter& writer = recording.writer();
  Progress progress("converting");
  const std::uint64_t total = fs::file_size(options.in);
  RecordedMessage message;
  while (reader.next(message)) {
    if (std::holds_alternative<ForeignRecord>(message.content)) continue;  // may be of another clock
    writer.advance_to(message.handed_on_ns);
    std::visit(
        [&writer](const auto& content) {
          using Content = std::decay_t<decltype(content)>;
          if constexpr (std::is_same_v<Content, Event>) writer.on_event(content);
          if constexpr (std::is_same_v<Content, ScanRecord>) writer.write_scan_info(content);
          if constexpr (std::is_same_v<Content, CloudRecord>) writer.write_cloud(content);
          if constexpr (std::is_same_v<Content, PoseRecord>) writer.write_pose(content);
          if constexpr (std::is_same_v<Content, PathRecord>) writer.write_path(content);
          if constexpr (std::is_same_v<Content, LoopRecord>) writer.write_loop(content);
          if constexpr (std::is_same_v<Content, GraphEdgeRecord>) writer.write_edge(content);
          if constexpr (std::is_same_v<Content, DiagnosticRecord>) writer.write_diagnostics(content);
        },
        message.content);
    progress(static_cast<std::size_t>(reader.file().counters().bytes), static_cast<std::size_t>(total));
  }
  check_read(options.in, file.error_number());
  TraceProblems problems;
  for (const std::string& sentence : reader.problems()) problems.add(options.in + ": " + sentence);
  if (reader.counters().messages_missing > 0)
    problems.add(fmt::format("{}: {} messages are missing", options.in, reader.counters().messages_missing));
  if (reader.counters().messages_malformed > 0)
    problems.add(fmt::format("{}: {} messages do not decode; left out", options.in,
                             reader.counters().messages_malformed));
  if (reader.counters().foreign > 0)
    problems.add(
        fmt::format("{}: {} messages of other programs are left out", options.in, reader.counters().foreign));
  print_problems(problems);
  if (reader.counters().events + reader.counters().results == 0)
    throw InputError(options.in, "holds no message that could be read; nothing is written");
  recording.commit();
  report(writer, options.in, options.out);
}

void hand_on(Traces& traces, EventSink& sink, std::uint64_t& events) {
  Progress progress("converting");
  Event event;
  while (traces.events->next(event)) {
    sink.on_event(event);
    if (event.kind != EventKind::tick) ++events;
    progress(static_cast<std::size_t>(std::min(traces.events->bytes_read(), traces.total_bytes)),
             static_cast<std::size_t>(traces.total_bytes));
  }
}

void traces_to_recording(const ConvertOptions& options) {
  const TraceOptions trace = trace_options(options);
  const std::uint8_t buses = count_can_buses(options.in, trace);
  Traces traces = open_traces(options.in, trace);
  warn_of_files(traces);
  RecordingFile recording(options.out,
                          desk_recording_config(traces.configuration, traces.utc_offset_ns, buses));
  std::uint64_t events = 0;
  hand_on(traces, recording.writer(), events);
  require_events(events, traces, options.in);
  recording.commit();
  print_problems(traces.events->problems());
  report(recording.writer(), options.in, options.out);
}

void to_traces(const ConvertOptions& options) {
  Traces traces = open_traces(options.in, trace_options(options));
  warn_of_files(traces);
  std::uint64_t events = 0;
  const fs::path out = options.out;
  const bool is_file = out.has_extension() && !fs::is_directory(out) && options.out.back() != '/';
  if (is_file) {
    TraceFileWriter writer(out, writer_options(options));
    hand_on(traces, writer, events);
    require_events(events, traces, options.in);
    writer.finish();
    print_problems(traces.events->problems());
    fmt::print("{} -> {}: {} events", options.in, options.out, writer.events());
    if (writer.events_left_out() > 0)
      fmt::print(", {} of other kinds left out (a folder holds them all)", writer.events_left_out());
    fmt::print("\n");
    return;
  }
  StagedFolder stage(out, is_trace_name);
  TraceFolderWriter writer(stage.staging(), writer_options(options), traces.utc_offset_ns);
  try {
    hand_on(traces, writer, events);
    if (!traces.configuration.empty()) writer.write_configuration(traces.configuration);
    writer.finish();
  } catch (const TraceWriteError& error) {
    throw TraceWriteError(stage.renamed(error.what()));
  }
  require_events(events, traces, options.in);
  stage.commit();
  print_problems(traces.events->problems());
  if (writer.frames_altered() > 0)
    fmt::print(stderr, "alces: warning: {} frames that no bus carries are not the same in candump's text\n",
               writer.frames_altered());
  std::string files;
  for (const std::string& file : writer.files()) files += (files.empty() ? "" : ", ") + file;
  fmt::print("{} -> {}: {} events in {}\n", options.in, options.out, writer.events(), files);
  if (traces.is_recording) {
    const auto& reader = static_cast<const RecordingSource&>(*traces.events).reader();
    if (reader.counters().results > 0)
      fmt::print("{} results of mapping (poses, clouds, loops, diagnostics) are no traces and stay in {}\n",
                 reader.counters().results, options.in);
  }
}

bool is_recording_name(const std::string& name) {
  return fs::path(name).extension() == ".mcap";
}

bool is_graph(ConversionForm form) {
  return form == ConversionForm::g2o || form == ConversionForm::toro;
}

bool is_trajectory(ConversionForm form) {
  return form == ConversionForm::tum || form == ConversionForm::kitti || form == ConversionForm::frames;
}

/// Names that mean one thing in a drive and another among clouds: the other side says which.
std::optional<ConversionSource> source_for(const fs::path& in, ConversionForm form) {
  const std::string extension = in.extension().string();
  const std::string name = in.filename().string();
  const bool is_laser = name.starts_with("laser_") || name.starts_with("gps");
  if (extension == ".csv" && !is_trajectory(form)) return ConversionSource::cloud;
  if (extension == ".txt" && is_trajectory(form)) return ConversionSource::trajectory;
  if (extension == ".bin" && !is_laser) return ConversionSource::cloud;
  return conversion_source(in);
}

MapConversion conversion_of(const ConvertOptions& options, ConversionSource source, ConversionForm form) {
  MapConversion conversion{options.in, options.out, source, form};
  ScanSourceOptions reading;
  choose_odometry(options.odometry, reading);
  conversion.odometry = reading.odometry;
  conversion.no_odometry = reading.no_odometry;
  conversion.scale = options.scale;
  conversion.scan_format = options.format;
  conversion.bag = options.bag;
  return conversion;
}

/// A map, cloud or trajectory, when IN is one and OUT can be made of it.
std::optional<MapConversion> map_conversion(const ConvertOptions& options) {
  const std::optional<ConversionForm> form =
      options.to.empty() ? conversion_form(options.out) : conversion_form_called(options.to);
  if (!form) {
    const std::optional<ConversionSource> source = conversion_source(options.in);
    if (!source || *source == ConversionSource::recording) return std::nullopt;
    if (source == ConversionSource::scans && !fs::path(options.out).has_extension())
      return conversion_of(options, *source, ConversionForm::scan_folder);
    throw UsageError(
        fmt::format("{}: what to write is not clear; end the name in .ply, .pcd, .las, .csv, .bin, .tum, "
                    ".kitti, .g2o, .graph or .mcap, or say it with --to",
                    options.out));
  }
  const std::optional<ConversionSource> source = source_for(options.in, *form);
  const bool is_drive = !source || (*source == ConversionSource::recording &&
                                    (*form == ConversionForm::mcap || *form == ConversionForm::kitti_scan));
  if (is_drive && options.to.empty()) return std::nullopt;
  if (!source)
    throw UsageError(
        fmt::format("{} is no map, cloud, trajectory or pose graph; --to is for these", options.in));
  return conversion_of(options, *source, *form);
}

void convert_map(const ConvertOptions& options, const MapConversion& conversion) {
  Progress progress("converting");
  const MapConversionReport report =
      convert_map(conversion, [&](std::size_t done, std::size_t total) { progress(done, total); });
  for (const std::string& warning : report.warnings) fmt::print(stderr, "alces: warning: {}\n", warning);
  if (report.not_finite > 0)
    fmt::print(stderr, "alces: warning: {} points are not finite and are left out\n", report.not_finite);
  if (is_graph(conversion.form)) {
    fmt::print("{} -> {}: {} poses, {} edges\n", options.in, options.out, report.poses, report.edges);
  } else if (is_trajectory(conversion.form)) {
    fmt::print("{} -> {}: {} poses\n", options.in, options.out, report.poses);
  } else {
    fmt::print("{} -> {}: {} points of {} scans", options.in, options.out, report.points, report.scans);
    if (report.edges > 0) fmt::print(", {} edges, {} loops", report.edges, report.loops);
    fmt::print("\n");
  }
}

void convert(ConvertOptions options) {
  if (!fs::exists(options.in) && !names_bag_topic(options.in))
    throw InputError(options.in, "does not exist; check the path");
  std::error_code error;
  if (fs::equivalent(options.in, options.out, error))
    throw UsageError(fmt::format("{} is both read and written; name another OUT", options.in));
  if (fs::path(options.in).extension() == ".toml") {
    if (fs::path(options.out).extension() != ".toml")
      throw UsageError(fmt::format("{} is a configuration; end OUT's name in .toml", options.in));
    fmt::print("{} -> {}: {}\n", options.in, options.out, convert_settings(options.in, options.out));
    return;
  }
  try {
    if (const std::optional<MapConversion> conversion = map_conversion(options)) {
      convert_map(options, *conversion);
      return;
    }
    if (options.lines.empty()) options.lines = configured_lines(options.in);
    if (!is_recording_name(options.out)) {
      to_traces(options);
    } else if (!fs::is_directory(options.in) && is_recording_name(options.in)) {
      copy_recording(options);
    } else {
      traces_to_recording(options);
    }
  } catch (const TraceWriteError& problem) {
    throw OutputError(problem.what());
  } catch (const TraceError& problem) {
    throw InputError(problem.what());
  }
}

}  // namespace

void add_convert_command(CLI::App& alces) {
  auto options = std::make_shared<ConvertOptions>();
  CLI::App* verb = alces.add_subcommand(
      "convert", "Drives, maps, clouds, trajectories and pose graphs in the forms of other programs.");
  verb->footer(convert_footer);
  verb->add_option(
          "IN", options->in,
          "a recording (.mcap), a bag, traces, a map folder, scans, a cloud, a trajectory or a pose graph")
      ->required();
  verb->add_option("OUT", options->out, "the file or folder to write; its name says the form")->required();
  verb->add_option("--to", options->to, "the form of OUT, where its name does not say it")
      ->check(CLI::IsMember({"ply", "pcd", "las", "csv", "kitti-scan", "tum", "kitti", "frames", "g2o",
                             "toro", "mcap", "scans"}));
  verb->add_option("--odometry", options->odometry,
                   "poses of the scans, instead of those beside them; none: no poses at all");
  verb->add_option("--scale", options->scale, "of the scans' coordinates: 0.001 where they are mm")
      ->check(CLI::Range(1e-9, 1e9))
      ->capture_default_str();
  verb->add_option("--format", options->format, "of the scans, as alces map has it");
  add_bag_options(*verb, options->bag);
  verb->add_option("--gpiomon", options->gpiomon, "the form of gpiomon's text to write: of libgpiod 1 or 2")
      ->check(CLI::IsMember({"1", "2"}))
      ->capture_default_str();
  verb->add_option("--lines", options->lines,
                   "offsets or names of the GPIO lines, in their order: 17,27,index (default: as configured "
                   "in the drive)")
      ->delimiter(',');
  verb->add_option("--interfaces", options->interfaces,
                   "interfaces of the CAN buses, in their order: vcan0,can1")
      ->delimiter(',');
  verb->add_option("--stamps", options->stamps, "candump's time stamps, where auto guesses wrong")
      ->check(CLI::IsMember({"auto", "as-written", "differences"}))
      ->capture_default_str();
  verb->add_option("--baud", options->baud, "pace of raw bytes that have no .times file")
      ->check(CLI::Range(50U, 100'000'000U))
      ->capture_default_str();
  verb->add_option("--clock-offset", options->clock_offsets,
                   "FILE=SECONDS, added to the stamps of that file");
  verb->add_flag("--align-starts", options->align_starts, "let all traces begin at the same time");
  verb->callback([options] { convert(*options); });
}

}  // namespace alces::offline
