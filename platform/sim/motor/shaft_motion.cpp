#include "alces_platform/sim/motor/shaft_motion.h"

#include <algorithm>
#include <cmath>

namespace alces::sim {
namespace {

constexpr std::size_t most_segments =
    512;  // of the past: minutes, even for a driver that changes its mind all the time

double seconds_between(std::int64_t begin_ns, std::int64_t end_ns) {
  return static_cast<double>(end_ns - begin_ns) * 1e-9;
}

}  // namespace

const ShaftMotion::Segment& ShaftMotion::segment_at(std::int64_t at_ns) const {
  const auto later = std::find_if(segments_.rbegin(), segments_.rend(),
                                  [&](const Segment& segment) { return segment.begin_ns <= at_ns; });
  return later == segments_.rend() ? segments_.front() : *later;
}

double ShaftMotion::position_counts(std::int64_t at_ns) const {
  const Segment& segment = segment_at(at_ns);
  if (at_ns <= segment.begin_ns) return segment.position;
  const double t = seconds_between(segment.begin_ns, at_ns);
  return segment.position + (segment.speed + 0.5 * segment.acceleration * t) * t;
}

double ShaftMotion::speed_counts_per_s(std::int64_t at_ns) const {
  const Segment& segment = segment_at(at_ns);
  if (at_ns <= segment.begin_ns) return segment.speed;
  return segment.speed + segment.acceleration * seconds_between(segment.begin_ns, at_ns);
}

void ShaftMotion::forget_after(std::int64_t now_ns) {
  while (segments_.size() > 1 && segments_.back().begin_ns > now_ns) segments_.pop_back();
  while (segments_.size() > most_segments) segments_.pop_front();
}

void ShaftMotion::append(std::int64_t begin_ns, double speed, double acceleration) {
  const double position = position_counts(begin_ns);
  segments_.push_back({begin_ns, position, speed, acceleration});
}

void ShaftMotion::ramp_to(std::int64_t now_ns, double target, double acceleration, double deceleration) {
  double speed = speed_counts_per_s(now_ns);
  forget_after(now_ns);
  std::int64_t at_ns = now_ns;
  const auto change = [&](double to, double rate) {
    if (to == speed) return;
    append(at_ns, speed, to > speed ? rate : -rate);
    at_ns += std::max<std::int64_t>(1, std::llround(std::abs(to - speed) / rate * 1e9));
    speed = to;
  };
  const bool is_reversal = speed * target < 0;
  if (is_reversal) change(0, deceleration);
  change(target, std::abs(target) > std::abs(speed) ? acceleration : deceleration);
  append(at_ns, target, 0);
}

void ShaftMotion::jump_to(std::int64_t now_ns, double speed) {
  forget_after(now_ns);
  append(now_ns, speed, 0);
}

}  // namespace alces::sim
