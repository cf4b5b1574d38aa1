#include "alces_platform/linux/event_loop.h"

#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "alces_platform/linux/clock.h"

namespace alces {
namespace {

constexpr std::array taken_signals{SIGTERM, SIGINT, SIGHUP, SIGUSR1};

/// Marks in epoll's data: a slot's number and generation, or one of our own three.
constexpr std::uint64_t timer_mark = UINT64_MAX;
constexpr std::uint64_t signal_mark = UINT64_MAX - 1;
constexpr std::uint64_t wake_mark = UINT64_MAX - 2;

std::uint64_t mark(EventLoop::Watch watch) {
  return (std::uint64_t{watch.generation} << 32) | watch.slot;
}

sigset_t taken_set() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : taken_signals) sigaddset(&set, signal);
  return set;
}

std::timespec to_timespec(std::int64_t duration_ns) {
  return {.tv_sec = static_cast<std::time_t>(duration_ns / ns_per_s),
          .tv_nsec = static_cast<decltype(std::timespec::tv_nsec)>(duration_ns % ns_per_s)};
}

}  // namespace

bool EventLoop::add_own(int descriptor, std::uint64_t own_mark) {
  epoll_event event{.events = EPOLLIN, .data = {.u64 = own_mark}};
  return epoll_ctl(epoll_.number(), EPOLL_CTL_ADD, descriptor, &event) == 0;
}

