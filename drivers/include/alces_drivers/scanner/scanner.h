// The scanner as a whole: motor, encoder, lasers, odometry and GPS, brought up in order, watched, brought
// back, stopped in order; events in, scans out.
//
//   start ─> motor to speed ─> lasers measure ─> scanning
//   stop  ─> lasers end their streams ─> motor stands and is disabled, and the drive says so ─> stopped
//   stop again: the motor's quick stop at once, without waiting for the lasers
//
// Each device brings itself up again when it fails (motor.h, laser.h). The scanner adds what only shows from
// above: a laser that says it measures and delivers nothing is begun anew; a motor at speed without an angle,
// profiles without a scan, are told; and when the motor does not come up in motor_patience_ns the lasers are
// started all the same, so that the drive's raw data is there. Lasers are not given up before stop(); a motor
// that has failed too often is disabled until a person resets it, and one without a permit is held.
//
// One stream of events, in the order in which they came (event.h), makes everything happen; the same events
// give the same scans to the bit, live, replayed or simulated. Time is what the events say.
//
// Memory: one block from the caller, memory_required(config) bytes: about 330 KiB with one LMS 2xx, and what
// ScanAssembler takes. One thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "alces/arena.h"
#include "alces_drivers/assembler/scan.h"
#include "alces_drivers/assembler/scan_assembler.h"
#include "alces_drivers/cola_b/cola_b.h"
#include "alces_drivers/encoder/encoder.h"
#include "alces_drivers/gps/gps.h"
#include "alces_drivers/lms2xx/lms2xx.h"
#include "alces_drivers/motor/motor.h"
#include "alces_drivers/notice_rate_limiter.h"
#include "alces_drivers/odometry/odometry.h"
#include "alces_drivers/port/byte_port.h"
#include "alces_drivers/port/can_port.h"
#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/scanner/event.h"

namespace alces {

enum class LaserMake : std::uint8_t { lms2xx, cola_b };

struct ScannerConfig {
  static constexpr std::uint32_t maximum_lasers = ScanAssemblerConfig::maximum_lasers;

  bool has_motor = true;  ///< false: somebody else turns the head
  MotorConfig motor;
  EncoderConfig encoder;
  /// The drive samples its position at the SYNC (synchronous TPDOs): the position's time is that of the SYNC,
  /// not of the frame.
  bool position_is_sampled_at_sync = true;

  std::array<LaserMake, maximum_lasers> laser_makes{};  ///< of assembler.laser_count lasers
  std::array<Lms2xxConfig, maximum_lasers> lms2xx{};
  std::array<ColaBConfig, maximum_lasers> cola_b{};

  bool has_odometry = true;
  OdometryConfig odometry;
  bool has_gps = false;
  GpsConfig gps;

  ScanAssemblerConfig assembler;

  std::int64_t motor_patience_ns = 60 * ns_per_s;     ///< then the lasers start without it
  std::int64_t laser_silence_ns = 5 * ns_per_s;       ///< measuring, and no profile: begun anew
  std::int64_t scan_patience_ns = 10 * ns_per_s;      ///< profiles, and no scan: told
  std::int64_t laser_stop_timeout_ns = 3 * ns_per_s;  ///< then the motor is stopped without waiting
};

/// Null, or one clause that names the value that cannot be.
[[nodiscard]] const char* validate(const ScannerConfig& config);

enum class ScannerPhase : std::uint8_t {
  stopped,
  starting_motor,
  starting_lasers,
  scanning,
  stopping_lasers,
  stopping_motor,
  left,  ///< ended, but the drive did not confirm that the motor stands
};
[[nodiscard]] const char* to_string(ScannerPhase phase);

/// What a driver's counters are summed under, for people and recordings.
enum class ScannerPart : std::uint8_t {
  scanner,
  motor,
  encoder,
  laser_a,
  laser_b,
  odometry,
  gps,
  assembler,
  count
};
[[nodiscard]] const char* to_string(ScannerPart part);

class Scanner final : public EventSink {
 public:
  struct Counters {
    std::uint64_t events = 0;
    std::uint64_t ticks = 0;
    std::uint64_t events_of_unknown_channel = 0;
    std::uint64_t stamps_absurd = 0;         ///< negative, or beyond latest_stamp_ns: left out
    std::uint64_t laser_restarts = 0;        ///< by us, for silence
    std::uint64_t starts_without_motor = 0;  ///< patience was over
    std::uint64_t scan_droughts = 0;         ///< profiles came, scans did not
    std::uint64_t time_went_back = 0;        ///< ticks before the one before

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("events", events);
      visit("ticks", ticks);
      visit("events_of_unknown_channel", events_of_unknown_channel);
      visit("stamps_absurd", stamps_absurd);
      visit("laser_restarts", laser_restarts);
      visit("starts_without_motor", starts_without_motor);
      visit("scan_droughts", scan_droughts);
      visit("time_went_back", time_went_back);
    }
  };

