#include "drive_replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "alces_platform/recording/recording_reader.h"
#include "alces_platform/replay/player.h"
#include "alces_platform/settings/settings_error.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"

namespace alces::offline {
namespace {

constexpr std::size_t most_stamps_a_notice = 100;  // in run.json; all are counted
constexpr std::int64_t samples_a_drive = 200;      // of the counters

/// As many as the head can turn through in this time at its fastest, or as the lasers have profiles for: a
/// head that turns faster than it is configured to loses no scan.
std::size_t most_scans(const ScannerConfig& scanner, double duration_s) {
  const EncoderConfig& encoder = scanner.encoder;
  const double fastest_rad_s = std::abs(encoder.expected_speed_rad_s) * (1 + encoder.speed_tolerance);
  const double by_turns = fastest_rad_s * duration_s / scanner.assembler.turn_rad;
  double profiles_per_s = 0;
  for (std::uint32_t laser = 0; laser < scanner.assembler.laser_count; ++laser)
    profiles_per_s += scanner.laser_makes[laser] == LaserMake::lms2xx
                          ? scanner.lms2xx[laser].turns_per_s
                          : scanner.cola_b[laser].scan_frequency_hz;
  const double by_profiles =
      profiles_per_s * duration_s / std::max<std::uint32_t>(1, scanner.assembler.minimum_profiles);
  return static_cast<std::size_t>(std::max(by_turns, by_profiles)) + 2;
}

}  // namespace

/// Where the drivers' frames and bytes go in a replay: the vehicle has had them.
class DriveReplay::Wires final : public CanPort, public BytePort {
 public:
  [[nodiscard]] bool send(const CanFrame&) override { return true; }
  [[nodiscard]] bool write(std::span<const std::uint8_t>) override { return true; }
  [[nodiscard]] bool set_baud_rate(std::uint32_t) override { return true; }
};

DriveReplay::DriveReplay(const std::filesystem::path& drive, const DriveReplayOptions& options)
    : options_(options), wires_(std::make_unique<Wires>()) {
  try {
    traces_ = replay::open_traces(drive);
    if (options.settings) {
      settings_ = *options.settings;
    } else if (options.config) {
      settings_ = settings::read_vehicle_settings(*options.config);
    } else if (!traces_.configuration.empty()) {
      settings_ = settings::parse_vehicle_settings(traces_.configuration, drive.string() + " (vehicle.toml)");
    } else {
      throw InputError(drive, "holds no configuration of the vehicle; give it with --config vehicle.toml");
    }
    if (!options.deskew) settings_.scanner.assembler.deskew = false;
    replay::TraceOptions reading;
    reading.gpiomon.lines = settings_.gpio_lines;  // so gpiomon names them
    if (!traces_.is_recording) traces_ = replay::open_traces(drive, reading);
    survey(drive, reading);
  } catch (const replay::TraceError& error) {
    throw InputError(error.what());
  } catch (const settings::Error& error) {
    throw InputError(error.what());
  }
  block_.emplace(Scanner::memory_required(settings_.scanner));
  AssemblerStatus status = AssemblerStatus::ok;
  scanner_ = Scanner::create(block_->bytes(), settings_.scanner, {wires_.get(), {wires_.get(), wires_.get()}},
                             *this, *this, status);
  if (scanner_ == nullptr) {
    const char* wrong = validate(settings_.scanner);
    throw InputError(drive, fmt::format("its configuration cannot be used: {}",
                                        wrong != nullptr ? wrong : to_string(status)));
  }
  scanner_->observe_profiles(options.profiles);
  scanner_->start();
  if (options.speed > 0) clock_ = std::make_unique<replay::SteadyReplayClock>();
}

DriveReplay::~DriveReplay() = default;

namespace {

bool is_of_can(const Event& event) {
  return event.kind == EventKind::can_frame || event.kind == EventKind::can_sent ||
         event.kind == EventKind::can_link || event.kind == EventKind::sync_sent;
}

}  // namespace

void DriveReplay::survey(const std::filesystem::path& drive, const replay::TraceOptions& reading) {
  bool has_can = false;
  if (traces_.is_recording) {
    FileSource file(drive.c_str());
    RecordingReader reader(file);
    RecordedMessage message;
    bool has_begun = false;
    if (reader.open()) {
      while (reader.next(message)) {
        if (std::holds_alternative<ForeignRecord>(message.content)) continue;  // may be of another clock
        if (!has_begun) begin_ns_ = message.handed_on_ns;
        has_begun = true;
        end_ns_ = message.handed_on_ns;
        const auto* const event = std::get_if<Event>(&message.content);
        has_can = has_can || (event != nullptr && is_of_can(*event));
        const auto* const scan = std::get_if<ScanRecord>(&message.content);
        if (scan != nullptr && !scan->was_mapped && scan->verdict.substr(0, 7) == "dropped")
          dropped_.insert(scan->number);
      }
    }
    check_read(drive, file.error_number());
  } else {
    const replay::Traces traces = replay::open_traces(drive, reading);
    Event event;
    bool has_begun = false;
    while (traces.events->next(event)) {
      if (!has_begun) begin_ns_ = event.stamp_ns;
      has_begun = true;
      end_ns_ = std::max(end_ns_, event.stamp_ns);
      has_can = has_can || is_of_can(event);
    }
  }
  // Nobody would ever answer, and the lasers would wait for the motor as long as the drive may be.
  if (!has_can && settings_.scanner.has_motor) {
    settings_.scanner.has_motor = false;
    is_without_can_ = true;
  }
  size_ = most_scans(settings_.scanner, seconds(std::max<std::int64_t>(0, end_ns_ - begin_ns_)));
}

void DriveReplay::on_scan(const Scan& scan) {
  const std::lock_guard lock(mutex_);
  if (scan.is_incomplete && !settings_.maps_incomplete_scans) {
    ++incomplete_;
    return;
  }
  if (!options_.maps_dropped_scans && dropped_.count(scan.number) != 0) {
    ++dropped_again_;
    return;
  }
  Passed passed;
  passed.number = scan.number;
  passed.reference_stamp_ns = scan.reference_stamp_ns;
  if (scan.has_odometry) passed.odometry_from_body = scan.odometry_from_body;
  passed_.push_back(passed);
  ready_.push_back({.points = {scan.points.begin(), scan.points.end()}});
}

void DriveReplay::raise(const Notice& notice) {
  const std::lock_guard lock(mutex_);
  ++notice_count_;
  SaidNotice& said = notices_[{notice.source, notice.text}];
  if (said.times++ == 0) said.first_stamp_ns = notice.stamp_ns;
  said.last_stamp_ns = notice.stamp_ns;
  if (said.stamps_ns.size() < most_stamps_a_notice) said.stamps_ns.push_back(notice.stamp_ns);
  said.severity = notice.severity;
  said.has_value = notice.has_value;
  said.value = notice.value;
}

bool DriveReplay::read(std::size_t index, ScanPoints& scan) {
  if (index < first_ready_) throw InputError("a drive is replayed front to back, once");
  try {
    while (index >= first_ready_ + ready_.size()) {
      Event event;
      if (is_over_ || !traces_.events->next(event)) {
        if (!is_over_) {
          scanner_->finish();
          sample_counters(end_ns_);
        }
        is_over_ = true;
        if (index < first_ready_ + ready_.size()) break;
        size_ = first_ready_ + ready_.size();
        return false;
      }
      if (clock_) {
        if (first_event_ns_ == no_stamp_ns) {
          first_event_ns_ = event.stamp_ns;
          paced_from_ns_ = clock_->now_ns();
        }
        const double wait_ns = static_cast<double>(event.stamp_ns - first_event_ns_) / options_.speed;
        clock_->sleep_until(paced_from_ns_ + std::llround(wait_ns));
      }
      if (event.stamp_ns >= next_sample_ns_) sample_counters(event.stamp_ns);
      ++events_;
      scanner_->on_event(event);
    }
  } catch (const replay::TraceError& error) {
    throw InputError(error.what());
  }
  std::swap(scan, ready_[index - first_ready_]);
  ready_.erase(ready_.begin(), ready_.begin() + static_cast<std::ptrdiff_t>(index - first_ready_ + 1));
  first_ready_ = index + 1;
  return true;
}

DriveReplay::Passed DriveReplay::passed(std::size_t index) const {
  const std::lock_guard lock(mutex_);
  return index < passed_.size() ? passed_[index] : Passed{};
}

std::string DriveReplay::name(std::size_t index) const {
  return fmt::format("scan {}", passed(index).number);
}
std::size_t DriveReplay::number(std::size_t index) const {
  return passed(index).number;
}
std::optional<Pose> DriveReplay::odometry(std::size_t index) const {
  return passed(index).odometry_from_body;
}
std::optional<double> DriveReplay::stamp_s(std::size_t index) const {
  return seconds(passed(index).reference_stamp_ns);
}
std::string DriveReplay::description() const {
  return fmt::format("a drive of {:.0f} s from {}", seconds(end_ns_ - begin_ns_), traces_.events->name());
}

std::vector<std::string> DriveReplay::warnings() const {
  std::vector<std::string> warnings;
  const replay::TraceProblems problems = traces_.events->problems();
  warnings.insert(warnings.end(), problems.sentences.begin(), problems.sentences.end());
  if (problems.count > problems.sentences.size())
    warnings.push_back(
        fmt::format("{} more problems of the recording", problems.count - problems.sentences.size()));
  if (is_without_can_)
    warnings.push_back(
        "nothing of a CAN bus is in the drive: replayed as if there were no motor to wait for");
  for (const std::string& file : traces_.unknown_files)
    warnings.push_back(file + ": not understood, left out");
  const std::lock_guard lock(mutex_);
  for (const auto& [what, said] : notices_) {
    if (said.severity == Severity::info) continue;
    warnings.push_back(fmt::format("{}: {}{}{} (first at {:.1f} s)", what.first, what.second,
                                   said.has_value ? fmt::format(" {}", said.value) : "",
                                   said.times > 1 ? fmt::format(", {} times", said.times) : "",
                                   seconds(said.first_stamp_ns - begin_ns_)));
  }
  return warnings;
}

void DriveReplay::sample_counters(std::int64_t stamp_ns) {
  CounterSample sample{stamp_ns, {}};
  scanner_->visit_counters(
      [&sample](ScannerPart, const char*, std::uint64_t value) { sample.values.push_back(value); });
  counter_samples_.push_back(std::move(sample));
  next_sample_ns_ = stamp_ns + std::max<std::int64_t>((end_ns_ - begin_ns_) / samples_a_drive, 1);
}

std::string DriveReplay::counters_csv() const {
  std::vector<std::string> names;
  scanner_->visit_counters([&names](ScannerPart part, const char* name, std::uint64_t) {
    names.push_back(fmt::format("{}.{}", to_string(part), name));
  });
  const auto counts_something = [this](std::size_t counter) {
    return !counter_samples_.empty() && counter_samples_.back().values[counter] != 0;
  };
  std::string csv = "time_s";
  for (std::size_t i = 0; i < names.size(); ++i)
    if (counts_something(i)) csv += "," + names[i];
  for (const CounterSample& sample : counter_samples_) {
    csv += fmt::format("\n{:.3f}", seconds(sample.stamp_ns - begin_ns_));
    for (std::size_t i = 0; i < names.size(); ++i)
      if (counts_something(i)) csv += fmt::format(",{}", sample.values[i]);
  }
  return csv + "\n";
}

nlohmann::json DriveReplay::report() const {
  const std::lock_guard lock(mutex_);
  nlohmann::json json;
  json["duration_s"] = seconds(end_ns_ - begin_ns_);
  json["begin_s"] = seconds(begin_ns_);
  json["events"] = events_;
  json["scans"] = {{"assembled", scanner_->assembler().counters().scans},
                   {"handed_on", passed_.size()},
                   {"incomplete_left_out", incomplete_},
                   {"dropped_on_the_vehicle", dropped_again_}};
  json["deskew"] = settings_.scanner.assembler.deskew;
  scanner_->visit_counters([&](ScannerPart part, const char* name, std::uint64_t value) {
    json["counters"][to_string(part)][name] = value;
  });
  json["notices"] = nlohmann::json::array();
  for (const auto& [what, said] : notices_) {
    nlohmann::json at_s = nlohmann::json::array();
    for (const std::int64_t stamp_ns : said.stamps_ns) at_s.push_back(seconds(stamp_ns - begin_ns_));
    json["notices"].push_back({{"source", what.first},
                               {"text", what.second},
                               {"severity", to_string(said.severity)},
                               {"value", said.has_value ? nlohmann::json(said.value) : nlohmann::json()},
                               {"times", said.times},
                               {"first_s", seconds(said.first_stamp_ns - begin_ns_)},
                               {"last_s", seconds(said.last_stamp_ns - begin_ns_)},
                               {"at_s", std::move(at_s)}});
  }
  return json;
}

}  // namespace alces::offline
