// SICK LMS 1xx, LMS 5xx and TiM over CoLa B on TCP (port 2112).
//
// Start-up is a table of requests, each with the answer that it needs ("Telegram listing", SICK 8014631,
// chapters 3, 4):
//   SetAccessMode     log in as "authorized client", whose password hash is a published default
//   mLMPsetscancfg    frequency, resolution, field of view; LMS only, and only when configured
//   LMDscandatacfg    first echo, no remission, every scan
//   LMCstartmeas, Run, STlms until the mirror runs and the laser measures (up to a minute after power-on)
//   LMPoutputRange    how many rays will come: refused when there is no room for them (most_rays)
//   LMDscandata       start the stream
// An error answer (sFA) is told with its text; where a request is a courtesy that some firmware lacks it is
// passed over, otherwise the dialogue starts again after a pause, as it does after silence.
//
// Angles: these lasers count anticlockwise with 90 deg straight ahead; profiles have 0 there.
// Time: each telegram carries the laser's microseconds at the sweep and at its transmission. A
// MinimumDelayFilter learns host time from transmission and arrival; the ray times are the device's (see
// first_ray_offset_us). 32-bit microseconds wrap every 71.6 minutes and are unwrapped.
//
// A peer that sends garbage_limit_bytes without a frame among them is told, and its connection dropped.
//
// The connection is the platform's: it calls on_link(true) when connected, and again after a loss.
//
// Memory: about 24 KiB. Stack: under 1 KiB.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "alces_drivers/cola_b/frame.h"
#include "alces_drivers/cola_b/scan_data.h"
#include "alces_drivers/minimum_delay_filter.h"
#include "alces_drivers/notice_rate_limiter.h"
#include "alces_drivers/port/byte_port.h"
#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/scanner/laser.h"
#include "alces_drivers/scanner/profile.h"

namespace alces {

namespace cola_b {
enum class Model : std::uint8_t { lms1xx, lms5xx, tim };

/// What an error answer's code says ("Telegram listing", section "SOPAS error codes"); never null.
[[nodiscard]] const char* error_text(std::uint32_t code);
}  // namespace cola_b

struct ColaBConfig {
  const char* name = "laser a";  ///< in notices; static storage
  std::uint8_t laser = 0;        ///< in profiles
  cola_b::Model model = cola_b::Model::lms5xx;
  double scan_frequency_hz = 25;   ///< expected; set in the laser when sets_scan
  double straight_ahead_deg = 90;  ///< the laser's angle that is 0 in profiles
  bool sets_scan = false;          ///< have the laser take scan_frequency_hz and the three values below
  double angle_step_deg = 0.5;
  double start_angle_deg = -5;  ///< the laser's angle
  double stop_angle_deg = 185;
  std::uint32_t password_hash = 0xf4724744;
  /// A laser that says that its profiles have more rays is not let stream. Scanner sets rays_per_profile.
  std::uint32_t most_rays = Profile::maximum_rays;
  /// The stream is there already, or a recorded one is replayed: nothing is sent.
  bool is_listen_only = false;
};

/// What is wrong with it; null: nothing.
[[nodiscard]] const char* validate(const ColaBConfig& config);

// Final, and never deleted through its base: a virtual destructor would bring operator delete along.
// NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor)
class ColaB final : public Laser {
 public:
  struct Counters {
    std::uint64_t profiles = 0;
    std::uint64_t dialogues = 0;       ///< start-ups begun
    std::uint64_t requests = 0;        ///< repetitions included
    std::uint64_t writes_refused = 0;  ///< by the port
    std::uint64_t time_outs = 0;
    std::uint64_t error_responses = 0;     ///< sFA
    std::uint64_t refusals = 0;            ///< answers that say no
    std::uint64_t silences = 0;            ///< while measuring
    std::uint64_t telegrams_missed = 0;    ///< by the laser's telegram counter
    std::uint64_t telegrams_repeated = 0;  ///< the same telegram counter twice in a row
    std::uint64_t unreadable_scans = 0;    ///< scan data that could not be decoded or has too many rays
    std::uint64_t layers_refused = 0;      ///< scan data of a laser with several layers
    std::uint64_t telegrams_ignored = 0;   ///< good ones that nobody asked for
    std::uint64_t rays_without_range = 0;
    std::uint64_t peers_dropped = 0;  ///< connections ended because nothing but garbage came
    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("profiles", profiles);
      visit("dialogues", dialogues);
      visit("requests", requests);
      visit("writes_refused", writes_refused);
      visit("time_outs", time_outs);
      visit("error_responses", error_responses);
      visit("refusals", refusals);
      visit("silences", silences);
      visit("telegrams_missed", telegrams_missed);
      visit("telegrams_repeated", telegrams_repeated);
      visit("unreadable_scans", unreadable_scans);
      visit("layers_refused", layers_refused);
      visit("telegrams_ignored", telegrams_ignored);
      visit("rays_without_range", rays_without_range);
      visit("peers_dropped", peers_dropped);
    }
  };

