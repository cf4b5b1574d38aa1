#include "alces_drivers/lms2xx/sweep_clock.h"

#include <algorithm>
#include <cmath>

namespace alces::lms2xx {
namespace {

/// A mirror's speed is regulated, not a quartz: 1 %. Half-second blocks follow it.
constexpr MinimumDelayFilterConfig filter_config{
    .block_ns = ns_per_s / 2, .block_count = 16, .maximum_drift = 0.01, .jump_ns = ns_per_s / 2};

/// So many telegrams in a row that come late by most of a turn were not delayed: a turn is missing.
constexpr std::uint32_t late_run_limit = 8;

}  // namespace

SweepClock::SweepClock(double turns_per_s) : turn_ns_(1e9 / turns_per_s), filter_(filter_config) {}

void SweepClock::reset() {
  filter_.reset();
  has_last_ = false;
  last_learned_ = number_;  // the next one is learned from, even when the numbering had stepped back
  last_index_.reset();
  late_run_ = 0;
  is_guess_ = false;
}

std::int64_t SweepClock::device_ns(std::int64_t number) const {
  return std::llround(static_cast<double>(number) * turn_ns_);
}

SweepClock::Sweep SweepClock::add(const Arrival& arrival) {
  if (has_last_) {
    const std::int64_t turns = turns_since_last(arrival);
    if (turns > arrival.nominal_turns) {
      counters_.turns_missed += static_cast<std::uint64_t>(turns - arrival.nominal_turns);
    }
    number_ += turns;
  } else {
    ++number_;
  }
  has_last_ = true;
  last_index_ = arrival.turn_index;
  // A number that was only guessed, from an arrival that may just be late, must not move the line.
  if (is_guess_ || number_ <= last_learned_) return {number_, filter_.host_from_device(device_ns(number_))};
  last_learned_ = number_;
  return {number_, filter_.add(device_ns(number_), arrival.stamp_ns)};
}

std::int64_t SweepClock::turns_since_last(const Arrival& arrival) {
  const std::int64_t expected_ns = filter_.host_from_device(device_ns(number_ + arrival.nominal_turns));
  is_guess_ = false;
  const double late_turns = static_cast<double>(arrival.stamp_ns - expected_ns) / turn_ns();
  if (arrival.turn_index && last_index_) {
    const auto step = static_cast<std::uint8_t>(*arrival.turn_index - *last_index_);
    // The index tells turns apart modulo 256; whole rounds of it come from the arrival.
    const double rounds =
        std::round((late_turns + static_cast<double>(arrival.nominal_turns - step)) / 256.0);
    const std::int64_t turns = step + 256 * std::max<std::int64_t>(0, std::llround(rounds));
    return std::max<std::int64_t>(1, turns);
  }
  std::int64_t turns = arrival.nominal_turns;
  if (arrival.bytes_were_lost || arrival.nominal_turns > 1) {
    turns = std::max<std::int64_t>(1, turns + std::llround(late_turns));
    is_guess_ = turns > arrival.nominal_turns && arrival.nominal_turns == 1;
    late_run_ = 0;
  } else if (late_turns < -0.5) {
    turns += std::llround(late_turns);  // maybe back
    late_run_ = 0;
    ++counters_.corrections;
  } else if (late_turns > 0.75) {
    least_late_turns_ = late_run_ == 0 ? late_turns : std::min(least_late_turns_, late_turns);
    if (++late_run_ == late_run_limit) {
      turns += std::llround(least_late_turns_);
      late_run_ = 0;
      ++counters_.corrections;
    }
  } else {
    late_run_ = 0;
  }
  return turns;
}

}  // namespace alces::lms2xx
