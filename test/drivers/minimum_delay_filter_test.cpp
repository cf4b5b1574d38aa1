#include "alces_drivers/minimum_delay_filter.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "alces_platform/sim/random.h"

using alces::MinimumDelayFilter;
using alces::ns_per_ms;
using alces::ns_per_s;
using alces::ns_per_us;

namespace {

/// Latency as serial lines have it: mostly small, now and then some milliseconds.
std::int64_t latency_ns(alces::sim::Random& random) {
  double latency = 50e3 * -std::log(1 - random.uniform());
  if (random.chance(0.1)) latency += random.uniform(0, 10e6);
  return std::llround(latency);
}

}  // namespace

TEST_CASE("late messages do not move the minimum-delay line, and drift is followed") {
  const double drift = GENERATE(0.0, 2e-4, -2e-4, 3e-3, -8e-3);
  alces::sim::Random random(7);
  MinimumDelayFilter filter({.block_ns = ns_per_s / 2, .block_count = 16, .maximum_drift = 0.01});
  const std::int64_t host_offset_ns = 1'234'567'890'123;
  double worst_ns = 0;
  for (std::int64_t n = 0; n < 75 * 120; ++n) {
    const std::int64_t device_ns = n * ns_per_s / 75;
    const std::int64_t true_ns = host_offset_ns + std::llround(static_cast<double>(device_ns) * (1 + drift));
    const std::int64_t arrival_ns = true_ns + latency_ns(random);
    const std::int64_t estimate_ns = filter.add(device_ns, arrival_ns);
    CHECK(estimate_ns <= arrival_ns);
    if (n > 75 * 10) worst_ns = std::max(worst_ns, std::abs(static_cast<double>(estimate_ns - true_ns)));
  }
  CHECK(worst_ns < 150e3);
  CHECK(filter.drift() == Approx(drift).margin(3e-5));
  CHECK(filter.restarts() == 0);
}

TEST_CASE("a burst of messages that come at once gets the times they were sent") {
  MinimumDelayFilter filter({});
  std::int64_t n = 0;
  for (; n < 500; ++n) filter.add(n * 10 * ns_per_ms, n * 10 * ns_per_ms + 100 * ns_per_us);
  const std::int64_t burst_arrival_ns = (n + 8) * 10 * ns_per_ms;
  for (int i = 0; i < 8; ++i, ++n) {
    CHECK(std::abs(filter.add(n * 10 * ns_per_ms, burst_arrival_ns) -
                   (n * 10 * ns_per_ms + 100 * ns_per_us)) < 1000);
  }
}

TEST_CASE("a new least delay is taken at once, a larger one after the window") {
  MinimumDelayFilter filter({.block_ns = ns_per_s, .block_count = 4});
  std::int64_t n = 0;
  const auto add = [&](std::int64_t delay_ns) {
    const std::int64_t device_ns = n++ * 10 * ns_per_ms;
    return filter.add(device_ns, device_ns + delay_ns) - device_ns;
  };
  for (int i = 0; i < 600; ++i) CHECK(add(5 * ns_per_ms) == 5 * ns_per_ms);
  CHECK(add(1 * ns_per_ms) == 1 * ns_per_ms);
  std::int64_t delay_ns = 0;
  for (int i = 0; i < 1200; ++i) delay_ns = add(5 * ns_per_ms);
  CHECK(delay_ns == Approx(5 * ns_per_ms).margin(10e3));
}

TEST_CASE("a clock that was set, or runs backwards, starts the filter anew") {
  MinimumDelayFilter filter({.jump_ns = ns_per_s});
  for (std::int64_t n = 0; n < 100; ++n) filter.add(n * 10 * ns_per_ms, n * 10 * ns_per_ms);
  CHECK(filter.add(500 * ns_per_s, 1010 * ns_per_ms) == 1010 * ns_per_ms);
  CHECK(filter.restarts() == 1);
  CHECK(filter.add(0, 1020 * ns_per_ms) == 1020 * ns_per_ms);
  CHECK(filter.restarts() == 2);
  CHECK(filter.add(10 * ns_per_ms, 9000 * ns_per_ms) == 9000 * ns_per_ms);
  CHECK(filter.restarts() == 3);
}

TEST_CASE("nothing is lost of nanoseconds after a week") {
  MinimumDelayFilter filter({});
  const std::int64_t week_ns = 7 * 86400 * ns_per_s;
  std::int64_t answer_ns = 0;
  for (std::int64_t n = 0; n < 7 * 86400; n += 60) answer_ns = filter.add(n * ns_per_s, n * ns_per_s + 77);
  CHECK(answer_ns == week_ns - 60 * ns_per_s + 77);
}
