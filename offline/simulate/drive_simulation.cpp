#include "drive_simulation.h"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <numbers>
#include <string_view>
#include <system_error>

#include "alces_drivers/scanner/scanner.h"
#include "alces_platform/recording/file_sink.h"
#include "alces_platform/recording/recording_writer.h"
#include "alces_platform/sim/simulated_scanner.h"
#include "offline/io/files/error.h"
#include "offline/io/files/output_file.h"
#include "offline/map/memory_plan.h"

namespace alces::offline {
namespace {

/// The host of the simulated vehicle: recorder and drivers, one after the other.
class Host final : public EventSink, public ScanSink, public NoticePort {
 public:
  explicit Host(DriveSimulationResult& result) : result_(result) {}

  void on_event(const Event& event) override {
    ++result_.events;
    recorder->on_event(event);
    scanner->on_event(event);
  }
  void on_scan(const Scan& scan) override {
    if (scan.is_incomplete) {
      ++result_.scans_incomplete;
      return;
    }
    if (result_.scans == 0) first_reference_ns_ = scan.reference_stamp_ns;
    ++result_.scans;
    points_ += scan.points.size();
    result_.truth.poses.push_back(rig->map_from_body(scan.reference_stamp_ns, first_reference_ns_));
    result_.truth.stamps_s.push_back(seconds(scan.reference_stamp_ns));
  }
  void raise(const Notice& notice) override {
    if (recorder != nullptr) recorder->write_notice(notice);
    if (notice.severity == Severity::info || result_.notices.size() >= most_notices) return;
    std::string value;
    if (notice.has_value)
      value =
          notice.is_hexadecimal ? fmt::format(" (0x{:X})", notice.value) : fmt::format(" ({})", notice.value);
    result_.notices.push_back(fmt::format("{:8.2f} s  {}: {}{}", seconds(notice.stamp_ns - begin_ns),
                                          notice.source, notice.text, value));
  }
  [[nodiscard]] std::uint64_t points() const { return points_; }

  RecordingWriter* recorder = nullptr;
  Scanner* scanner = nullptr;
  const sim::SimulatedRig* rig = nullptr;
  std::int64_t begin_ns = 0;

 private:
  static constexpr std::size_t most_notices = 1000;
  DriveSimulationResult& result_;
  std::int64_t first_reference_ns_ = 0;
  std::uint64_t points_ = 0;
};

double parse_number(std::string_view text, const std::string& whole) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value) || value < 0)
    throw UsageError(
        fmt::format("--fault {}: \"{}\" is no number; write NAME@SECONDS+SECONDS=NUMBER", whole, text));
  return value;
}

}  // namespace

sim::Injection parse_fault(const std::string& text) {
  const std::size_t at = text.find('@');
  const std::string name = text.substr(0, at);
  sim::Injection injection;
  bool is_known = false;
  std::string all;
  for (std::uint8_t fault = 0; fault < sim::fault_count; ++fault) {
    const auto candidate = static_cast<sim::Fault>(fault);
    const std::string word = sim::name(candidate);
    all += (all.empty() ? "" : ", ") + word;
    if (name != word) continue;
    injection.fault = candidate;
    is_known = true;
  }
  if (!is_known)
    throw UsageError(fmt::format("--fault {}: there is no fault \"{}\"; there are {}", text, name, all));
  if (at == std::string::npos)
    throw UsageError(fmt::format("--fault {}: when? Write {}@SECONDS", text, name));
  std::string_view rest = std::string_view(text).substr(at + 1);
  if (const std::size_t equals = rest.find('='); equals != std::string_view::npos) {
    injection.argument = std::llround(parse_number(rest.substr(equals + 1), text));
    rest = rest.substr(0, equals);
  }
  injection.duration_ns = ns_per_s;
  if (const std::size_t plus = rest.find('+'); plus != std::string_view::npos) {
    injection.duration_ns = std::llround(parse_number(rest.substr(plus + 1), text) * 1e9);
    rest = rest.substr(0, plus);
  }
  injection.at_ns = std::llround(parse_number(rest, text) * 1e9);
  return injection;
}

