#include "alces_platform/linux/event_loop.h"

#include <sys/epoll.h>
#include <csignal>

#include <catch2/catch.hpp>
#include <memory>
#include <thread>

#include "linux_support.h"

using namespace alces;
using alces::test::KeepingNotices;
using alces::test::KeepingSink;
using alces::test::LoopBench;

namespace {

struct Pipe {
  FileDescriptor read_end;
  FileDescriptor write_end;

  Pipe() {
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    read_end = FileDescriptor(ends[0]);
    write_end = FileDescriptor(ends[1]);
  }
  void put() const { REQUIRE(write(write_end.number(), "x", 1) == 1); }
};

/// Reads a byte whenever it is ready, and does what it is told to.
struct Reader final : EventSource {
  std::function<void(std::uint32_t)> then;
  std::vector<std::uint32_t> tokens;
  int ticks = 0;
  int flushes = 0;

  void on_ready(std::uint32_t token, std::uint32_t) override {
    tokens.push_back(token);
    if (then) then(token);
  }
  void on_tick(std::int64_t) override { ++ticks; }
  void flush(std::int64_t) override { ++flushes; }
};

}  // namespace

TEST_CASE("ticks come every 10 ms with the monotonic time, devices' before the drivers'") {
  LoopBench bench;
  Reader reader;
  REQUIRE(bench.loop.attach(reader));
  int devices_first = 0;
  bench.sink.then = [&](const Event&) { devices_first += reader.ticks; };
  const std::int64_t begin_ns = now_ns();
  while (bench.loop.counters().ticks < 20) bench.loop.run_once();
  const std::int64_t took_ns = now_ns() - begin_ns;
  const auto ticks = bench.sink.of(EventKind::tick);
  REQUIRE(ticks.size() == 20);
  CHECK(devices_first == 20 * 21 / 2);
  // With those missed, there was one for every 10 ms.
  const auto due = static_cast<std::int64_t>(ticks.size() + bench.loop.counters().ticks_missed);
  CHECK(std::abs(took_ns - due * 10 * ns_per_ms) <= 20 * ns_per_ms);
  for (std::size_t i = 1; i < ticks.size(); ++i) CHECK(ticks[i].event.stamp_ns > ticks[i - 1].event.stamp_ns);
  CHECK(ticks.back().event.stamp_ns <= now_ns());
  CHECK(reader.flushes >= 20);
  bench.loop.detach(reader);
}

TEST_CASE("a loop that was held up delivers one tick, counts the missed ones and says so") {
  LoopBench bench;
  std::this_thread::sleep_for(std::chrono::milliseconds(125));
  bench.loop.run_once();
  CHECK(bench.sink.of(EventKind::tick).size() == 1);
  CHECK(bench.loop.counters().ticks_missed >= 10);
  CHECK(bench.notices.count("held up") == 1);
}

TEST_CASE("signals become requests, and have their meaning back when the loop is closed") {
  sigset_t before;
  pthread_sigmask(SIG_BLOCK, nullptr, &before);
  REQUIRE(sigismember(&before, SIGTERM) == 0);
  KeepingSink sink;
  KeepingNotices notices;
  EventLoop loop(sink, notices);
  REQUIRE(loop.open({}));
  CHECK(loop.stop_requests() == 0);
  pthread_kill(pthread_self(), SIGTERM);
  pthread_kill(pthread_self(), SIGHUP);
  for (int i = 0; i < 100 && loop.reload_requests() == 0; ++i) loop.run_once();
  CHECK(loop.stop_requests() == 1);
  CHECK(loop.reload_requests() == 1);
  pthread_kill(pthread_self(), SIGINT);
  for (int i = 0; i < 100 && loop.stop_requests() == 1; ++i) loop.run_once();
  CHECK(loop.stop_requests() == 2);
  loop.close();
  sigset_t after;
  pthread_sigmask(SIG_BLOCK, nullptr, &after);
  CHECK(sigismember(&after, SIGTERM) == 0);
}

