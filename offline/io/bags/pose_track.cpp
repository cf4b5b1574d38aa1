#include "pose_track.h"

#include <algorithm>
#include <cmath>

#include "alces_drivers/stamp.h"

namespace alces::offline {

double stamp_in_s(std::int64_t stamp_ns) {
  return static_cast<double>(stamp_ns / ns_per_s) + seconds(stamp_ns % ns_per_s);
}

bool PoseTrack::add(std::int64_t stamp_ns, const Pose& pose) {
  constexpr double rotation_tolerance = 0.01;  // of what was rounded on its way
  const double length = pose.rotation.norm();
  Pose unit = pose;
  if (std::isfinite(length) && std::abs(length - 1) < rotation_tolerance) unit.rotation.normalize();
  if (!is_valid(unit)) {
    ++refused_;
    return false;
  }
  if (offered_++ % stride_ != 0) return true;
  if (samples_.size() == most_poses) {
    for (std::size_t i = 0; 2 * i < samples_.size(); ++i) samples_[i] = samples_[2 * i];
    samples_.resize((samples_.size() + 1) / 2);
    stride_ *= 2;
  }
  samples_.push_back({stamp_ns, unit});
  return true;
}

void PoseTrack::settle() {
  const auto earlier = [](const Sample& a, const Sample& b) { return a.stamp_ns < b.stamp_ns; };
  std::stable_sort(samples_.begin(), samples_.end(), earlier);
  const auto same = [](const Sample& a, const Sample& b) { return a.stamp_ns == b.stamp_ns; };
  samples_.erase(std::unique(samples_.begin(), samples_.end(), same), samples_.end());
}

void PoseTrack::shift(std::int64_t by_ns) {
  for (Sample& sample : samples_) sample.stamp_ns += by_ns;
}

std::optional<Pose> PoseTrack::at(std::int64_t stamp_ns) const {
  if (samples_.empty()) return std::nullopt;
  const auto after =
      std::lower_bound(samples_.begin(), samples_.end(), stamp_ns,
                       [](const Sample& sample, std::int64_t stamp) { return sample.stamp_ns < stamp; });
  const auto distance_ns = [&](const Sample& sample) { return std::abs(sample.stamp_ns - stamp_ns); };
  const auto& nearest = after == samples_.end() ? samples_.back()
                        : after == samples_.begin() || distance_ns(*after) <= distance_ns(*(after - 1))
                            ? *after
                            : *(after - 1);
  if (distance_ns(nearest) <= same_time_ns) return nearest.pose;
  if (after == samples_.begin() || after == samples_.end()) {
    if (distance_ns(nearest) <= largest_overhang_ns) return nearest.pose;
    return std::nullopt;
  }
  const Sample& before = *(after - 1);
  const std::int64_t gap_ns = after->stamp_ns - before.stamp_ns;
  if (gap_ns > largest_gap_ns * static_cast<std::int64_t>(stride_)) return std::nullopt;
  const double fraction = static_cast<double>(stamp_ns - before.stamp_ns) / static_cast<double>(gap_ns);
  return interpolate(before.pose, after->pose, fraction);
}

}  // namespace alces::offline
