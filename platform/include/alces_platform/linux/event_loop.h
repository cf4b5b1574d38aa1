// One epoll loop: everything that enters from the world passes through it, on one thread, into one EventSink.
//
// A round: wait; let the devices that are ready read and deliver; then, if 10 ms have passed, deliver a tick;
// then let devices send what was queued meanwhile. Devices send only then, so a sink is never entered twice:
// what a driver writes while it handles one event comes back as can_sent or bytes_sent after that event is
// done with.
//
// Fixed capacities, stated below; no heap after open(). Signals are blocked in the thread that calls open()
// and in those it starts afterwards: open the loop first. Sources: epoll(7), timerfd_create(2), signalfd(2).
#pragma once

#include <array>
#include <cstdint>

#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/scanner/event.h"
#include "alces_drivers/stamp.h"
#include "alces_platform/linux/clock.h"
#include "alces_platform/linux/file_descriptor.h"
#include "alces_platform/linux/message.h"
#include "alces_platform/linux/retry_delay.h"

namespace alces {

/// A device with descriptors in the loop.
class EventSource {
 public:
  /// The descriptor that was watched with `token` is ready (epoll's bits). To read a bounded amount and
  /// return: what is left makes it ready again.
  virtual void on_ready(std::uint32_t token, std::uint32_t epoll_events) = 0;
  /// Before each tick event: retries, time-outs.
  virtual void on_tick(std::int64_t now_ns) = 0;
  /// At the end of each round: send what is queued.
  virtual void flush(std::int64_t now_ns) = 0;

 protected:
  ~EventSource() = default;
};

struct EventLoopConfig {
  std::int64_t tick_interval_ns = 10 * ns_per_ms;
  /// SIGTERM, SIGINT and SIGHUP become counts, SIGUSR1 an event (a person resets the motor); false: they keep
  /// their meaning.
  bool take_signals = true;
  std::int64_t (*suspended_ns)() = alces::suspended_ns;  ///< for tests
};

class EventLoop {
 public:
  static constexpr std::uint32_t source_capacity = 16;
  static constexpr std::uint32_t watch_capacity = 64;
  /// A loop held up for longer says so.
  static constexpr std::int64_t tolerable_delay_ns = 50 * ns_per_ms;
  /// A machine that was suspended for longer is told of, by an event before the next tick.
  static constexpr std::int64_t tolerable_suspension_ns = 100 * ns_per_ms;

  /// A watched descriptor. It goes stale by itself when it is unwatched.
  struct Watch {
    std::uint32_t slot = UINT32_MAX;
    std::uint32_t generation = 0;
    [[nodiscard]] explicit operator bool() const { return slot != UINT32_MAX; }
  };

  struct Counters {
    std::uint64_t rounds = 0;
    std::uint64_t ticks = 0;            ///< delivered
    std::uint64_t ticks_missed = 0;     ///< due, but an earlier one was delivered late; not made up for
    std::uint64_t stop_requests = 0;    ///< SIGTERM, SIGINT, request_stop()
    std::uint64_t reload_requests = 0;  ///< SIGHUP
    std::uint64_t motor_resets = 0;     ///< SIGUSR1
    std::uint64_t suspensions = 0;      ///< of the machine
    std::uint64_t wakes = 0;            ///< ticks for wake_at()

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("rounds", rounds);
      visit("ticks", ticks);
      visit("ticks_missed", ticks_missed);
      visit("stop_requests", stop_requests);
      visit("reload_requests", reload_requests);
      visit("motor_resets", motor_resets);
      visit("suspensions", suspensions);
      visit("wakes", wakes);
    }
  };

  EventLoop(EventSink& sink, NoticePort& notices) : sink_(sink), notices_(notices) {}
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;
  ~EventLoop() { close(); }

  /// False: error() says why, and nothing is left open.
  [[nodiscard]] bool open(const EventLoopConfig& config);
  /// Gives signals back their meaning of before open(). Devices are to be closed first.
  void close();
  [[nodiscard]] const char* error() const { return error_.text(); }

  /// One round; returns after at most one tick interval. The program's main loop:
  ///   while (!finished) loop.run_once();
  /// and a stop is orderly when the program, once stop_requests() is not 0, stops its drivers, goes on with
  /// rounds until they have stopped, and only then finishes.
  void run_once();
  /// One more tick at this time, once; no_stamp_ns: none. For what must not wait for the next regular one.
  void wake_at(std::int64_t stamp_ns);
  [[nodiscard]] std::uint64_t stop_requests() const { return counters_.stop_requests; }
  [[nodiscard]] std::uint64_t reload_requests() const { return counters_.reload_requests; }
  void request_stop() { ++counters_.stop_requests; }

  /// For devices. False: source_capacity is reached.
  [[nodiscard]] bool attach(EventSource& source);
  void detach(EventSource& source);
  /// `epoll_events`: EPOLLIN, EPOLLOUT, ...; level-triggered. A false Watch: watch_capacity is reached or
  /// epoll refuses.
  [[nodiscard]] Watch watch(int descriptor, std::uint32_t epoll_events, EventSource& source,
                            std::uint32_t token);
  void change(Watch watch, std::uint32_t epoll_events);
  /// Before the descriptor is closed. What is still pending for it in this round is not delivered.
  void unwatch(Watch& watch);

  [[nodiscard]] EventSink& sink() { return sink_; }
  void raise(std::int64_t now_ns, Severity severity, const char* source, const char* text) {
    notices_.raise({.stamp_ns = now_ns, .severity = severity, .source = source, .text = text});
  }
  void raise(std::int64_t now_ns, Severity severity, const char* source, const char* text,
             std::int64_t value) {
    notices_.raise({.stamp_ns = now_ns,
                    .severity = severity,
                    .source = source,
                    .text = text,
                    .value = value,
                    .has_value = true});
  }

  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  struct Slot {
    EventSource* source = nullptr;  ///< null: free
    int descriptor = -1;
    std::uint32_t token = 0;
    std::uint32_t generation = 0;
  };

  [[nodiscard]] bool add_own(int descriptor, std::uint64_t mark);
  void take_signals();
  void tick();
  void wake();
  void deliver_tick(std::int64_t now_ns);
  void flush();

  EventSink& sink_;
  NoticePort& notices_;
  EventLoopConfig config_;
  FileDescriptor epoll_;
  FileDescriptor timer_;
  FileDescriptor wake_timer_;
  std::int64_t wake_ns_ = no_stamp_ns;  ///< what wake_at() was told last
  std::int64_t suspended_before_ns_ = 0;
  FileDescriptor signals_;
  bool has_blocked_signals_ = false;
  std::uint32_t was_blocked_ = 0;  ///< which of our signals were blocked before, one bit each
  std::array<Slot, watch_capacity> slots_{};
  std::array<EventSource*, source_capacity> sources_{};
  RateLimiter delay_notice_{10 * ns_per_s};
  Counters counters_;
  Message error_;
};

}  // namespace alces