TEST_CASE(
    "a descriptor that another handler has unwatched is not delivered, even when it was ready already") {
  LoopBench bench;
  Pipe pipes[2];
  Reader reader;
  EventLoop::Watch watches[2];
  for (std::uint32_t i = 0; i < 2; ++i) {
    watches[i] = bench.loop.watch(pipes[i].read_end.number(), EPOLLIN, reader, i);
    REQUIRE(watches[i]);
    pipes[i].put();
  }
  Pipe third;
  third.put();
  reader.then = [&](std::uint32_t token) {
    if (token > 1) return;
    bench.loop.unwatch(watches[0]);
    bench.loop.unwatch(watches[1]);
    // Takes a slot that has just become free: not to be confused with the one before.
    CHECK(bench.loop.watch(third.read_end.number(), EPOLLIN, reader, 2));
  };
  bench.loop.run_once();
  CHECK(reader.tokens.size() == 1);
  bench.loop.run_once();
  CHECK(reader.tokens.size() == 2);
  CHECK(reader.tokens[1] == 2);
}

TEST_CASE("a full loop refuses one more, and has room again when one goes") {
  LoopBench bench;
  std::vector<std::unique_ptr<Reader>> readers;
  for (std::uint32_t i = 0; i < EventLoop::source_capacity; ++i) {
    readers.push_back(std::make_unique<Reader>());
    REQUIRE(bench.loop.attach(*readers.back()));
  }
  Reader one_more;
  CHECK(bench.loop.attach(*readers[0]));  // is in already
  CHECK_FALSE(bench.loop.attach(one_more));
  bench.loop.detach(*readers[3]);
  CHECK(bench.loop.attach(one_more));
  CHECK_FALSE(bench.loop.watch(-1, EPOLLIN, one_more, 0));
}

TEST_CASE("a tick interval without sense is refused") {
  KeepingSink sink;
  KeepingNotices notices;
  EventLoop loop(sink, notices);
  CHECK_FALSE(loop.open({.tick_interval_ns = 0, .take_signals = false}));
  CHECK(std::string(loop.error()).find("between 1 ms and 1 s") != std::string::npos);
}

TEST_CASE("a wake is one more tick, at its time, once") {
  LoopBench bench;
  const std::int64_t wanted_ns = now_ns() + 3 * ns_per_ms;
  bench.loop.wake_at(wanted_ns);
  std::int64_t woken_ns = 0;
  while (bench.loop.counters().wakes == 0 && now_ns() < wanted_ns + ns_per_s) {
    bench.loop.wake_at(wanted_ns);  // the same again changes nothing
    bench.loop.run_once();
  }
  REQUIRE(bench.loop.counters().wakes == 1);
  woken_ns = bench.sink.of(EventKind::tick).back().event.stamp_ns;
  CHECK(woken_ns >= wanted_ns);
  bench.loop.wake_at(no_stamp_ns);
  for (int round = 0; round < 5; ++round) bench.loop.run_once();
  CHECK(bench.loop.counters().wakes == 1);
  CHECK(bench.sink.of(EventKind::tick).size() == bench.loop.counters().ticks + 1);
}

TEST_CASE("a machine that was suspended is told of before the next tick, and a person's reset is an event") {
  static std::int64_t suspended_for_ns = 0;
  KeepingSink sink;
  KeepingNotices notices;
  EventLoop loop(sink, notices);
  EventLoopConfig config;
  config.suspended_ns = [] { return suspended_for_ns; };
  REQUIRE(loop.open(config));
  for (int round = 0; round < 3; ++round) loop.run_once();
  CHECK(sink.of(EventKind::order).empty());
  suspended_for_ns = 50 * ns_per_ms;  // clocks that were read one after the other
  for (int round = 0; round < 3; ++round) loop.run_once();
  CHECK(sink.of(EventKind::order).empty());
  suspended_for_ns += 60 * ns_per_s;
  for (int round = 0; round < 3; ++round) loop.run_once();
  REQUIRE(sink.of(EventKind::order).size() == 1);
  CHECK(sink.of(EventKind::order)[0].event.order == MotorOrder::resumed);
  CHECK(loop.counters().suspensions == 1);
  pthread_kill(pthread_self(), SIGUSR1);
  loop.run_once();
  REQUIRE(sink.of(EventKind::order).size() == 2);
  CHECK(sink.of(EventKind::order)[1].event.order == MotorOrder::reset);
  CHECK(loop.stop_requests() == 0);
}
