// Lets notices through until one source raises too many, whatever their texts: a drive whose emergency
// messages change their codes, a peer that hangs up at once. What is held back is counted, and told with the
// next one that passes.
#pragma once

#include <array>
#include <cstdint>

#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/stamp.h"

namespace alces::onboard {

/// Of each source and severity `burst` notices at once, and one more each `refill_ns`: warnings do not drown
/// errors. Time is the notices' own stamps; one that goes back counts as none. Sources beyond the capacity
/// share a place. Memory: 1.5 KiB. Time: O(sources).
class NoticeLimiter {
 public:
  static constexpr std::uint32_t burst = 40;
  static constexpr std::int64_t refill_ns = 2 * ns_per_s;
  static constexpr std::size_t capacity = 48;

  /// False: it is to be held back. True: `held_back` says how many of this source and severity were, since
  /// the last one that passed.
  [[nodiscard]] bool may(const Notice& notice, std::uint64_t& held_back);

 private:
  struct Source {
    const char* name = nullptr;
    Severity severity = Severity::info;
    std::int64_t refilled_ns = 0;
    std::uint32_t left = burst;
    std::uint64_t held_back = 0;
  };
  [[nodiscard]] Source& source_of(const Notice& notice);

  std::array<Source, capacity> sources_{};
};

}  // namespace alces::onboard
