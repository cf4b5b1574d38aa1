// Host time from device time, when all that is known is when messages arrived.
//
// Message n left the device at device time d_n and arrived at a_n = host(d_n) + delay_n. Delays are never
// negative, and now and then nearly zero; so host() is the line that lies below every point (d_n, a_n - d_n)
// and as close to them as it can: the supporting line of their lower convex hull at the mean device time
// (Moon, Skelly, Towsley 1999, "Estimation and removal of clock skew from network delay measurements").
//
// Time is cut into blocks; each keeps its least delayed message, and the newest `block_count` blocks count.
// So the line follows a slow drift, a burst of late messages moves nothing, and a step of the least delay is
// forgotten after block_count * block_ns. The least delay itself cannot be seen: it remains as a constant
// offset, for the caller to take off. A message that arrives sooner than ever moves the line down at once.
//
// Cost: O(1) a message, O(block_count) when a block's best message changes. About 1 KiB.
#pragma once

#include <array>
#include <cstdint>

#include "alces_drivers/stamp.h"

namespace alces {

struct MinimumDelayFilterConfig {
  std::int64_t block_ns = ns_per_s;
  std::uint32_t block_count = 16;  ///< 2 to MinimumDelayFilter::maximum_blocks; others are clamped
  double maximum_drift = 1e-3;     ///< of the device's clock against ours, as a fraction
  /// An arrival that is off the line by more than this starts anew: the device's clock was set.
  std::int64_t jump_ns = ns_per_s;
};

class MinimumDelayFilter {
 public:
  static constexpr std::uint32_t maximum_blocks = 32;

  explicit MinimumDelayFilter(const MinimumDelayFilterConfig& config);

  /// Learns from one message and answers the host time of its device time, never later than its arrival.
  /// Device time that runs backwards, or an arrival off by more than jump_ns, starts anew (counted).
  std::int64_t add(std::int64_t device_ns, std::int64_t arrival_ns);

  /// Device time 0 is host time 0 as long as nothing was added.
  [[nodiscard]] std::int64_t host_from_device(std::int64_t device_ns) const;

  [[nodiscard]] bool is_empty() const { return block_count_ == 0; }
  /// Host seconds a device second, minus 1.
  [[nodiscard]] double drift() const { return drift_; }
  [[nodiscard]] std::uint64_t restarts() const { return restarts_; }

  /// Forgets all messages, keeps the count of restarts.
  void reset();

 private:
  struct Point {
    double device_ns = 0;  ///< since base_device_ns_
    double delay_ns = 0;   ///< arrival since base_arrival_ns_, minus device_ns
  };
  void fit();
  [[nodiscard]] double line(double device_ns) const { return offset_ns_ + drift_ * device_ns; }

  MinimumDelayFilterConfig config_;
  std::int64_t base_device_ns_ = 0;
  std::int64_t base_arrival_ns_ = 0;
  std::int64_t last_device_ns_ = 0;
  std::int64_t newest_block_ = 0;
  std::array<Point, maximum_blocks> points_{};  ///< a block's least delayed message each, oldest first
  std::uint32_t block_count_ = 0;
  double offset_ns_ = 0;
  double drift_ = 0;
  std::uint64_t restarts_ = 0;
};

}  // namespace alces
