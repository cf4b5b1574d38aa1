#include <algorithm>

#include "alces_drivers/encoder/angle_history.h"
#include "alces_drivers/stamp.h"

namespace alces {

const char* to_string(AngleStatus status) {
  switch (status) {
    case AngleStatus::ok:
      return "ok";
    case AngleStatus::not_yet:
      return "not yet known";
    case AngleStatus::too_old:
      return "too old to be remembered";
    case AngleStatus::lost:
      return "lost";
  }
  return "unknown";
}

bool AngleHistory::append(const AngleNode& node) {
  if (!nodes_.is_empty() && node.stamp_ns <= nodes_.newest().stamp_ns) return false;
  nodes_.push(node);
  return true;
}

AngleAnswer AngleHistory::at(std::int64_t stamp_ns) const {
  if (nodes_.is_empty() || stamp_ns > nodes_.newest().stamp_ns) return {AngleStatus::not_yet, 0, 0};
  const std::uint32_t after = nodes_.upper_bound(stamp_ns);
  if (after == 0) return {AngleStatus::too_old, 0, 0};
  const AngleNode& from = nodes_[after - 1];
  if (from.stamp_ns == stamp_ns)
    return {AngleStatus::ok, from.angle_rad, static_cast<double>(from.sigma_rad)};
  const AngleNode& to = nodes_[after];
  if (!to.is_connected) return {AngleStatus::lost, 0, 0};
  const double since_s = seconds(stamp_ns - from.stamp_ns);
  const double until_s = seconds(to.stamp_ns - stamp_ns);
  const double angle_rad = from.angle_rad + (to.angle_rad - from.angle_rad) * (since_s / (since_s + until_s));
  const double bend_rad = std::min(0.5 * smoothness_.acceleration_rad_s2 * since_s * until_s,
                                   smoothness_.speed_ripple_rad_s * std::min(since_s, until_s));
  return {AngleStatus::ok, angle_rad, static_cast<double>(std::max(from.sigma_rad, to.sigma_rad)) + bend_rad};
}

bool AngleHistory::speed(std::int64_t span_ns, double& speed_rad_s) const {
  if (nodes_.size() < 2) return false;
  const AngleNode& last = nodes_.newest();
  std::uint32_t first = nodes_.size() - 1;
  while (first > 0 && nodes_[first].is_connected && last.stamp_ns - nodes_[first].stamp_ns < span_ns) --first;
  const std::int64_t duration_ns = last.stamp_ns - nodes_[first].stamp_ns;
  if (duration_ns <= 0) return false;
  speed_rad_s = (last.angle_rad - nodes_[first].angle_rad) / seconds(duration_ns);
  return true;
}

}  // namespace alces
