#include "alces_drivers/minimum_delay_filter.h"

#include <algorithm>
#include <cmath>

namespace alces {

MinimumDelayFilter::MinimumDelayFilter(const MinimumDelayFilterConfig& config) : config_(config) {
  config_.block_count = std::clamp(config_.block_count, std::uint32_t{2}, maximum_blocks);
  config_.block_ns = std::max<std::int64_t>(config_.block_ns, 1);
}

void MinimumDelayFilter::reset() {
  block_count_ = 0;
  base_device_ns_ = 0;
  base_arrival_ns_ = 0;
  offset_ns_ = 0;
  drift_ = 0;
}

std::int64_t MinimumDelayFilter::host_from_device(std::int64_t device_ns) const {
  const std::int64_t since_ns = device_ns - base_device_ns_;
  return base_arrival_ns_ + since_ns + std::llround(line(static_cast<double>(since_ns)));
}

std::int64_t MinimumDelayFilter::add(std::int64_t device_ns, std::int64_t arrival_ns) {
  if (!is_empty()) {
    const std::int64_t late_ns = arrival_ns - host_from_device(device_ns);
    if (device_ns < last_device_ns_ || late_ns > config_.jump_ns || late_ns < -config_.jump_ns) {
      reset();
      ++restarts_;
    }
  }
  if (is_empty()) {
    base_device_ns_ = device_ns;
    base_arrival_ns_ = arrival_ns;
  }
  last_device_ns_ = device_ns;
  const std::int64_t since_ns = device_ns - base_device_ns_;
  const Point point{static_cast<double>(since_ns),
                    static_cast<double>(arrival_ns - base_arrival_ns_ - since_ns)};
  const std::int64_t block = since_ns / config_.block_ns;

  if (is_empty() || block != newest_block_) {
    newest_block_ = block;
    if (block_count_ == config_.block_count) {
      std::copy(points_.begin() + 1, points_.begin() + block_count_, points_.begin());
      --block_count_;
    }
    points_[block_count_++] = point;
    fit();
  } else {
    Point& best = points_[block_count_ - 1];
    if (point.delay_ns - line(point.device_ns) < best.delay_ns - line(best.device_ns)) {
      best = point;
      fit();
    }
  }
  return std::min(arrival_ns, host_from_device(device_ns));
}

void MinimumDelayFilter::fit() {
  // Blocks that fell silent for long do not count: drift may have changed meanwhile.
  const double window_ns = static_cast<double>(config_.block_ns) * config_.block_count;
  std::uint32_t first = 0;
  while (points_[block_count_ - 1].device_ns - points_[first].device_ns > window_ns) ++first;
  if (first > 0) {
    std::copy(points_.begin() + first, points_.begin() + block_count_, points_.begin());
    block_count_ -= first;
  }

  std::array<std::uint32_t, maximum_blocks> hull{};  // the lower hull, by Andrew's monotone chain
  std::uint32_t hull_size = 0;
  double mean_device_ns = 0;
  for (std::uint32_t i = 0; i < block_count_; ++i) {
    const Point& c = points_[i];
    mean_device_ns += c.device_ns / block_count_;
    while (hull_size >= 2) {
      const Point& a = points_[hull[hull_size - 2]];
      const Point& b = points_[hull[hull_size - 1]];
      const double turn = (b.device_ns - a.device_ns) * (c.delay_ns - a.delay_ns) -
                          (b.delay_ns - a.delay_ns) * (c.device_ns - a.device_ns);
      if (turn > 0) break;
      --hull_size;
    }
    hull[hull_size++] = i;
  }

  drift_ = 0;
  for (std::uint32_t i = 0; i + 1 < hull_size; ++i) {
    const Point& a = points_[hull[i]];
    const Point& b = points_[hull[i + 1]];
    if (mean_device_ns > b.device_ns && i + 2 < hull_size) continue;
    // Two messages side by side say nothing about drift.
    const double span_ns = b.device_ns - a.device_ns;
    if (span_ns > 0.25 * static_cast<double>(config_.block_ns)) {
      drift_ = std::clamp((b.delay_ns - a.delay_ns) / span_ns, -config_.maximum_drift, config_.maximum_drift);
    }
    break;
  }
  offset_ns_ = points_[0].delay_ns - drift_ * points_[0].device_ns;
  for (std::uint32_t i = 1; i < block_count_; ++i) {
    offset_ns_ = std::min(offset_ns_, points_[i].delay_ns - drift_ * points_[i].device_ns);
  }
}

}  // namespace alces
