// How a SICK LMS 291 measures wrongly: from what a ray meets to the range that the device says.
//
// Noise and quantum: SICK LMS 2xx technical description (statistical error 10 mm up to 8 m, resolution 10 mm
// in cm mode); reach: 30 m at 10 % remission. Glass and mixed pixels: shares that look like real scans of
// streets.
#pragma once

#include "alces_platform/sim/random.h"
#include "alces_platform/sim/world/scene.h"

namespace alces::sim {

struct RangeErrors {
  double noise_m = 0.015;    ///< standard deviation of a range
  double quantum_m = 0.010;  ///< ranges are whole multiples of this; 0: not rounded
  double max_range_m = 40;
  double window_share = 0.5;  ///< of the rays on glass that bring nothing back
  double mixed_share = 0.1;   ///< of the rays beside a range jump that measure something in between
  double dropout_share = 0;   ///< of all rays that bring nothing back for no reason
  /// Of all rays, those that meet a snowflake: it is at any range from snow_nearest_m to snow_farthest_m
  /// alike, and seen where nothing else is nearer.
  double snow_share = 0;
  double snow_nearest_m = 1;
  double snow_farthest_m = 6;
};

/// Ranges of one sweep, ray after ray: a mixed pixel depends on the ray before.
class RangeMeter {
 public:
  static constexpr double shortest_m = 0.2;

  explicit RangeMeter(const RangeErrors& errors) : errors_(errors) {}

  /// A new sweep begins.
  void reset() { before_m_ = -1; }
  /// The measured range, m; 0: no echo. Draws from `random`.
  [[nodiscard]] double measure(const Hit& hit, Random& random);
  /// The range of something near and dull (the own vehicle): noise and rounding only.
  [[nodiscard]] double measure_near(double range_m, Random& random);

 private:
  [[nodiscard]] double rounded(double range_m) const;

  RangeErrors errors_;
  double before_m_ = -1;
};

}  // namespace alces::sim
