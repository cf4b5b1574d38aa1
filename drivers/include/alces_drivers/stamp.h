// Time inside Alces: nanoseconds of CLOCK_MONOTONIC in a signed 64-bit number, always called `stamp_ns` or
// `..._ns`. Other clocks are converted where they enter, in platform/. A driver never reads a clock: it is
// told.
#pragma once

#include <cstdint>

namespace alces {

inline constexpr std::int64_t ns_per_s = 1'000'000'000;
inline constexpr std::int64_t ns_per_ms = 1'000'000;
inline constexpr std::int64_t ns_per_us = 1'000;

/// "Never": before every stamp.
inline constexpr std::int64_t no_stamp_ns = INT64_MIN;

/// Stamps from outside lie between 0 and this (73 years): differences within, and sums of a few, do not
/// overflow. Scanner::on_event() and the recorder leave out events with others; who is fed otherwise must do
/// the same.
inline constexpr std::int64_t latest_stamp_ns = INT64_MAX / 4;
[[nodiscard]] constexpr bool is_sane_stamp(std::int64_t stamp_ns) {
  return stamp_ns >= 0 && stamp_ns <= latest_stamp_ns;
}

/// Ticks that go back by more mean another clock: what was remembered of the old one must not be waited for.
inline constexpr std::int64_t clock_step_ns = ns_per_s;
/// Moves what was remembered to the new clock; however often, never farther than latest_stamp_ns either way.
constexpr void shift_stamp(std::int64_t& stamp_ns, std::int64_t by_ns) {
  if (stamp_ns == no_stamp_ns) return;
  const std::int64_t room_ns = by_ns > 0 ? latest_stamp_ns - by_ns : -latest_stamp_ns - by_ns;
  const bool fits = by_ns > 0 ? stamp_ns <= room_ns : stamp_ns >= room_ns;
  stamp_ns = fits ? stamp_ns + by_ns : by_ns > 0 ? latest_stamp_ns : -latest_stamp_ns;
}

[[nodiscard]] constexpr double seconds(std::int64_t duration_ns) {
  return static_cast<double>(duration_ns) * 1e-9;
}

}  // namespace alces
