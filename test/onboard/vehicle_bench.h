// A simulated vehicle around a Pipeline, and what its recording says, for tests of onboard.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alces_onboard/pipeline.h"
#include "alces_platform/recording/recording_reader.h"
#include "alces_platform/settings/memory_plan.h"
#include "alces_platform/settings/vehicle_settings.h"
#include "alces_platform/sim/simulated_scanner.h"

namespace alces::onboard {

/// A file in memory; refuses when it is told to.
class MemorySink final : public ByteSink {
 public:
  [[nodiscard]] bool write(std::span<const std::uint8_t> added) override {
    if (refuses) return false;
    bytes.insert(bytes.end(), added.begin(), added.end());
    return true;
  }
  std::vector<std::uint8_t> bytes;
  bool refuses = false;
};

/// For replays: the vehicle has had what drivers send.
class NoWires final : public CanPort, public BytePort {
 public:
  [[nodiscard]] bool send(const CanFrame&) override { return true; }
  [[nodiscard]] bool write(std::span<const std::uint8_t>) override { return true; }
  [[nodiscard]] bool set_baud_rate(std::uint32_t) override { return true; }
};

class NoticeList final : public NoticePort {
 public:
  void raise(const Notice& notice) override {
    lines.push_back(std::string(notice.source) + ": " + notice.text);
  }
  [[nodiscard]] bool has(const std::string& part) const {
    for (const std::string& line : lines) {
      if (line.find(part) != std::string::npos) return true;
    }
    return false;
  }
  std::vector<std::string> lines;
};

struct KeptEvent {
  Event event;
  std::vector<std::uint8_t> bytes;
};

/// Small enough for quick tests: the simulator's vehicle, 40 cm cells.
inline const settings::VehicleSettings& small_vehicle() {
  static const settings::VehicleSettings small = [] {
    settings::VehicleSettings vehicle = settings::default_vehicle_settings();
    vehicle.mapper.scan_capacity = 64;
    vehicle.mapper.pool_bytes = std::size_t{4} << 20;
    vehicle.mapper.voxel.cell_size_m = 0.4F;
    vehicle.mapper.voxel.cell_capacity = 8192;
    vehicle.mapper.surface.sample_capacity = 512;
    vehicle.mapper.cache_slots = 8;
    vehicle.scan_slots = 3;
    vehicle.text = settings::to_toml(vehicle);
    return vehicle;
  }();
  return small;
}

/// Refers to the vehicle's text.
inline PipelineConfig config_of(const settings::VehicleSettings& vehicle) {
  PipelineConfig config;
  config.scanner = vehicle.scanner;
  config.mapping.mapper = vehicle.mapper;
  config.mapping.scan_slots = vehicle.scan_slots;
  config.maps_incomplete_scans = vehicle.maps_incomplete_scans;
  config.recording.configuration = vehicle.text;
  return config;
}

/// A vehicle that drives a few scans' way after standing for two seconds.
class VehicleBench {
 public:
  explicit VehicleBench(std::size_t scans = 6) : vehicle_(simulation(scans)) {}

  [[nodiscard]] Scanner::Ports ports() {
    sim::SimulatedRig& rig = vehicle_.rig();
    return {&rig.can_port(), {&rig.byte_port(laser_a_channel), &rig.byte_port(laser_b_channel)}};
  }
  [[nodiscard]] std::int64_t now_ns() const { return vehicle_.rig().now_ns(); }
  [[nodiscard]] sim::SimulatedScanner& vehicle() { return vehicle_; }

  void run_for(std::int64_t duration_ns, EventSink& sink) {
    vehicle_.rig().advance_to((now_ns() == 0 ? begin_ns() : now_ns()) + duration_ns, sink);
  }
  void drive_to_end(EventSink& sink) { vehicle_.rig().advance_to(end_ns(), sink); }
  [[nodiscard]] std::int64_t begin_ns() const { return vehicle_.rig().motion().start_stamp_ns(); }
  [[nodiscard]] std::int64_t end_ns() const { return vehicle_.rig().motion().stop_stamp_ns() + ns_per_s; }

