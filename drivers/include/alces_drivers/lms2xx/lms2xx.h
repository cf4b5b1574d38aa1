// SICK LMS 200/211/221/291 on a serial line (RS-422, RS-232).
//
// Bring-up (telegrams: SICK 8007954; command numbers there in hex):
//   search   20 25 "values on request" at every candidate rate, the target first, until A0 answers
//   rate     20 xx, then our side follows, then 20 25 again to see that both did
//   look     31 status (field of view, resolution) and 74 configuration (unit, measuring mode, index bytes)
//   set      only what differs, because it wears the laser's EEPROM: 20 00 + password, 3B variant, 77
//   configuration stream   20 24 with 1 deg; 20 2A with 0.5 and 0.25 deg
// Every command is acknowledged (ACK) or refused (NAK, result code), repeated on NAK and silence; when that
// does not help the search starts again, with back-off. Silence while measuring starts the search again at
// once.
//
// The mirror measures at whole degrees, 75 turns a second. Finer resolutions are interlaced: the rays between
// come with the next turns. 20 2A streams the turns as they are, and each becomes a profile of its own, with
// 1 deg between its rays and a first angle that is 0.25, 0.5 or 0.75 deg further. So every profile is one
// sweep, and time is linear in its rays; a telegram of interlaced turns mixed together (20 24) is refused.
//
// Time: ray i of the profile was measured i / 360 of a mirror turn after the first one, and the telegram
// leaves `send_delay_ns` after the mirror passed the end of the field of view. SweepClock gives the least
// delayed arrival; the time on the wire is taken off.
//
// Two things the serial line must do for us: rates that are not standard (500 000), and, for old lasers, a
// pause of about 55 us between the bytes we send.
//
// Memory: about 8 KiB. Stack: under 1 KiB.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "alces_drivers/lms2xx/measured_values.h"
#include "alces_drivers/lms2xx/sweep_clock.h"
#include "alces_drivers/lms2xx/telegram.h"
#include "alces_drivers/port/byte_port.h"
#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/scanner/laser.h"
#include "alces_drivers/scanner/profile.h"

namespace alces {

struct Lms2xxConfig {
  const char* name = "laser a";                   ///< in notices; static storage
  std::uint8_t laser = 0;                         ///< in profiles
  std::uint8_t address = 0;                       ///< of the laser; 0 reaches any
  std::uint32_t field_of_view_deg = 180;          ///< 100 or 180, about straight ahead
  std::uint32_t resolution_hundredths_deg = 100;  ///< 100, 50 or 25; 25 with 100 deg only
  lms2xx::Unit unit = lms2xx::Unit::cm;
  lms2xx::MeasuringMode mode = lms2xx::MeasuringMode::fields_a_b_dazzle;
  bool with_turn_index = false;  ///< have the laser count its mirror turns in each telegram
  std::uint32_t baud = 500000;   ///< to measure at: 9600, 19200, 38400 or 500000
  std::array<std::uint32_t, 4> candidate_bauds{9600, 38400, 19200,
                                               500000};  ///< searched after `baud`; 0: none
  std::array<char, 8> password{'S', 'I', 'C', 'K', '_', 'L', 'M', 'S'};
  double turns_per_s = 75;
  std::int64_t send_delay_ns = 0;  ///< from the end of the field of view to the telegram's first byte
  /// The laser streams already, or its recorded stream is replayed: nothing is sent, nothing is asked.
  bool is_listen_only = false;
};

/// What is wrong with it; null: nothing.
[[nodiscard]] const char* validate(const Lms2xxConfig& config);

// Final, and never deleted through its base: a virtual destructor would bring operator delete along.
// NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor)
class Lms2xx final : public Laser {
 public:
  struct Counters {
    std::uint64_t profiles = 0;
    std::uint64_t searches = 0;  ///< rounds of the search for the baud rate
    std::uint64_t requests = 0;  ///< commands sent, repetitions included
    std::uint64_t repetitions = 0;
    std::uint64_t writes_refused = 0;  ///< by the port
    std::uint64_t naks = 0;
    std::uint64_t time_outs = 0;
    std::uint64_t refusals = 0;               ///< result codes that say no
    std::uint64_t silences = 0;               ///< while measuring
    std::uint64_t unexpected_layouts = 0;     ///< value telegrams that are not what was configured
    std::uint64_t telegrams_ignored = 0;      ///< good ones that nobody asked for
    std::uint64_t polluted_telegrams = 0;     ///< status bit: the front window is dirty
    std::uint64_t implausible_telegrams = 0;  ///< status bit: measured values implausible
    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("profiles", profiles);
      visit("baud_rate_searches", searches);
      visit("requests", requests);
      visit("repetitions", repetitions);
      visit("writes_refused", writes_refused);
      visit("naks", naks);
      visit("time_outs", time_outs);
      visit("refusals", refusals);
      visit("silences", silences);
      visit("unexpected_layouts", unexpected_layouts);
      visit("telegrams_ignored", telegrams_ignored);
      visit("polluted_telegrams", polluted_telegrams);
      visit("implausible_telegrams", implausible_telegrams);
    }
  };

