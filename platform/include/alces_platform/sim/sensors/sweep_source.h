// What a simulated laser measures: the seam between a device that speaks a protocol and the town it stands
// in.
#pragma once

#include <cstdint>
#include <span>

namespace alces::sim {

class SweepSource {
 public:
  /// Fills the ranges of one sweep, m, quantised as the device does; 0: no echo. Ray i was measured at
  /// first_ray_stamp_ns + i * ray_interval_ns. The rays share the device's field of view evenly, its ends
  /// included. Asked in the order of time, after the sweep has ended (up to 20 ms before its end the head's
  /// angle is extrapolated).
  virtual void sweep(std::int64_t first_ray_stamp_ns, double ray_interval_ns, std::span<float> ranges_m) = 0;

 protected:
  ~SweepSource() = default;
};

}  // namespace alces::sim