  /// Where bytes to lasers go, by laser; what is not there may be null.
  struct Ports {
    CanPort* can = nullptr;
    std::array<BytePort*, ScannerConfig::maximum_lasers> lasers{};
  };

  /// Bytes that create() needs.
  [[nodiscard]] static std::size_t memory_required(const ScannerConfig& config);

  /// Lays a scanner out in `block` (64-byte aligned), which must outlive it, as must all that is referred to.
  /// Null, and `status` says why; validate(config) says what is wrong with bad_config.
  [[nodiscard]] static Scanner* create(std::span<std::byte> block, const ScannerConfig& config,
                                       const Ports& ports, ScanSink& sink, NoticePort& notices,
                                       AssemblerStatus& status);

  /// Both take effect with the next tick; a second stop() hurries. To have a recording know of the stop, send
  /// EventKind::stop instead.
  void start() { wants_to_run_ = true; }
  void stop() {
    is_hurried_ = !wants_to_run_ && !has_ended();
    wants_to_run_ = false;
  }
  /// The events end (a recording is over): what waits becomes a last, incomplete scan.
  void finish() { assembler_->finish(); }

  void on_event(const Event& event) override;
  /// When the next tick is wanted, beside the regular ones; no_stamp_ns: none is.
  [[nodiscard]] std::int64_t next_wake_ns() const {
    return config_.has_motor ? motor_.next_sync_ns() : no_stamp_ns;
  }
  /// Every profile that goes into a scan: see ScanAssembler.
  void observe_profiles(PlacedProfileSink* observer) { assembler_->observe_profiles(observer); }

  [[nodiscard]] ScannerPhase phase() const { return phase_; }
  [[nodiscard]] bool is_stopped() const { return phase_ == ScannerPhase::stopped; }
  /// Nothing more will happen by itself: stopped, or left.
  [[nodiscard]] bool has_ended() const { return is_stopped() || phase_ == ScannerPhase::left; }
  /// From stop() to has_ended(), at the most.
  [[nodiscard]] static std::int64_t stop_limit_ns(const ScannerConfig& config) {
    return config.laser_stop_timeout_ns + (config.has_motor ? Motor::stop_limit_ns(config.motor) : 0);
  }
  /// What the phase waits for, or what is wrong, for people; static storage.
  [[nodiscard]] const char* reason() const;
  [[nodiscard]] const Motor& motor() const { return motor_; }
  [[nodiscard]] const Encoder& encoder() const { return encoder_; }
  [[nodiscard]] const Odometry& odometry() const { return odometry_; }
  [[nodiscard]] const Gps& gps() const { return gps_; }
  [[nodiscard]] const ScanAssembler& assembler() const { return *assembler_; }
  [[nodiscard]] std::uint32_t laser_count() const { return config_.assembler.laser_count; }
  [[nodiscard]] const Laser& laser(std::uint32_t number) const { return *lasers_[number].laser; }
  [[nodiscard]] const Counters& counters() const { return counters_; }

  /// Calls visit(part, name, value) for every counter of every part.
  template <class Visitor>
  void visit_counters(Visitor&& visit) const {
    for (std::uint8_t part = 0; part < static_cast<std::uint8_t>(ScannerPart::count); ++part) {
      visit_counters(static_cast<ScannerPart>(part), [&](const char* name, std::uint64_t value) {
        visit(static_cast<ScannerPart>(part), name, value);
      });
    }
  }
  /// Calls visit(name, value) for every counter of one part.
  template <class Visitor>
  void visit_counters(ScannerPart part, Visitor&& visit) const;

 private:
  /// Stands between a laser and the assembler, to see that profiles come.
  class LaserSlot final : public ProfileSink {
   public:
    void on_profile(const Profile& profile) override;