DriveSimulationResult simulate_drive(const DriveSimulationSettings& settings,
                                     const std::filesystem::path& recording,
                                     const std::function<void(double, double)>& progress,
                                     const std::function<bool()>& is_stopped) {
  DriveSimulationResult result;
  Host host(result);

  sim::SimulatedScannerSettings simulated;
  simulated.rig.seed = settings.seed;
  simulated.rig.motion.scans = settings.scans;
  simulated.rig.motion.standstill_s = settings.standstill_s;
  if (settings.speed_m_per_s > 0) simulated.rig.motion.mean_speed_m_per_s = settings.speed_m_per_s;
  simulated.rig.rings.count = settings.rings;
  simulated.rig.range_errors.snow_share = settings.snow_share;
  simulated.rig.crowd.people = settings.people;
  simulated.rig.lasers = static_cast<std::uint8_t>(settings.vehicle.scanner.assembler.laser_count);
  simulated.rig.has_gps = settings.vehicle.scanner.has_gps;
  simulated.rig.field_of_view_rad =
      settings.vehicle.scanner.lms2xx[0].field_of_view_deg * std::numbers::pi / 180;
  sim::SimulatedScanner vehicle(simulated);
  sim::SimulatedRig& rig = vehicle.rig();
  host.rig = &rig;
  const std::int64_t begin_ns = rig.motion().start_stamp_ns();
  host.begin_ns = begin_ns;
  for (sim::Injection injection : settings.faults) {
    injection.at_ns += begin_ns;
    rig.inject(injection);
  }

  // The recording gets its name when it is whole.
  std::filesystem::path unfinished = recording;
  unfinished += ".part";
  FileSink file;
  if (!file.open(unfinished.c_str()))
    throw OutputError(recording, fmt::format("cannot be written ({})",
                                             std::generic_category().message(file.error_number())));
  RecordingConfig config;
  config.configuration = settings.vehicle.text;
  config.begin_stamp_ns = begin_ns;
  MemoryBlock recorder_block(RecordingWriter::memory_required(config));
  RecordingStatus recording_status = RecordingStatus::ok;
  host.recorder = RecordingWriter::create(recorder_block.bytes(), config, file, nullptr, recording_status);
  if (host.recorder == nullptr) throw Error(to_string(recording_status), 1);

  MemoryBlock scanner_block(Scanner::memory_required(settings.vehicle.scanner));
  AssemblerStatus status = AssemblerStatus::ok;
  host.scanner =
      Scanner::create(scanner_block.bytes(), settings.vehicle.scanner,
                      {&rig.can_port(), {&rig.byte_port(laser_a_channel), &rig.byte_port(laser_b_channel)}},
                      host, host, status);
  if (host.scanner == nullptr) {
    const char* wrong = validate(settings.vehicle.scanner);
    throw UsageError(fmt::format("the vehicle's configuration cannot be used: {}",
                                 wrong != nullptr ? wrong : to_string(status)));
  }

  (void)rig.byte_port(gps_channel).set_baud_rate(settings.vehicle.gps_baud);
  host.scanner->start();
  constexpr std::int64_t step_ns = 100 * ns_per_ms;
  const std::int64_t end_ns = rig.motion().stop_stamp_ns() + 3 * ns_per_s;
  std::int64_t now_ns = begin_ns;
  while (now_ns < end_ns && !result.was_stopped) {
    now_ns += step_ns;
    rig.advance_to(now_ns, host);
    if (progress) progress(seconds(now_ns - begin_ns), seconds(end_ns - begin_ns));
    result.was_stopped = is_stopped && is_stopped();
    if (host.recorder->is_stalled()) break;
  }
  Event stop;
  stop.kind = EventKind::stop;
  stop.stamp_ns = now_ns;
  host.on_event(stop);
  for (int step = 0; step < 400 && !host.scanner->has_ended(); ++step) {
    now_ns += step_ns;
    rig.advance_to(now_ns, host);
  }
  const bool is_stalled = host.recorder->is_stalled();
  const bool is_whole = host.recorder->finish() && !is_stalled && file.error_number() == 0 &&
                        host.recorder->file_counters().chunks_lost == 0 && file.sync() && file.close();
  if (!is_whole) {
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    throw OutputError(
        recording,
        fmt::format("cannot be written ({}); is there room on the disk?",
                    std::generic_category().message(file.error_number() != 0 ? file.error_number() : EIO)));
  }
  std::error_code error;
  std::filesystem::rename(unfinished, recording, error);
  if (error) throw OutputError(recording, fmt::format("cannot be given its name ({})", error.message()));

  result.bytes = file.size();
  result.duration_s = seconds(now_ns - begin_ns);
  result.way_m = rig.motion().way_m(now_ns);
  result.truth.has_time = true;
  if (result.scans > 0) result.mean_points = static_cast<double>(host.points()) / result.scans;
  return result;
}

}  // namespace alces::offline
