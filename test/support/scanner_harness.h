// The whole scanner (drivers/scanner.h) on the simulated vehicle, with a recording beside it: for tests of
// what goes wrong. Lasers measure a round room, so that a second costs no rays.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "alces_drivers/scanner/scanner.h"
#include "alces_platform/recording/recording_writer.h"
#include "alces_platform/settings/vehicle_settings.h"
#include "alces_platform/sim/simulated_scanner.h"

namespace alces {

/// Walls at 5 m all round, and no cost.
class RoundRoom final : public sim::SweepSource {
 public:
  void sweep(std::int64_t, double, std::span<float> ranges_m) override { std::ranges::fill(ranges_m, 5.0F); }
};

/// A disk of which only the length of what is written is kept; it may be full for a while.
class CountingSink final : public ByteSink {
 public:
  [[nodiscard]] bool write(std::span<const std::uint8_t> piece) override {
    if (is_full) return false;
    bytes += piece.size();
    return true;
  }
  bool is_full = false;
  std::uint64_t bytes = 0;
};

/// True while the drivers work, and nothing else: not the simulation behind their ports, nor the test.
inline bool is_in_drivers = false;

class OutsideDrivers {
 public:
  OutsideDrivers() : before_(is_in_drivers) { is_in_drivers = false; }
  OutsideDrivers(const OutsideDrivers&) = delete;
  OutsideDrivers& operator=(const OutsideDrivers&) = delete;
  ~OutsideDrivers() { is_in_drivers = before_; }

 private:
  bool before_;
};

/// What a test may change before the scanner is made.
struct HarnessSettings {
  sim::SimulatedScannerSettings simulated;
  ScannerConfig scanner;
  std::uint32_t lasers = 1;
  sim::HeadMotor* head = nullptr;  ///< turns the head instead of the drive
  bool records = true;
};

/// One laser, switched on at 500,000 baud and already configured; the vehicle rolls after 2 s.
[[nodiscard]] inline HarnessSettings harness_settings(std::uint32_t lasers = 1) {
  HarnessSettings settings;
  settings.lasers = lasers;
  settings.simulated.rig.lasers = static_cast<std::uint8_t>(lasers);
  settings.simulated.rig.motion.scans = 40;
  settings.simulated.rig.motion.standstill_s = 2;
  settings.simulated.rig.gps.open_sky_for_fix = 0;  // no outages but those that are injected
  for (sim::SimulatedLms2xxSettings& laser : settings.simulated.lasers) laser.baud = 500'000;
  settings.scanner = settings::default_vehicle_settings().scanner;
  ScanAssemblerConfig& assembler = settings.scanner.assembler;
  assembler.laser_count = lasers;
  assembler.expected_profiles = 90 * lasers;
  assembler.minimum_profiles = 60 * lasers;
  return settings;
}

class ScannerHarness final : public EventSink, public ScanSink, public NoticePort {
 public:
  struct ScanSeen {
    std::int64_t reference_stamp_ns = 0;
    std::int64_t begin_stamp_ns = 0;
    std::int64_t end_stamp_ns = 0;
    std::uint32_t number = 0;
    std::uint32_t profiles = 0;
    std::uint32_t missing = 0;
    std::size_t points = 0;
    double head_turn_rad = 0;
    double angle_sigma_rad = 0;
    bool is_incomplete = false;
    bool has_odometry = false;
    bool has_gps = false;
    Eigen::Vector3d gps_position_m = Eigen::Vector3d::Zero();
    Pose odometry_from_body;
  };
  /// What the devices deliver, to be compared with itself some time later.
  struct Delivery {
    std::uint64_t positions = 0;  ///< of the drive
    std::uint64_t pulses = 0;
    std::uint64_t profiles = 0;
    std::uint64_t odometry = 0;
    std::uint64_t fixes = 0;
  };

  explicit ScannerHarness(const HarnessSettings& settings = harness_settings())
      : town_(shared_town(settings.simulated.rig.motion)),
        simulated_(with_room(settings.simulated, room_), town_),
        now_ns_(simulated_.rig().motion().start_stamp_ns()),
        begin_ns_(now_ns_) {
    if (settings.head != nullptr) simulated_.rig().attach(*settings.head);
    const std::size_t bytes = Scanner::memory_required(settings.scanner);
    memory_.resize(bytes + 64);
    AssemblerStatus status{};
    const Scanner::Ports ports{&can_port_, {&laser_ports_[0], &laser_ports_[1]}};
    scanner_ = Scanner::create(aligned(memory_, bytes), settings.scanner, ports, *this, *this, status);

    if (!settings.records) return;
    RecordingConfig recording;
    recording.chunk_bytes = std::size_t{1} << 16;
    recording.begin_stamp_ns = now_ns_;
    const std::size_t recording_bytes = RecordingWriter::memory_required(recording);
    recording_memory_.resize(recording_bytes + 64);
    RecordingStatus recording_status{};
    recording_ = RecordingWriter::create(aligned(recording_memory_, recording_bytes), recording, disk, this,
                                         recording_status);
  }

