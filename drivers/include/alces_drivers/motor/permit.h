// May the head turn? A person says so through a GPIO line, a CAN message or a socket; the motor obeys.
//
// A permit is given by an edge, off and then on, that was seen from here: a level that is on at the start,
// after a time-out, after lost edges or after the machine was suspended gives none. It is gone as soon as it
// is off, when messages stay away for timeout_ns, when edges were lost, when ticks stayed away for longer
// than tick_gap_ns (nobody watched), and when the machine was suspended.
//
// It is no safety function: see docs/safety.md. O(1) a call.
#pragma once

#include <cstdint>

#include "alces_drivers/can_frame.h"
#include "alces_drivers/encoder/edge.h"
#include "alces_drivers/stamp.h"

namespace alces {

enum class PermitSource : std::uint8_t {
  none,    ///< nobody is asked: the motor may always turn
  gpio,    ///< a line: on gives the permit, once it has been on for debounce_ns
  can,     ///< repeated messages
  socket,  ///< repeated messages, as EventKind::order
};

struct PermitConfig {
  PermitSource source = PermitSource::none;
  std::int64_t timeout_ns = 500 * ns_per_ms;  ///< of messages: none for so long, and it is gone
  std::uint8_t line = 0;                      ///< which of the configured lines, as GpioEdge counts them
  bool is_active_low = false;                 ///< the line gives the permit when it is low
  std::int64_t debounce_ns = 20 * ns_per_ms;  ///< off is believed at once
  std::uint16_t cob_id = 0;                   ///< of the messages; on: (data[byte] & mask) == value
  std::uint8_t byte = 0;
  std::uint8_t mask = 0x01;
  std::uint8_t value = 0x01;
};

/// Null, or what cannot be.
[[nodiscard]] const char* validate(const PermitConfig& config);

class Permit {
 public:
  static constexpr std::int64_t tick_gap_ns = 500 * ns_per_ms;

  struct Counters {
    std::uint64_t given = 0;         ///< edges
    std::uint64_t withdrawn = 0;     ///< the source said off
    std::uint64_t timed_out = 0;     ///< it said nothing any more
    std::uint64_t not_watched = 0;   ///< lost edges, ticks that stayed away, suspended
    std::uint64_t without_edge = 0;  ///< on, although no off was seen before: gives none
    std::uint64_t malformed = 0;     ///< messages too short

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("permits_given", given);
      visit("permits_withdrawn", withdrawn);
      visit("permits_timed_out", timed_out);
      visit("permits_not_watched", not_watched);
      visit("permits_without_edge", without_edge);
      visit("permit_messages_malformed", malformed);
    }
  };

  explicit Permit(const PermitConfig& config) : config_(config) {}

  void on_edge(const GpioEdge& edge, std::int64_t stamp_ns);
  void on_edges_lost(std::uint8_t line);
  void on_frame(const CanFrame& frame, std::int64_t stamp_ns);
  void on_message(bool is_on, std::int64_t stamp_ns);
  /// The machine was suspended, or its source is not to be trusted: a new edge is needed.
  void forget();
  void on_tick(std::int64_t now_ns);

  [[nodiscard]] bool is_asked_for() const { return config_.source != PermitSource::none; }
  /// The motor may turn.
  [[nodiscard]] bool is_given() const { return !is_asked_for() || is_given_; }
  /// How many edges gave one: it has risen, there was a new one.
  [[nodiscard]] std::uint64_t edges() const { return counters_.given; }
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  enum class Level : std::uint8_t { unknown, off, on };

  void take(bool is_on, std::int64_t stamp_ns);
  void give();

  PermitConfig config_;
  Level level_ = Level::unknown;
  bool is_given_ = false;
  std::int64_t heard_ns_ = no_stamp_ns;     ///< the last message
  std::int64_t on_since_ns_ = no_stamp_ns;  ///< of a line that is to be on for debounce_ns
  std::int64_t last_tick_ns_ = no_stamp_ns;
  Counters counters_;
};

}  // namespace alces