bool EventLoop::open(const EventLoopConfig& config) {
  close();
  config_ = config;
  if (config.tick_interval_ns < ns_per_ms || config.tick_interval_ns > ns_per_s) {
    error_.set("event loop: a tick of %lld ns is not between 1 ms and 1 s",
               static_cast<long long>(config.tick_interval_ns));  // NOLINT(google-runtime-int): printf's
    return false;
  }
  const auto fail = [this](const char* call) {
    error_.set("event loop: %s failed: %s; see the limits of open files (ulimit -n)", call,
               std::strerror(errno));
    close();
    return false;
  };
  epoll_ = FileDescriptor(epoll_create1(EPOLL_CLOEXEC));
  if (!epoll_) return fail("epoll_create1");
  timer_ = FileDescriptor(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
  if (!timer_) return fail("timerfd_create");
  const std::timespec interval = to_timespec(config.tick_interval_ns);
  const itimerspec periodic{.it_interval = interval, .it_value = interval};
  if (timerfd_settime(timer_.number(), 0, &periodic, nullptr) != 0) return fail("timerfd_settime");
  if (!add_own(timer_.number(), timer_mark)) return fail("epoll_ctl");
  wake_timer_ = FileDescriptor(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
  if (!wake_timer_) return fail("timerfd_create");
  if (!add_own(wake_timer_.number(), wake_mark)) return fail("epoll_ctl");
  wake_ns_ = no_stamp_ns;
  suspended_before_ns_ = config.suspended_ns();
  if (config.take_signals) {
    const sigset_t set = taken_set();
    sigset_t before;
    if (pthread_sigmask(SIG_BLOCK, &set, &before) != 0) return fail("pthread_sigmask");
    has_blocked_signals_ = true;
    was_blocked_ = 0;
    for (std::size_t i = 0; i < taken_signals.size(); ++i) {
      if (sigismember(&before, taken_signals[i]) == 1) was_blocked_ |= 1U << i;
    }
    signals_ = FileDescriptor(signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC));
    if (!signals_) return fail("signalfd");
    if (!add_own(signals_.number(), signal_mark)) return fail("epoll_ctl");
  }
  error_.clear();
  return true;
}

void EventLoop::close() {
  signals_.reset();
  wake_timer_.reset();
  timer_.reset();
  epoll_.reset();
  if (has_blocked_signals_) {
    sigset_t unblock;
    sigemptyset(&unblock);
    for (std::size_t i = 0; i < taken_signals.size(); ++i) {
      if ((was_blocked_ & (1U << i)) == 0) sigaddset(&unblock, taken_signals[i]);
    }
    pthread_sigmask(SIG_UNBLOCK, &unblock, nullptr);
    has_blocked_signals_ = false;
  }
}

bool EventLoop::attach(EventSource& source) {
  if (std::ranges::find(sources_, &source) != sources_.end()) return true;
  const auto free = std::ranges::find(sources_, nullptr);
  if (free == sources_.end()) return false;
  *free = &source;
  return true;
}

void EventLoop::detach(EventSource& source) {
  std::ranges::replace(sources_, &source, nullptr);
}

EventLoop::Watch EventLoop::watch(int descriptor, std::uint32_t epoll_events, EventSource& source,
                                  std::uint32_t token) {
  const auto free = std::ranges::find_if(slots_, [](const Slot& slot) { return slot.source == nullptr; });
  if (free == slots_.end()) return {};
  Watch watch;
  watch.slot = static_cast<std::uint32_t>(free - slots_.begin());
  watch.generation = free->generation;
  epoll_event event{.events = epoll_events, .data = {.u64 = mark(watch)}};
  if (epoll_ctl(epoll_.number(), EPOLL_CTL_ADD, descriptor, &event) != 0) return {};
  free->source = &source;
  free->descriptor = descriptor;
  free->token = token;
  return watch;
}

void EventLoop::change(Watch watch, std::uint32_t epoll_events) {
  if (!watch || slots_[watch.slot].generation != watch.generation) return;
  epoll_event event{.events = epoll_events, .data = {.u64 = mark(watch)}};
  epoll_ctl(epoll_.number(), EPOLL_CTL_MOD, slots_[watch.slot].descriptor, &event);
}

void EventLoop::unwatch(Watch& watch) {
  if (watch && slots_[watch.slot].generation == watch.generation) {
    Slot& slot = slots_[watch.slot];
    epoll_ctl(epoll_.number(), EPOLL_CTL_DEL, slot.descriptor, nullptr);
    slot.source = nullptr;
    // Generations stay below 2^31, so that no mark is one of our own.
    slot.generation = (slot.generation + 1) & 0x7fffffffU;
  }
  watch = {};
}

void EventLoop::run_once() {
  std::array<epoll_event, watch_capacity> ready{};
  const int timeout_ms = static_cast<int>(config_.tick_interval_ns / ns_per_ms) + 1;
  const int count = epoll_wait(epoll_.number(), ready.data(), static_cast<int>(ready.size()), timeout_ms);
  ++counters_.rounds;
  bool is_tick_due = false;
  bool is_wake_due = false;
  for (int i = 0; i < count; ++i) {
    const std::uint64_t which = ready[static_cast<std::size_t>(i)].data.u64;
    if (which == timer_mark) {
      is_tick_due = true;
    } else if (which == wake_mark) {
      is_wake_due = true;
    } else if (which == signal_mark) {
      take_signals();
    } else {
      const Slot& slot = slots_[which & UINT32_MAX];
      if (slot.source != nullptr && slot.generation == which >> 32) {
        slot.source->on_ready(slot.token, ready[static_cast<std::size_t>(i)].events);
      }
    }
  }
  if (is_tick_due) tick();
  if (is_wake_due) wake();
  flush();
}

void EventLoop::take_signals() {
  signalfd_siginfo information{};
  while (read(signals_.number(), &information, sizeof information) == sizeof information) {
    if (information.ssi_signo == SIGUSR1) {
      ++counters_.motor_resets;
      Event event;
      event.stamp_ns = now_ns();
      event.kind = EventKind::order;
      event.order = MotorOrder::reset;
      sink_.on_event(event);
      continue;
    }
    ++(information.ssi_signo == SIGHUP ? counters_.reload_requests : counters_.stop_requests);
  }
}

void EventLoop::tick() {
  std::uint64_t due = 0;
  if (read(timer_.number(), &due, sizeof due) != sizeof due || due == 0) return;
  const std::int64_t now = now_ns();
  const std::uint64_t missed = due - 1;
  counters_.ticks_missed += missed;
  ++counters_.ticks;
  const std::int64_t delay_ns = static_cast<std::int64_t>(missed) * config_.tick_interval_ns;
  if (delay_ns > tolerable_delay_ns && delay_notice_.may(now)) {
    raise(now, Severity::warning, "event loop",
          "was held up, in ms; a real-time priority helps when the machine is busy", delay_ns / ns_per_ms);
  }
  for (EventSource* source : sources_) {
    if (source != nullptr) source->on_tick(now);
  }
  deliver_tick(now);
}

void EventLoop::deliver_tick(std::int64_t now_ns) {
  Event event;
  event.stamp_ns = now_ns;
  const std::int64_t suspended_ns = config_.suspended_ns();
  if (suspended_ns - suspended_before_ns_ > tolerable_suspension_ns) {
    ++counters_.suspensions;
    event.kind = EventKind::order;
    event.order = MotorOrder::resumed;
    sink_.on_event(event);
  }
  suspended_before_ns_ = suspended_ns;
  event.kind = EventKind::tick;
  sink_.on_event(event);
}

void EventLoop::wake_at(std::int64_t stamp_ns) {
  if (stamp_ns == wake_ns_ || !wake_timer_) return;
  wake_ns_ = stamp_ns;
  itimerspec once{};  // all zero: disarmed
  if (stamp_ns > 0) once.it_value = to_timespec(stamp_ns);
  timerfd_settime(wake_timer_.number(), TFD_TIMER_ABSTIME, &once, nullptr);
}

void EventLoop::wake() {
  std::uint64_t due = 0;
  if (read(wake_timer_.number(), &due, sizeof due) != sizeof due || due == 0) return;
  ++counters_.wakes;
  deliver_tick(now_ns());
}

void EventLoop::flush() {
  const std::int64_t now = now_ns();
  for (EventSource* source : sources_) {
    if (source != nullptr) source->flush(now);
  }
}

}  // namespace alces
