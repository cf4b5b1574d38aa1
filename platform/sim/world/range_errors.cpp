#include "alces_platform/sim/world/range_errors.h"

#include <algorithm>
#include <cmath>

namespace alces::sim {

double RangeMeter::rounded(double range_m) const {
  if (errors_.quantum_m > 0) range_m = errors_.quantum_m * std::round(range_m / errors_.quantum_m);
  return range_m < shortest_m || range_m > errors_.max_range_m ? 0 : range_m;
}

double RangeMeter::measure(const Hit& hit, Random& random) {
  const double luck = random.uniform();
  const double noise = random.normal();
  if (errors_.dropout_share > 0 && random.chance(errors_.dropout_share)) return 0;
  if (errors_.snow_share > 0 && random.chance(errors_.snow_share)) {
    const double flake_m = random.uniform(errors_.snow_nearest_m, errors_.snow_farthest_m);
    if (flake_m < static_cast<double>(hit.range_m)) {
      before_m_ = -1;
      return rounded(flake_m);
    }
  }
  if (hit.surface == Surface::none) {
    before_m_ = -1;
    return 0;
  }
  double range = static_cast<double>(hit.range_m);
  if (hit.surface == Surface::glass) {
    if (luck < errors_.window_share) return 0;
    if (luck < errors_.window_share + 0.12) range += 1.0 + 3.0 * random.uniform();  // into the room
  }
  // LMS 291: 30 m at 10 % reflectivity, falling with the square of the range; polished or grazed surfaces
  // fade.
  const double echo = static_cast<double>(hit.reflectivity * hit.cos_incidence);
  const double needed = 0.1 * (range / 30.0) * (range / 30.0);
  if (echo < needed * (0.6 + 0.8 * random.uniform())) return 0;
  const double here = range;
  if (before_m_ > 0 && std::abs(before_m_ - range) > 0.3 && random.chance(errors_.mixed_share))
    range = std::min(before_m_, range) + random.uniform() * std::min(3.0, std::abs(before_m_ - range));
  before_m_ = here;
  return rounded(range + errors_.noise_m * noise);
}

double RangeMeter::measure_near(double range_m, Random& random) {
  before_m_ = -1;
  return rounded(range_m + errors_.noise_m * random.normal());
}

}  // namespace alces::sim
