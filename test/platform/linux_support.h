// What the tests of platform/linux share: a sink and a notice port that keep everything, and a loop around
// them.
#pragma once

#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "alces_platform/linux/clock.h"
#include "alces_platform/linux/event_loop.h"

namespace alces::test {

struct KeptEvent {
  Event event;
  std::vector<std::uint8_t> bytes;  ///< event.bytes, copied
};

class KeepingSink final : public EventSink {
 public:
  void on_event(const Event& event) override {
    events.push_back({event, {event.bytes.begin(), event.bytes.end()}});
    events.back().event.bytes = {};
    if (then) then(event);
  }
  [[nodiscard]] std::vector<KeptEvent> of(EventKind kind) const {
    std::vector<KeptEvent> result;
    for (const KeptEvent& kept : events) {
      if (kept.event.kind == kind) result.push_back(kept);
    }
    return result;
  }
  /// The bytes of all events of a kind, one after the other.
  [[nodiscard]] std::string text(EventKind kind) const {
    std::string result;
    for (const KeptEvent& kept : of(kind)) result.append(kept.bytes.begin(), kept.bytes.end());
    return result;
  }
  std::vector<KeptEvent> events;
  std::function<void(const Event&)> then;
};

class KeepingNotices final : public NoticePort {
 public:
  void raise(const Notice& notice) override {
    notices.push_back(std::string(notice.source) + ": " + notice.text);
  }
  [[nodiscard]] std::size_t count(const std::string& part) const {
    std::size_t result = 0;
    for (const std::string& notice : notices) result += notice.find(part) != std::string::npos ? 1U : 0U;
    return result;
  }
  std::vector<std::string> notices;
};

/// A loop that takes no signals; tests of signals make their own.
struct LoopBench {
  KeepingSink sink;
  KeepingNotices notices;
  EventLoop loop{sink, notices};

  LoopBench() {
    if (!loop.open({.take_signals = false})) std::abort();
  }
  /// Rounds until `is_done`, at most `limit_s`: generous, for a machine that is busy with other things.
  bool run_until(const std::function<bool()>& is_done, double limit_s = 10) {
    const std::int64_t end_ns = now_ns() + static_cast<std::int64_t>(limit_s * 1e9);
    while (!is_done()) {
      if (now_ns() > end_ns) return false;
      loop.run_once();
    }
    return true;
  }
  void run_for(std::int64_t duration_ns) {
    const std::int64_t end_ns = now_ns() + duration_ns;
    while (now_ns() < end_ns) loop.run_once();
  }
};

inline std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// Clocks that stand still but for the time it takes to read them.
class FakeClocks final : public ClockReader {
 public:
  std::int64_t monotonic_ns() override { return monotonic += reading_ns; }
  std::int64_t realtime_ns() override { return (monotonic += reading_ns) + offset; }

  void pass(std::int64_t duration_ns) { monotonic += duration_ns; }
  /// The realtime stamp that the kernel would put on something that happens now.
  [[nodiscard]] std::int64_t stamp_now() const { return monotonic + offset; }

  std::int64_t monotonic = 1000 * ns_per_s;
  std::int64_t offset = 1'700'000'000 * ns_per_s;
  std::int64_t reading_ns = 0;
};

}  // namespace alces::test