  [[nodiscard]] Scanner& scanner() { return *scanner_; }
  [[nodiscard]] sim::SimulatedScanner& simulated() { return simulated_; }
  [[nodiscard]] sim::SimulatedRig& rig() { return simulated_.rig(); }
  [[nodiscard]] RecordingWriter& recording() { return *recording_; }
  [[nodiscard]] std::int64_t now_ns() const { return now_ns_; }
  [[nodiscard]] double now_s() const { return seconds(now_ns_ - begin_ns_); }

  void run_s(double duration_s) {
    now_ns_ += static_cast<std::int64_t>(duration_s * 1e9);
    simulated_.rig().advance_to(now_ns_, *this);
  }
  /// True: it was so within the limit.
  template <class Condition>
  bool run_until(double limit_s, Condition&& is_so) {
    for (double t_s = 0; t_s < limit_s; t_s += 0.1) {
      if (is_so()) return true;
      run_s(0.1);
    }
    return is_so();
  }
  /// From standstill to the second whole scan.
  bool bring_up(double limit_s = 30) {
    scanner_->start();
    return seconds_until_whole(limit_s) < limit_s;
  }
  /// How long until two whole scans in a row have been made of what was measured from now on.
  double seconds_until_whole(double limit_s = 30) {
    const std::size_t first = scans.size();
    const std::int64_t from_ns = now_ns_ + stamp_offset_ns;
    const double begin_s = now_s();
    const bool is_whole = run_until(limit_s, [&] {
      std::size_t in_a_row = 0;
      for (std::size_t i = first; i < scans.size(); ++i) {
        const bool counts = !scans[i].is_incomplete && scans[i].begin_stamp_ns >= from_ns;
        in_a_row = counts ? in_a_row + 1 : 0;
      }
      return in_a_row >= 2;
    });
    return is_whole ? now_s() - begin_s : std::numeric_limits<double>::infinity();
  }
  /// Begins now.
  void inject(sim::Fault fault, double duration_s = 0, std::int64_t argument = 0) {
    simulated_.rig().inject({fault, now_ns_, static_cast<std::int64_t>(duration_s * 1e9), argument});
  }
  /// The same for the whole of its duration.
  void suffer(sim::Fault fault, double duration_s, std::int64_t argument = 0) {
    inject(fault, duration_s, argument);
    run_s(duration_s);
  }

  [[nodiscard]] std::uint64_t counter(ScannerPart part, std::string_view name) const {
    std::uint64_t found = UINT64_MAX;
    scanner_->visit_counters(part, [&](const char* each, std::uint64_t value) {
      if (name == each) found = value;
    });
    return found;
  }
  [[nodiscard]] Delivery delivery() const {
    return {counter(ScannerPart::encoder, "positions"), counter(ScannerPart::encoder, "index_pulses"),
            counter(ScannerPart::assembler, "profiles"), counter(ScannerPart::odometry, "nodes"),
            counter(ScannerPart::gps, "fixes")};
  }
  [[nodiscard]] std::size_t times_told(std::string_view source, std::string_view text) const {
    return static_cast<std::size_t>(std::ranges::count_if(notices, [&](const Notice& notice) {
      return notice.source == source && std::string_view(notice.text).find(text) != std::string_view::npos;
    }));
  }
  [[nodiscard]] std::size_t whole_scans() const {
    return static_cast<std::size_t>(std::ranges::count(scans, false, &ScanSeen::is_incomplete));
  }
  [[nodiscard]] std::size_t incomplete_scans() const { return scans.size() - whole_scans(); }

  void on_event(const Event& event) override {
    Event shifted = event;
    shifted.stamp_ns += stamp_offset_ns;
    ++events;
    if (recording_ != nullptr) recording_->on_event(shifted);
    is_in_drivers = true;
    scanner_->on_event(shifted);
    is_in_drivers = false;
    if (also) also(event);
    const std::int64_t wake_ns = scanner_->next_wake_ns();
    simulated_.rig().wake_at(wake_ns == no_stamp_ns ? no_stamp_ns : wake_ns - stamp_offset_ns);
  }
  void on_scan(const Scan& scan) override {
    const OutsideDrivers outside;
    ++scans_seen;
    if (scan.is_incomplete) ++incomplete_scans_seen;
    points_seen += scan.points.size();
    scans.push_back({scan.reference_stamp_ns, scan.begin_stamp_ns, scan.end_stamp_ns, scan.number,
                     scan.profiles, scan.profiles_missing, scan.points.size(), scan.head_turn_rad,
                     scan.angle_sigma_rad, scan.is_incomplete, scan.has_odometry, scan.has_gps,
                     scan.gps_position_m, scan.odometry_from_body});
  }
  void raise(const Notice& notice) override {
    const OutsideDrivers outside;
    notices.push_back(notice);
  }

