// People who walk around the vehicle: what a ray may meet before it meets the town.
//
// Each keeps between nearest_m and farthest_m from the vehicle, goes along with it, and walks round it one
// way or the other: nothing of them stands still, neither in the town nor beside the vehicle. Where they are
// is a function of the settings and the time alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "alces_platform/sim/world/scene.h"
#include "alces_platform/sim/world/town.h"
#include "alces_platform/sim/world/vehicle_motion.h"
#include "alces_platform/sim/world/wander.h"

namespace alces::sim {

struct CrowdSettings {
  std::size_t people = 0;
  double nearest_m = 1.5;  ///< from the body's origin to a person's axis
  double farthest_m = 8;
};

class Crowd {
 public:
  /// `motion` and `town` outlive it.
  Crowd(const CrowdSettings& settings, std::uint64_t seed, const VehicleMotion& motion, const Town& town);

  /// Everybody at this time: upright cylinders on the ground.
  [[nodiscard]] std::vector<Pole> at(std::int64_t stamp_ns) const;
  [[nodiscard]] bool is_empty() const { return people_.empty(); }

 private:
  struct Person {
    double first_bearing_rad = 0;
    double turn_rad_per_s = 0;  ///< round the vehicle, on average
    Wander bearing;
    Wander range;
    float radius_m = 0;
    float height_m = 0;
    float reflectivity = 0;
  };
  CrowdSettings settings_;
  const VehicleMotion& motion_;
  const Town& town_;
  std::vector<Person> people_;
};

}  // namespace alces::sim
