// A SICK LMS 2xx seen from its serial connector: it takes the host's bytes, keeps the state that the real one
// keeps (baud rate, operating mode, field of view, configuration), and sends telegrams that leave at the
// line's rate.
//
//   laser.set_host_baud(9600);
//   laser.on_bytes(bytes, now_ns);                 // what the host sent
//   while (auto chunk = laser.poll(now_ns)) ...    // what has left the laser by now
//
// Both sides may differ in baud rate: then each hears garbage, the same garbage every time. Ranges come from
// a SweepSource. The mirror turns all the time; a sweep whose telegram would begin while the line is busy is
// left out, as the real laser does. Everything is a function of the calls: no clock, no random device.
//
// Known: 20 (modes 00, 24, 25, 2A and the baud rates), 31, 32, 3A, 3B, 74, 77, 10 (reset). Others are
// answered by 92
// ("not known"). Faults are injected by the calls at the end.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "alces_drivers/lms2xx/measured_values.h"
#include "alces_drivers/lms2xx/telegram.h"
#include "alces_drivers/stamp.h"
#include "alces_platform/sim/sensors/sweep_source.h"

namespace alces::sim {

struct SimulatedLms2xxSettings {
  std::uint32_t baud = 9600;  ///< that it is switched on with
  std::uint32_t field_of_view_deg = 180;
  std::uint32_t resolution_hundredths_deg = 100;
  lms2xx::Unit unit = lms2xx::Unit::cm;
  lms2xx::MeasuringMode mode = lms2xx::MeasuringMode::fields_a_b_dazzle;
  bool sends_turn_index = false;
  bool is_streaming = false;  ///< from the start: an earlier host left it so
  std::uint8_t address = 0;
  std::array<char, 8> password{'S', 'I', 'C', 'K', '_', 'L', 'M', 'S'};
  double turns_per_s = 75;
  std::int64_t first_ray_stamp_ns = 0;  ///< of mirror turn 0
  std::int64_t send_delay_ns = 0;       ///< from a sweep's last ray to its telegram
  std::int64_t response_delay_ns = 5 * ns_per_ms;
  std::int64_t write_delay_ns = 800 * ns_per_ms;  ///< of answers that write the EEPROM
};

class SimulatedLms2xx {
 public:
  struct Chunk {
    std::int64_t stamp_ns = 0;  ///< when its last byte arrived
    std::uint32_t baud = 0;     ///< that it was sent with
    std::vector<std::uint8_t> bytes;
  };
  struct Counters {
    std::uint64_t telegrams_taken = 0;
    std::uint64_t naks_sent = 0;
    std::uint64_t sweeps_sent = 0;
    std::uint64_t sweeps_left_out = 0;  ///< the line was busy
    std::uint64_t configuration_writes = 0;
    std::uint64_t variant_changes = 0;
  };

  SimulatedLms2xx(const SimulatedLms2xxSettings& settings, SweepSource& source);

  /// The host's side of the line; 0: always the laser's.
  void set_host_baud(std::uint32_t baud) { host_baud_ = baud; }
  /// now_ns never runs backwards, here and in poll().
  void on_bytes(std::span<const std::uint8_t> bytes, std::int64_t now_ns);
  /// What left the laser since the last call, at most one telegram's bytes at a time; nothing: no more by
  /// now_ns.
  [[nodiscard]] std::optional<Chunk> poll(std::int64_t now_ns);

  [[nodiscard]] std::uint32_t baud() const { return baud_; }
  [[nodiscard]] bool is_streaming() const {
    return mode_ == Mode::stream_all || mode_ == Mode::stream_partial;
  }
  [[nodiscard]] const SimulatedLms2xxSettings& settings() const { return settings_; }
  [[nodiscard]] const Counters& counters() const { return counters_; }

  // Faults.
  void send_garbage(std::span<const std::uint8_t> bytes, std::int64_t now_ns);  ///< after what is being sent
  void spoil_checksums(std::uint32_t telegrams) { spoiled_ = telegrams; }       ///< of the next ones
  void truncate_telegrams(std::uint32_t telegrams) {
    truncated_ = telegrams;
  }  ///< the next ones stop half way
  void swallow_telegrams(std::uint32_t telegrams) { swallowed_ = telegrams; }  ///< the next ones vanish whole
  void refuse(std::uint32_t telegrams) { refused_ = telegrams; }           ///< the host's next ones get NAK
  void set_connected(bool is_connected) { is_connected_ = is_connected; }  ///< the cable, both ways
  void switch_off();
  void switch_on(std::int64_t now_ns, std::uint32_t baud = 9600);  ///< sends 90 "power on"

 private:
  enum class Mode : std::uint8_t { on_request, installation, stream_all, stream_partial };
  struct Outgoing {
    std::int64_t start_ns = 0;
    std::uint32_t baud = 0;
    std::vector<std::uint8_t> bytes;
    std::size_t sent = 0;
  };

  void on_telegram(const lms2xx::Telegram& telegram, std::int64_t now_ns);
  std::uint8_t change_mode(std::span<const std::uint8_t> data);
  void send(std::uint8_t command, std::span<const std::uint8_t> data, std::int64_t earliest_ns);
  void enqueue(std::vector<std::uint8_t> bytes, std::int64_t earliest_ns);
  void measure(std::int64_t until_ns);
  void send_sweep(std::int64_t turn, std::int64_t ready_ns);
  [[nodiscard]] std::vector<std::uint8_t> configuration() const;
  [[nodiscard]] std::int64_t first_ray_ns(std::int64_t turn) const;
  [[nodiscard]] std::int64_t ready_ns(std::int64_t turn) const;
  [[nodiscard]] std::uint32_t interlacing() const { return 100 / settings_.resolution_hundredths_deg; }

  SimulatedLms2xxSettings settings_;
  SweepSource& source_;
  lms2xx::TelegramParser parser_{lms2xx::Direction::from_host};
  Mode mode_ = Mode::on_request;
  std::uint32_t baud_;
  std::uint32_t baud_after_response_ = 0;  ///< takes effect when all has been sent; 0: none
  std::uint32_t host_baud_ = 0;
  std::uint8_t availability_ = 0;
  bool is_on_ = true;
  bool is_connected_ = true;
  std::deque<Outgoing> outgoing_;
  std::int64_t line_free_ns_ = INT64_MIN;
  std::int64_t next_turn_ = 0;
  bool is_first_poll_ = true;
  std::uint8_t telegram_index_ = 0;
  std::uint64_t garbled_ = 0;  ///< counts garbled bytes, to make them differ
  std::uint32_t spoiled_ = 0;
  std::uint32_t truncated_ = 0;
  std::uint32_t swallowed_ = 0;
  std::uint32_t refused_ = 0;
  std::vector<float> ranges_m_;
  Counters counters_;
};

}  // namespace alces::sim