  static constexpr std::size_t garbage_limit_bytes = std::size_t{256} << 10;

  ColaB(const ColaBConfig& config, BytePort& port, NoticePort& notices, ProfileSink& profiles);

  void start(std::int64_t now_ns) override;
  void stop(std::int64_t now_ns) override;
  void on_link(bool is_up, std::int64_t now_ns) override;
  void on_bytes(std::span<const std::uint8_t> bytes, std::int64_t stamp_ns) override;
  void on_tick(std::int64_t now_ns) override;
  [[nodiscard]] LaserState state() const override;
  [[nodiscard]] const char* reason() const override { return reason_; }

  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] const cola_b::FrameParser::Counters& parser_counters() const { return parser_.counters(); }

 private:
  enum class Phase : std::uint8_t {
    stopped,
    bad_config,
    waiting_for_link,
    backing_off,
    in_dialogue,
    measuring,
    stopping,
  };

  enum class NoticeKind : std::uint8_t { unreadable, layers, count };

  void enter(Phase phase, const char* reason);
  void begin(std::int64_t now_ns);
  void begin_step(std::int64_t now_ns);
  void next_step(std::int64_t now_ns);
  void transmit(std::int64_t now_ns);
  void back_off(std::int64_t now_ns, const char* why, std::int64_t value = 0);
  [[nodiscard]] bool do_rays_fit(std::span<const std::uint8_t> range, std::int64_t now_ns);
  void begin_measuring(std::int64_t now_ns);
  void on_payload(std::span<const std::uint8_t> payload, std::int64_t stamp_ns);
  void on_error_response(std::span<const std::uint8_t> payload, std::int64_t now_ns);
  void on_response(std::span<const std::uint8_t> result, std::int64_t now_ns);
  void on_scan(std::span<const std::uint8_t> payload, std::int64_t stamp_ns);
  void watch_status(std::uint16_t status, std::int64_t now_ns);
  void raise(std::int64_t now_ns, Severity severity, const char* text);
  void raise(std::int64_t now_ns, Severity severity, const char* text, std::int64_t value);

  ColaBConfig config_;
  BytePort& port_;
  NoticePort& notices_;
  ProfileSink& sink_;
  NoticeRateLimiter<NoticeKind> notice_limiter_;
  cola_b::FrameParser parser_;
  MinimumDelayFilter clock_;

  Phase phase_ = Phase::stopped;
  const char* reason_ = "not started";
  bool is_started_ = false;
  bool link_is_up_ = false;
  std::size_t garbage_bytes_ = 0;  ///< since the last frame, or since the connection
  bool is_garbage_told_ = false;   ///< since the last frame
  std::uint32_t step_ = 0;
  std::uint32_t tries_left_ = 0;
  bool is_waiting_to_ask_ = false;  ///< a poll: the next one is due at deadline_ns_
  std::int64_t step_limit_ns_ = 0;  ///< a poll: until when
  std::int64_t deadline_ns_ = 0;
  std::int64_t back_off_ns_ = 0;
  const char* told_failure_ = nullptr;

  bool has_counter_ = false;
  std::uint16_t last_telegram_ = 0;
  std::uint32_t counter_ = 0;  ///< the telegram counter, unwrapped
  bool has_device_time_ = false;
  std::uint32_t last_start_us_ = 0;
  std::int64_t device_us_ = 0;  ///< start_us, unwrapped
  std::int64_t ticked_ns_ = no_stamp_ns;
  std::int64_t last_scan_ns_ = no_stamp_ns;
  std::uint8_t told_status_ = 0;
  bool frequency_was_told_ = false;
  bool has_layers_ = false;  ///< one of them was seen: not this driver's laser
  Counters counters_;
  Profile profile_;
};

}  // namespace alces
