#include "alces_platform/sim/motor/head_motor.h"

#include <algorithm>

namespace alces::sim {

SteadyHead::SteadyHead(std::int64_t start_stamp_ns, double speed_rad_per_s, double ramp_s,
                       double first_angle_rad)
    : start_stamp_ns_(start_stamp_ns),
      speed_rad_per_s_(speed_rad_per_s),
      ramp_s_(ramp_s),
      first_angle_rad_(first_angle_rad) {}

double SteadyHead::angle_rad(std::int64_t now_ns) {
  const double time_s = std::max(0.0, static_cast<double>(now_ns - start_stamp_ns_) * 1e-9);
  const double turned_s = time_s < ramp_s_ ? 0.5 * time_s * time_s / ramp_s_ : time_s - 0.5 * ramp_s_;
  return first_angle_rad_ + speed_rad_per_s_ * turned_s;
}

double SteadyHead::velocity_rad_per_s(std::int64_t now_ns) {
  const double time_s = std::max(0.0, static_cast<double>(now_ns - start_stamp_ns_) * 1e-9);
  return speed_rad_per_s_ * (time_s < ramp_s_ ? time_s / ramp_s_ : 1.0);
}

void HeadTrack::add(std::int64_t stamp_ns, double angle_rad, double velocity_rad_per_s) {
  if (!samples_.empty() && samples_.back().stamp_ns >= stamp_ns) samples_.pop_back();
  samples_.push_back({stamp_ns, angle_rad, velocity_rad_per_s});
  while (samples_.size() > 2 && samples_[1].stamp_ns < stamp_ns - kept_ns) samples_.pop_front();
}

double HeadTrack::angle_rad(std::int64_t stamp_ns) const {
  if (samples_.empty()) return 0;
  const auto along = [stamp_ns](const Sample& sample) {
    return sample.angle_rad +
           sample.velocity_rad_per_s * static_cast<double>(stamp_ns - sample.stamp_ns) * 1e-9;
  };
  const auto later =
      std::lower_bound(samples_.begin(), samples_.end(), stamp_ns,
                       [](const Sample& sample, std::int64_t time) { return sample.stamp_ns < time; });
  if (later == samples_.end()) return along(samples_.back());
  if (later == samples_.begin()) return along(samples_.front());
  const Sample& a = *(later - 1);
  const Sample& b = *later;
  const double step_s = static_cast<double>(b.stamp_ns - a.stamp_ns) * 1e-9;
  const double f = static_cast<double>(stamp_ns - a.stamp_ns) * 1e-9 / step_s;
  const double g = 1 - f;
  return a.angle_rad * g * g * (1 + 2 * f) + b.angle_rad * f * f * (3 - 2 * f) +
         step_s * f * g * (a.velocity_rad_per_s * g - b.velocity_rad_per_s * f);
}

}  // namespace alces::sim
