// When an LMS 2xx telegram was sent, from when it arrived. The mirror turns at a constant rate and every
// telegram belongs to one turn; only the way to us varies. So telegrams are numbered by mirror turns, and a
// MinimumDelayFilter turns numbers into times.
//
// Numbers: with the laser's own turn index they are read off. Without it the next telegram is the next turn,
// unless bytes were lost on the way or the line is too slow for every turn: then the number is rounded from
// the arrival. A number that was wrong shows: telegrams that keep coming most of a turn late missed a turn,
// one that comes half a turn early was counted too far. Both are corrected and counted (in the second case
// the number steps back once).
#pragma once

#include <cstdint>
#include <optional>

#include "alces_drivers/minimum_delay_filter.h"

namespace alces::lms2xx {

class SweepClock {
 public:
  struct Counters {
    std::uint64_t turns_missed = 0;  ///< mirror turns without a telegram, beyond what the line cannot carry
    std::uint64_t corrections = 0;   ///< of the numbering, after the fact
    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("mirror_turns_missed", turns_missed);
      visit("mirror_turn_corrections", corrections);
    }
  };
  struct Sweep {
    std::int64_t number = 0;    ///< mirror turns since the first telegram
    std::int64_t stamp_ns = 0;  ///< when the telegram's last byte would have arrived with the least delay
  };
  struct Arrival {
    std::int64_t stamp_ns = 0;
    std::int64_t nominal_turns = 1;  ///< from telegram to telegram: more than 1 on a slow line
    bool bytes_were_lost = false;    ///< since the last telegram
    std::optional<std::uint8_t> turn_index = std::nullopt;
  };

  explicit SweepClock(double turns_per_s);

  Sweep add(const Arrival& arrival);
  /// The laser was silent or restarted: numbers go on, times are learned anew.
  void reset();
  /// The true length of a mirror turn, as learned.
  [[nodiscard]] double turn_ns() const { return turn_ns_ * (1 + filter_.drift()); }
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  [[nodiscard]] std::int64_t device_ns(std::int64_t number) const;
  [[nodiscard]] std::int64_t turns_since_last(const Arrival& arrival);

  double turn_ns_;
  MinimumDelayFilter filter_;
  bool has_last_ = false;
  std::int64_t number_ = 0;
  std::int64_t last_learned_ = 0;  ///< the number of the newest sweep that the filter learned from
  bool is_guess_ = false;          ///< the present number is
  std::optional<std::uint8_t> last_index_;
  std::uint32_t late_run_ = 0;   ///< telegrams in a row that came most of a turn late
  double least_late_turns_ = 0;  ///< among them
  Counters counters_;
};

}  // namespace alces::lms2xx
