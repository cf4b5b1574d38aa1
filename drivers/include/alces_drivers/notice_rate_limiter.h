// Notices that cannot flood, however long a fault lasts; counters keep the exact numbers.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/stamp.h"

namespace alces {

/// Of each kind the first is told at once. While it goes on, the next ones are told a second, 2, 4, ... and
/// at last 64 s apart; after ten seconds without one it is news again. A fault of a day is told 1350 times,
/// not 86,400 times. Kind is an enum whose last value is `count`.
template <class Kind>
class NoticeRateLimiter {
 public:
  static constexpr std::int64_t first_spacing_ns = ns_per_s;
  static constexpr std::int64_t longest_spacing_ns = 64 * ns_per_s;
  static constexpr std::int64_t quiet_ns = 10 * ns_per_s;

  /// `source` must live as long as this.
  NoticeRateLimiter(NoticePort& port, const char* source) : port_(&port), source_(source) {}

  void raise(Kind kind, Severity severity, std::int64_t stamp_ns, const char* text) {
    if (is_due(kind, stamp_ns)) port_->raise({stamp_ns, severity, source_, text, 0, false});
  }
  void raise(Kind kind, Severity severity, std::int64_t stamp_ns, const char* text, std::int64_t value) {
    if (is_due(kind, stamp_ns)) port_->raise({stamp_ns, severity, source_, text, value, true});
  }

  /// How many were held back.
  [[nodiscard]] std::uint64_t held_back() const { return held_back_; }

 private:
  struct Told {
    std::int64_t last_ns = no_stamp_ns;  ///< of the last one told
    std::int64_t seen_ns = no_stamp_ns;  ///< of the last one, told or not
    std::int64_t spacing_ns = first_spacing_ns;
  };

  [[nodiscard]] bool is_due(Kind kind, std::int64_t stamp_ns) {
    Told& told = told_[static_cast<std::size_t>(kind)];
    const bool is_news =
        told.last_ns == no_stamp_ns || stamp_ns < told.last_ns || stamp_ns - told.seen_ns >= quiet_ns;
    told.seen_ns = stamp_ns;
    if (!is_news && stamp_ns - told.last_ns < told.spacing_ns) {
      ++held_back_;
      return false;
    }
    told.spacing_ns = is_news ? first_spacing_ns : std::min(2 * told.spacing_ns, longest_spacing_ns);
    told.last_ns = stamp_ns;
    return true;
  }

  NoticePort* port_;
  const char* source_;
  std::uint64_t held_back_ = 0;
  std::array<Told, static_cast<std::size_t>(Kind::count)> told_{};
};

}  // namespace alces