 private:
  static sim::SimulatedScannerSettings simulation(std::size_t scans) {
    sim::SimulatedScannerSettings simulated;
    simulated.rig.motion.scans = scans;
    return simulated;
  }
  sim::SimulatedScanner vehicle_;
};

/// Hands events on and lets the mapper work after each, if it may.
class Feeder final : public EventSink {
 public:
  explicit Feeder(Pipeline& pipeline) : pipeline_(pipeline) {}
  void on_event(const Event& event) override {
    if (keeps) kept.push_back({event, {event.bytes.begin(), event.bytes.end()}});
    pipeline_.on_event(event);
    if (maps) {
      while (pipeline_.run_mapper_once()) {
      }
    }
  }
  bool maps = true;
  bool keeps = false;
  std::vector<KeptEvent> kept;

 private:
  Pipeline& pipeline_;
};

/// The end of a drive without threads.
inline bool end_drive(Pipeline& pipeline) {
  pipeline.end_events();
  for (int round = 0; round < 1000 && !pipeline.is_mapping_finished(); ++round) {
    while (pipeline.run_mapper_once()) {
    }
    pipeline.take_results();
  }
  return pipeline.is_mapping_finished() && pipeline.finish_recording();
}

struct Recorded {
  struct KeptScan {
    ScanRecord scan;
    std::string verdict;
  };
  std::vector<KeptEvent> events;
  std::vector<KeptScan> scans;
  std::vector<PoseRecord> poses;
  std::vector<std::string> diagnostics;
  std::size_t clouds = 0;
  std::size_t edges = 0;
  std::string configuration;
  bool is_whole = false;
};

inline Recorded read_back(const std::vector<std::uint8_t>& bytes) {
  Recorded recorded;
  MemorySource source(bytes);
  RecordingReader reader(source);
  if (!reader.open()) return recorded;
  RecordedMessage message;
  while (reader.next(message)) {
    if (const auto* const event = std::get_if<Event>(&message.content)) {
      recorded.events.push_back({*event, {event->bytes.begin(), event->bytes.end()}});
    } else if (const auto* const scan = std::get_if<ScanRecord>(&message.content)) {
      recorded.scans.push_back({*scan, std::string(scan->verdict)});
    } else if (const auto* const pose = std::get_if<PoseRecord>(&message.content)) {
      recorded.poses.push_back(*pose);
    } else if (const auto* const diagnostic = std::get_if<DiagnosticRecord>(&message.content)) {
      recorded.diagnostics.push_back(std::string(diagnostic->name) + ": " + std::string(diagnostic->message));
    } else if (std::holds_alternative<CloudRecord>(message.content)) {
      ++recorded.clouds;
    } else if (std::holds_alternative<GraphEdgeRecord>(message.content)) {
      ++recorded.edges;
    }
  }
  recorded.configuration = reader.configuration();
  recorded.is_whole = reader.is_whole();
  return recorded;
}

inline void feed(const std::vector<KeptEvent>& events, EventSink& sink) {
  for (const KeptEvent& kept : events) {
    Event event = kept.event;
    event.bytes = kept.bytes;
    sink.on_event(event);
  }
}

inline std::vector<Pose> poses_of(const Pipeline& pipeline) {
  const Mapper* const mapper = pipeline.mapper();
  if (mapper == nullptr) return {};
  const std::span<const Pose> poses = mapper->graph().poses();
  return {poses.begin(), poses.end()};
}

inline bool are_same_bits(const std::vector<Pose>& a, const std::vector<Pose>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].rotation.coeffs() != b[i].rotation.coeffs() || a[i].translation_m != b[i].translation_m)
      return false;
  }
  return true;
}

/// The recording of one drive in which every scan was mapped: made once for all tests that read it.
struct RecordedDrive {
  RecordedDrive() {
    VehicleBench bench;
    PipelineConfig config = config_of(small_vehicle());
    Pipeline pipeline(config, {.ports = bench.ports(), .recording = &sink, .listener = &notices});
    pipeline.start_scanner();
    Feeder feeder(pipeline);
    bench.drive_to_end(feeder);
    was_ended = end_drive(pipeline);
    poses = poses_of(pipeline);
    counters = pipeline.counters();
    recorded = read_back(sink.bytes);
  }
  MemorySink sink;
  NoticeList notices;
  bool was_ended = false;
  std::vector<Pose> poses;
  Pipeline::Counters counters;
  Recorded recorded;
};

inline const RecordedDrive& recorded_drive() {
  static const RecordedDrive drive;
  return drive;
}

}  // namespace alces::onboard