    Scanner* scanner = nullptr;
    Lms2xx* lms2xx = nullptr;
    ColaB* cola_b = nullptr;
    Laser* laser = nullptr;
    bool was_measuring = false;
    std::int64_t silent_since_ns = no_stamp_ns;  ///< of the last profile, or when it began to measure
    std::uint64_t profiles = 0;
  };
  /// Takes the drive's positions to the encoder.
  class Feedback final : public DriveFeedbackSink {
   public:
    void on_drive_feedback(const DriveFeedback& feedback) override;
    Scanner* scanner = nullptr;
  };
  class Scans final : public ScanSink {
   public:
    void on_scan(const Scan& scan) override;
    Scanner* scanner = nullptr;
    ScanSink* sink = nullptr;
  };
  /// For what has no port: takes nothing.
  class NoPort final : public CanPort, public BytePort {
   public:
    [[nodiscard]] bool send(const CanFrame&) override { return false; }
    [[nodiscard]] bool write(std::span<const std::uint8_t>) override { return false; }
    [[nodiscard]] bool set_baud_rate(std::uint32_t) override { return false; }
  };

  Scanner(const ScannerConfig& config, const Ports& ports, ScanSink& sink, NoticePort& notices);

  void obey(const Event& event);
  void on_tick(std::int64_t now_ns);
  void on_clock_step(std::int64_t step_ns, std::int64_t now_ns);
  void advance_phase(std::int64_t now_ns);
  void enter(ScannerPhase phase, std::int64_t now_ns);
  void watch(std::int64_t now_ns);
  void start_lasers(std::int64_t now_ns);
  [[nodiscard]] bool are_lasers(LaserState state) const;
  [[nodiscard]] LaserSlot* slot_of(std::uint8_t channel);
  void raise(std::int64_t now_ns, Severity severity, const char* text);

  ScannerConfig config_;
  NoPort no_port_;
  NoticePort& notices_;
  Feedback feedback_;
  Scans scans_;
  Motor motor_;
  Encoder encoder_;
  Odometry odometry_;
  Gps gps_;
  std::array<LaserSlot, ScannerConfig::maximum_lasers> lasers_{};
  ScanAssembler* assembler_ = nullptr;

  bool wants_to_run_ = false;
  bool is_hurried_ = false;
  ScannerPhase phase_ = ScannerPhase::stopped;
  std::int64_t phase_since_ns_ = no_stamp_ns;
  std::int64_t now_ns_ = no_stamp_ns;
  enum class NoticeKind : std::uint8_t { stamp, count };
  NoticeRateLimiter<NoticeKind> notice_limiter_;
  std::int64_t dry_since_ns_ = no_stamp_ns;  ///< of the last scan, or since when profiles come
  bool is_drought_told_ = false;
  Counters counters_;
};

template <class Visitor>
void Scanner::visit_counters(ScannerPart part, Visitor&& visit) const {
  switch (part) {
    case ScannerPart::scanner:
      counters_.visit(visit);
      break;
    case ScannerPart::motor:
      if (config_.has_motor) motor_.counters().visit(visit);
      break;
    case ScannerPart::encoder:
      encoder_.counters().visit(visit);
      break;
    case ScannerPart::laser_a:
    case ScannerPart::laser_b: {
      const std::uint32_t number = part == ScannerPart::laser_a ? 0 : 1;
      if (number >= laser_count()) break;
      const LaserSlot& slot = lasers_[number];
      if (slot.lms2xx != nullptr) {
        slot.lms2xx->counters().visit(visit);
        slot.lms2xx->ray_counters().visit(visit);
        slot.lms2xx->parser_counters().visit(visit);
        slot.lms2xx->clock_counters().visit(visit);
      } else {
        slot.cola_b->counters().visit(visit);
        slot.cola_b->parser_counters().visit(visit);
      }
      break;
    }
    case ScannerPart::odometry:
      if (config_.has_odometry) odometry_.counters().visit(visit);
      break;
    case ScannerPart::gps:
      if (!config_.has_gps) break;
      gps_.counters().visit(visit);
      gps_.line_counters().visit(visit);
      break;
    case ScannerPart::assembler:
      assembler_->counters().visit(visit);
      break;
    case ScannerPart::count:
      break;
  }
}

}  // namespace alces
