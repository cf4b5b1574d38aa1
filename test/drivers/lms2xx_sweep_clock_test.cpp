#include "alces_drivers/lms2xx/sweep_clock.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "alces_platform/sim/random.h"

using alces::lms2xx::SweepClock;

namespace {

constexpr double true_turn_ns = 1e9 / 75.06;  // the mirror is a little fast

std::int64_t sent_ns(std::int64_t turn) {
  return 5'000'000'000 + std::llround(static_cast<double>(turn) * true_turn_ns);
}

struct Feed {
  SweepClock clock{75};
  std::int64_t first_number = 0;
  std::int64_t last_error_ns = 0;
  /// Feeds turn `turn` and answers by how many turns its number is off.
  std::int64_t add(std::int64_t turn, std::int64_t latency_ns, bool bytes_were_lost = false,
                   std::optional<std::uint8_t> index = std::nullopt) {
    const auto sweep = clock.add(
        {.stamp_ns = sent_ns(turn) + latency_ns, .bytes_were_lost = bytes_were_lost, .turn_index = index});
    if (turn == 0) first_number = sweep.number;
    last_error_ns = sweep.stamp_ns - sent_ns(turn);
    return sweep.number - first_number - turn;
  }
};

}  // namespace

TEST_CASE("sweeps are numbered through bursts, and their stamps do not show the latency") {
  Feed feed;
  alces::sim::Random random(1);
  std::int64_t delayed_until_ns = 0;
  for (std::int64_t turn = 0; turn < 75 * 60; ++turn) {
    // Now and then the host sleeps for 40 ms and gets everything at once.
    if (random.chance(0.02)) delayed_until_ns = sent_ns(turn) + 40'000'000;
    const std::int64_t latency_ns =
        std::max<std::int64_t>(random.integer(20'000, 400'000), delayed_until_ns - sent_ns(turn));
    REQUIRE(feed.add(turn, latency_ns) == 0);
    if (turn > 75 * 10) CHECK(std::abs(feed.last_error_ns) < 150'000);
  }
  CHECK(feed.clock.counters().turns_missed == 0);
  CHECK(feed.clock.turn_ns() == Approx(true_turn_ns).epsilon(2e-5));
}

TEST_CASE("a telegram lost with damage on the line is counted, and the next has its own number") {
  Feed feed;
  for (std::int64_t turn = 0; turn < 300; ++turn) {
    const bool is_after_loss = turn == 150;
    if (turn == 148 || turn == 149) continue;
    REQUIRE(feed.add(turn, 100'000, is_after_loss) == 0);
  }
  CHECK(feed.clock.counters().turns_missed == 2);
}

TEST_CASE("a telegram lost without a trace is found out within eight telegrams") {
  Feed feed;
  for (std::int64_t turn = 0; turn < 300; ++turn) {
    if (turn == 149) continue;
    const std::int64_t off = feed.add(turn, 100'000);
    if (turn < 149 || turn > 157) CHECK(off == 0);
  }
  CHECK(feed.clock.counters().turns_missed == 1);
  CHECK(feed.clock.counters().corrections == 1);
}

TEST_CASE("damage and a burst together are set right by the next telegram in time") {
  Feed feed;
  for (std::int64_t turn = 0; turn < 200; ++turn) feed.add(turn, 100'000);
  feed.add(201, 30'000'000, true);  // one lost, and 30 ms late: looks like three lost
  feed.add(202, 17'000'000);
  feed.add(203, 4'000'000);
  CHECK(feed.add(204, 100'000) == 0);
  CHECK(feed.clock.counters().corrections >= 1);
}

TEST_CASE("with the laser's turn index nothing is guessed, not even a loss of seconds") {
  Feed feed;
  for (std::int64_t turn = 0; turn < 1000; ++turn) {
    if (turn > 100 && turn < 107) continue;
    const std::int64_t latency_ns = turn % 50 == 0 ? 70'000'000 : 100'000;
    REQUIRE(feed.add(turn, latency_ns, false, static_cast<std::uint8_t>(turn & 0xff)) == 0);
  }
  CHECK(feed.clock.counters().turns_missed == 6);
  REQUIRE(feed.add(1300, 100'000, false, static_cast<std::uint8_t>(1300 & 0xff)) == 0);
}

TEST_CASE("a slow line that carries every sixth or seventh turn is numbered by rounding") {
  SweepClock clock(75);
  std::int64_t turn = 0;
  std::int64_t first = 0;
  for (int i = 0; i < 500; ++i) {
    const auto sweep = clock.add({.stamp_ns = sent_ns(turn) + 200'000, .nominal_turns = 7});
    if (i == 0) first = sweep.number;
    CHECK(sweep.number - first == turn);
    turn += i % 3 == 0 ? 6 : 7;
  }
}

TEST_CASE("a clock that was set back is learned anew by the first sweep after a reset") {
  Feed feed;
  for (std::int64_t turn = 0; turn < 3000; ++turn) REQUIRE(feed.add(turn, 100'000) == 0);
  const std::int64_t step_ns = -30'000'000'000;
  const auto before_reset = feed.clock.add({.stamp_ns = sent_ns(3000) + step_ns});
  CHECK(std::abs(before_reset.stamp_ns - sent_ns(3000) - step_ns) < 10'000'000);
  feed.clock.reset();
  for (std::int64_t turn = 3001; turn < 3100; ++turn) {
    const auto sweep = feed.clock.add({.stamp_ns = sent_ns(turn) + step_ns + 100'000});
    REQUIRE(std::abs(sweep.stamp_ns - sent_ns(turn) - step_ns) < 1'000'000);
  }
  CHECK(feed.clock.counters().turns_missed == 0);
}
