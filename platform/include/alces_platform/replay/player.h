// Hands events on at a pace: as they were recorded, faster, slower, or as fast as possible.
#pragma once

#include <cstdint>
#include <functional>

#include "alces_platform/replay/event_source.h"

namespace alces::replay {

/// The time that the player waits by.
class ReplayClock {
 public:
  [[nodiscard]] virtual std::int64_t now_ns() = 0;
  virtual void sleep_until(std::int64_t time_ns) = 0;

 protected:
  ~ReplayClock() = default;
};

/// CLOCK_MONOTONIC.
class SteadyReplayClock final : public ReplayClock {
 public:
  [[nodiscard]] std::int64_t now_ns() override;
  void sleep_until(std::int64_t time_ns) override;
};

struct PlayerOptions {
  double speed = 0;  ///< seconds of the recording in a second; 1: as recorded, 0: as fast as possible
  std::function<bool()> is_stopped = [] {
    return false;
  };  ///< asked before every event, and 20 times a second of waiting
};

/// Returns how many events were handed on; their stamps are left alone. What comes late is handed on at once,
/// the pace stays that of the first event.
std::uint64_t play(EventSource& source, EventSink& sink, ReplayClock& clock, const PlayerOptions& options);

}  // namespace alces::replay