  /// Every profile, ray and scan is accounted for, and the recording holds every event: "" or what does not
  /// add up. Ends the recording.
  [[nodiscard]] std::string account() {
    const ScanAssemblerCounters& c = scanner_->assembler().counters();
    const std::uint64_t profiles = c.profiles_used + c.profiles_of_unknown_laser + c.profiles_absurd +
                                   c.profiles_without_room + c.profiles_angle_late + c.profiles_angle_lost +
                                   c.profiles_late + c.profiles_head_standing +
                                   scanner_->assembler().waiting_profiles();
    if (profiles != c.profiles) return "profiles do not add up";
    if (c.profiles != counter(ScannerPart::laser_a, "profiles") +
                          (scanner_->laser_count() > 1 ? counter(ScannerPart::laser_b, "profiles") : 0))
      return "the lasers' profiles are not the assembler's";
    const std::uint64_t rays = c.points + c.rays_without_range + c.rays_not_finite + c.rays_too_near +
                               c.rays_too_far + c.rays_masked + c.rays_without_room;
    if (rays != c.rays) return "rays do not add up";
    if (c.scans != scans_seen || c.scans_incomplete != incomplete_scans_seen) return "scans do not add up";
    if (points_seen > c.points) return "more points were handed on than were made";
    if (scanner_->counters().events != events) return "the scanner has not seen every event";
    if (recording_ == nullptr) return "";
    if (!recording_->finish()) return "the recording could not be ended";
    const mcap::Writer::Counters& file = recording_->file_counters();
    if (recording_->counters().events != events || recording_->counters().events_unknown != 0)
      return "the recording has not seen every event";
    if (file.messages_written + file.messages_lost != events) return "recorded messages do not add up";
    return "";
  }

  std::function<void(const Event&)> also;  ///< hears every event, after the scanner
  std::vector<ScanSeen> scans;
  std::vector<Notice> notices;
  CountingSink disk;
  std::uint64_t events = 0;
  std::uint64_t scans_seen = 0;
  std::uint64_t incomplete_scans_seen = 0;
  std::uint64_t points_seen = 0;
  /// Added to every event's stamp: the host's clock, against the simulation's.
  std::int64_t stamp_offset_ns = 0;

 private:
  class QuietCanPort final : public CanPort {
   public:
    explicit QuietCanPort(CanPort& port) : port_(port) {}
    [[nodiscard]] bool send(const CanFrame& frame) override {
      const OutsideDrivers outside;
      return port_.send(frame);
    }

   private:
    CanPort& port_;
  };
  class QuietBytePort final : public BytePort {
   public:
    explicit QuietBytePort(BytePort& port) : port_(port) {}
    [[nodiscard]] bool write(std::span<const std::uint8_t> bytes) override {
      const OutsideDrivers outside;
      return port_.write(bytes);
    }
    [[nodiscard]] bool set_baud_rate(std::uint32_t baud) override {
      const OutsideDrivers outside;
      return port_.set_baud_rate(baud);
    }

   private:
    BytePort& port_;
  };

  [[nodiscard]] static std::span<std::byte> aligned(std::vector<std::byte>& memory, std::size_t bytes) {
    const std::size_t offset = (64 - reinterpret_cast<std::uintptr_t>(memory.data()) % 64) % 64;
    return {memory.data() + offset, bytes};
  }
  [[nodiscard]] static sim::SimulatedScannerSettings with_room(sim::SimulatedScannerSettings settings,
                                                               RoundRoom& room) {
    for (sim::SweepSource*& sweeps : settings.sweeps) {
      if (sweeps == nullptr) sweeps = &room;
    }
    return settings;
  }
  /// The town is built once a program.
  [[nodiscard]] static std::shared_ptr<const sim::Town> shared_town(const sim::MotionSettings& motion) {
    static const auto town = std::make_shared<const sim::Town>(sim::make_tour(motion).layout);
    return town;  // of the first motion that asked: tours of one program are alike
  }

  RoundRoom room_;
  std::shared_ptr<const sim::Town> town_;
  sim::SimulatedScanner simulated_;
  std::int64_t now_ns_;
  std::int64_t begin_ns_;
  QuietCanPort can_port_{simulated_.rig().can_port()};
  std::array<QuietBytePort, 2> laser_ports_{QuietBytePort(simulated_.rig().byte_port(0)),
                                            QuietBytePort(simulated_.rig().byte_port(1))};
  std::vector<std::byte> memory_;
  std::vector<std::byte> recording_memory_;
  Scanner* scanner_ = nullptr;
  RecordingWriter* recording_ = nullptr;
};

}  // namespace alces