  Lms2xx(const Lms2xxConfig& config, BytePort& port, NoticePort& notices, ProfileSink& profiles);

  void start(std::int64_t now_ns) override;
  void stop(std::int64_t now_ns) override;
  void on_link(bool is_up, std::int64_t now_ns) override;
  void on_bytes(std::span<const std::uint8_t> bytes, std::int64_t stamp_ns) override;
  void on_tick(std::int64_t now_ns) override;
  [[nodiscard]] LaserState state() const override;
  [[nodiscard]] const char* reason() const override { return reason_; }

  [[nodiscard]] std::uint32_t baud() const { return baud_; }
  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] const lms2xx::RayCounters& ray_counters() const { return ray_counters_; }
  [[nodiscard]] const lms2xx::TelegramParser::Counters& parser_counters() const { return parser_.counters(); }
  [[nodiscard]] const lms2xx::SweepClock::Counters& clock_counters() const { return clock_.counters(); }

 private:
  enum class Phase : std::uint8_t {
    stopped,
    bad_config,
    waiting_for_link,
    backing_off,
    searching,
    changing_rate,
    settling,
    confirming_rate,
    reading_status,
    reading_configuration,
    entering_installation,
    setting_variant,
    writing_configuration,
    starting_stream,
    measuring,
    stopping,
  };

  void search(std::int64_t now_ns);
  void try_next_rate(std::int64_t now_ns);
  void back_off(std::int64_t now_ns, const char* why);
  void enter(Phase phase, const char* reason);
  void request(std::span<const std::uint8_t> payload, std::int64_t time_out_ns, std::int64_t now_ns);
  void request_mode(std::uint8_t mode, std::int64_t time_out_ns, std::int64_t now_ns);
  void transmit(std::int64_t now_ns);
  void repeat_or_give_up(std::int64_t now_ns, const char* why);
  [[nodiscard]] bool awaits_response() const;

  void on_nak(std::int64_t now_ns);
  void on_ack(std::int64_t now_ns);
  void on_telegram(const lms2xx::Telegram& telegram, std::int64_t end_stamp_ns, std::int64_t now_ns);
  void on_response(const lms2xx::Telegram& telegram, std::int64_t now_ns);
  void on_values(const lms2xx::Telegram& telegram, std::int64_t end_stamp_ns);
  void watch_status(std::uint8_t status, std::int64_t now_ns);
  void give_up_stale_bytes(std::int64_t now_ns);

  void rate_is_found(std::int64_t now_ns);
  void configure_next(std::int64_t now_ns);
  void start_stream(std::int64_t now_ns);
  void begin_measuring(std::int64_t now_ns);
  void raise(std::int64_t now_ns, Severity severity, const char* text);
  void raise(std::int64_t now_ns, Severity severity, const char* text, std::int64_t value);
  [[nodiscard]] bool set_rate(std::uint32_t baud, std::int64_t now_ns);
  [[nodiscard]] double byte_ns() const { return 1e10 / baud_; }  // start bit, 8 bits, stop bit
  [[nodiscard]] std::int64_t nominal_turns(std::size_t telegram_bytes) const;
  [[nodiscard]] std::int64_t silence_limit_ns() const;

  Lms2xxConfig config_;
  BytePort& port_;
  NoticePort& notices_;
  ProfileSink& sink_;
  lms2xx::TelegramParser parser_{lms2xx::Direction::from_laser};
  lms2xx::SweepClock clock_;

  Phase phase_ = Phase::stopped;
  const char* reason_ = "not started";
  bool is_started_ = false;
  bool link_is_up_ = true;
  std::uint32_t baud_ = 9600;
  std::uint32_t candidate_ = 0;     ///< which rate the search tries: 0 is the target
  bool target_is_possible_ = true;  ///< the line can do config_.baud
  bool rate_is_proven_ = false;     ///< a good telegram came at this rate
  bool was_acknowledged_ = false;   ///< or what looks like it came, at this rate
  std::int64_t deadline_ns_ = 0;
  std::int64_t back_off_ns_ = 0;        ///< the next pause
  const char* told_failure_ = nullptr;  ///< of this outage: not told again

  std::array<std::uint8_t, 64> request_{};  ///< command and data, kept for repetition
  std::size_t request_size_ = 0;
  std::int64_t request_time_out_ns_ = 0;
  std::uint32_t tries_left_ = 0;

  bool variant_differs_ = false;
  bool configuration_differs_ = false;
  std::array<std::uint8_t, 34> configuration_{};

  std::int64_t ticked_ns_ = no_stamp_ns;
  std::int64_t last_bytes_ns_ = no_stamp_ns;
  std::int64_t last_values_ns_ = no_stamp_ns;
  std::uint64_t damage_seen_ = 0;  ///< parser counters at the last value telegram
  std::uint32_t unexpected_in_a_row_ = 0;
  std::uint8_t told_status_ = 0;  ///< the last severity and pollution that were told of
  Counters counters_;
  lms2xx::RayCounters ray_counters_;
  Profile profile_;
};

}  // namespace alces
