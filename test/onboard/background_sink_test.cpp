#include "alces_onboard/recorder/background_sink.h"

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

#include "support/comes_true.h"

using namespace alces;
using namespace alces::onboard;
using test::comes_true;

namespace {

/// Keeps what it gets, a write a vector; or refuses.
class SlowSink final : public ByteSink {
 public:
  [[nodiscard]] bool write(std::span<const std::uint8_t> bytes) override {
    ++tries;
    if (refuses) return false;
    const std::lock_guard lock(mutex_);
    writes_.emplace_back(bytes.begin(), bytes.end());
    return true;
  }
  [[nodiscard]] bool read_back(std::uint64_t position, std::span<std::uint8_t> bytes) override {
    const std::lock_guard lock(mutex_);
    std::vector<std::uint8_t> all;
    for (const auto& each : writes_) all.insert(all.end(), each.begin(), each.end());
    if (position + bytes.size() > all.size()) return false;
    std::copy_n(all.begin() + static_cast<std::ptrdiff_t>(position), bytes.size(), bytes.begin());
    return true;
  }
  [[nodiscard]] std::vector<std::vector<std::uint8_t>> writes() {
    const std::lock_guard lock(mutex_);
    return writes_;
  }
  std::atomic<bool> refuses{false};
  std::atomic<int> tries{0};

 private:
  std::mutex mutex_;
  std::vector<std::vector<std::uint8_t>> writes_;
};

std::vector<std::uint8_t> piece(std::uint8_t value, std::size_t size) {
  return std::vector<std::uint8_t>(size, value);
}

}  // namespace

TEST_CASE("a background sink hands on every write whole and in order") {
  SlowSink below;
  BackgroundSink sink(below, {.ring_bytes = 4096});
  sink.start();
  for (std::uint8_t i = 0; i < 200; ++i) {
    while (!sink.write(piece(i, i))) std::this_thread::yield();
  }
  CHECK(sink.stop(10 * ns_per_s));
  const auto writes = below.writes();
  REQUIRE(writes.size() == 200);
  for (std::uint8_t i = 0; i < 200; ++i) CHECK(writes[i] == piece(i, i));
  CHECK(sink.counters().writes == 200);
  CHECK(sink.counters().bytes_given_up == 0);
}

TEST_CASE(
    "when the sink below refuses, a background sink keeps what it has and its caller is told when it is "
    "full") {
  SlowSink below;
  below.refuses = true;
  BackgroundSink sink(below, {.ring_bytes = 1024, .retry_ns = ns_per_ms});
  sink.start();
  std::uint8_t taken = 0;
  while (sink.write(piece(taken, 100))) ++taken;
  CHECK(taken >= 8);
  CHECK(comes_true([&] { return sink.is_stalled(); }));
  CHECK(sink.counters().writes_refused == 1);

  below.refuses = false;  // somebody made room
  CHECK(comes_true([&] { return below.writes().size() == taken; }));
  CHECK(sink.write(piece(taken, 100)));
  CHECK(sink.stop(10 * ns_per_s));
  const auto writes = below.writes();
  REQUIRE(writes.size() == std::size_t{taken} + 1);
  for (std::uint8_t i = 0; i <= taken; ++i) CHECK(writes[i] == piece(i, 100));
  CHECK_FALSE(sink.is_stalled());
  CHECK(sink.counters().stalls == 1);
}

TEST_CASE("a background sink ends even when the sink below never takes anything, and says what it gave up") {
  SlowSink below;
  below.refuses = true;
  BackgroundSink sink(below, {.ring_bytes = 1024});
  sink.start();
  REQUIRE(sink.write(piece(1, 100)));
  REQUIRE(sink.write(piece(2, 50)));
  CHECK_FALSE(sink.stop(20 * ns_per_ms));
  CHECK(sink.counters().bytes_given_up == 150);
  CHECK(below.writes().empty());
}

TEST_CASE("what was written is read back once it is handed on, and nobody waits for that before the end") {
  SlowSink below;
  below.refuses = true;
  BackgroundSink sink(below, {.ring_bytes = 1024, .retry_ns = ns_per_ms});
  sink.start();
  REQUIRE(sink.write(piece(1, 100)));
  REQUIRE(sink.write(piece(2, 100)));
  std::vector<std::uint8_t> found(10);
  CHECK_FALSE(sink.read_back(95, found));  // at once
  sink.let_writes_wait(10 * ns_per_s);
  std::thread somebody([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    below.refuses = false;
  });
  CHECK(sink.read_back(95, found));
  somebody.join();
  CHECK(found == std::vector<std::uint8_t>{1, 1, 1, 1, 1, 2, 2, 2, 2, 2});
  CHECK_FALSE(sink.read_back(195, found));  // not all of it is there
  CHECK(sink.stop(10 * ns_per_s));
}

TEST_CASE(
    "a background sink does not wait for a sink below that does not come back, and says that it was left") {
  class HangingSink final : public ByteSink {
   public:
    [[nodiscard]] bool write(std::span<const std::uint8_t>) override {
      while (hangs) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return true;
    }
    std::atomic<bool> hangs{true};
  } below;
  BackgroundSink sink(below, {.ring_bytes = 1024, .leave_ns = 20 * ns_per_ms});
  sink.start();
  REQUIRE(sink.write(piece(1, 100)));
  CHECK_FALSE(sink.stop(20 * ns_per_ms));
  CHECK(sink.was_left());
  below.hangs = false;  // for the test's own end: alcesd leaves the process instead
}

TEST_CASE("at a file's end writes may wait for room") {
  SlowSink below;
  below.refuses = true;
  BackgroundSink sink(below, {.ring_bytes = 1024, .retry_ns = ns_per_ms});
  sink.start();
  while (sink.write(piece(0, 400))) {
  }
  sink.let_writes_wait(10 * ns_per_s);
  std::thread somebody([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    below.refuses = false;
  });
  CHECK(sink.write(piece(9, 400)));
  somebody.join();
  CHECK(sink.stop(10 * ns_per_s));
  CHECK(below.writes().back() == piece(9, 400));
}

TEST_CASE("a write larger than the ring can ever hold is refused at once, also when writes may wait") {
  SlowSink below;
  BackgroundSink sink(below, {.ring_bytes = 1024});
  sink.start();
  sink.let_writes_wait(60 * ns_per_s);
  CHECK_FALSE(sink.write(piece(0, 1000)));
  CHECK(sink.stop(ns_per_s));
}
