// Notices that cannot flood: of each kind at most one in a while; counters keep the exact numbers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/stamp.h"

namespace alces {

/// Kind is an enum whose last value is `count`.
template <class Kind>
class SpacedNotices {
 public:
  SpacedNotices(NoticePort& port, const char* source, std::int64_t spacing_ns = ns_per_s)
      : port_(&port), source_(source), spacing_ns_(spacing_ns) {
    last_ns_.fill(no_stamp_ns);
  }

  void raise(Kind kind, Severity severity, std::int64_t stamp_ns, const char* text) {
    if (is_due(kind, stamp_ns)) port_->raise({stamp_ns, severity, source_, text, 0, false});
  }
  void raise(Kind kind, Severity severity, std::int64_t stamp_ns, const char* text, std::int64_t value) {
    if (is_due(kind, stamp_ns)) port_->raise({stamp_ns, severity, source_, text, value, true});
  }

  /// How many were held back.
  [[nodiscard]] std::uint64_t held_back() const { return held_back_; }

 private:
  [[nodiscard]] bool is_due(Kind kind, std::int64_t stamp_ns) {
    std::int64_t& last_ns = last_ns_[static_cast<std::size_t>(kind)];
    if (last_ns != no_stamp_ns && stamp_ns >= last_ns && stamp_ns - last_ns < spacing_ns_) {
      ++held_back_;
      return false;
    }
    last_ns = stamp_ns;
    return true;
  }

  NoticePort* port_;
  const char* source_;
  std::int64_t spacing_ns_;
  std::uint64_t held_back_ = 0;
  std::array<std::int64_t, static_cast<std::size_t>(Kind::count)> last_ns_{};
};

}  // namespace alces
