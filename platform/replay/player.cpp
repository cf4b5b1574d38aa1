#include "alces_platform/replay/player.h"

#include <algorithm>
#include <chrono>
#include <thread>

namespace alces::replay {
namespace {

constexpr std::int64_t longest_sleep_ns = 50'000'000;

}  // namespace

std::int64_t SteadyReplayClock::now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

void SteadyReplayClock::sleep_until(std::int64_t time_ns) {
  std::this_thread::sleep_until(std::chrono::steady_clock::time_point(std::chrono::nanoseconds(time_ns)));
}

std::uint64_t play(EventSource& source, EventSink& sink, ReplayClock& clock, const PlayerOptions& options) {
  std::uint64_t count = 0;
  std::int64_t first_ns = 0;
  std::int64_t begin_ns = 0;
  Event event;
  while (!options.is_stopped() && source.next(event)) {
    if (options.speed > 0) {
      if (count == 0) {
        first_ns = event.stamp_ns;
        begin_ns = clock.now_ns();
      }
      const double passed_ns = static_cast<double>(event.stamp_ns - first_ns) / options.speed;
      const std::int64_t due_ns = begin_ns + static_cast<std::int64_t>(std::min(passed_ns, 1e18));
      for (std::int64_t now_ns = clock.now_ns(); now_ns < due_ns; now_ns = clock.now_ns()) {
        if (options.is_stopped()) return count;
        clock.sleep_until(std::min(due_ns, now_ns + longest_sleep_ns));
      }
    }
    sink.on_event(event);
    ++count;
  }
  return count;
}

}  // namespace alces::replay
