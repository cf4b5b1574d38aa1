#include "alces_platform/sim/world/crowd.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "alces_platform/sim/random.h"

namespace alces::sim {

Crowd::Crowd(const CrowdSettings& settings, std::uint64_t seed, const VehicleMotion& motion, const Town& town)
    : settings_(settings), motion_(motion), town_(town) {
  for (std::size_t number = 0; number < settings.people; ++number) {
    Random random(mix(seed, 140, number));
    people_.push_back(
        {random.uniform(0, 2 * std::numbers::pi),
         random.uniform(0.05, 0.2) * (random.chance(0.5) ? 1.0 : -1.0), Wander(random.next(), 15),
         Wander(random.next(), 12), static_cast<float>(random.uniform(0.2, 0.3)),
         static_cast<float>(random.uniform(1.5, 1.9)), static_cast<float>(random.uniform(0.1, 0.6))});
  }
}

std::vector<Pole> Crowd::at(std::int64_t stamp_ns) const {
  std::vector<Pole> poles;
  if (people_.empty()) return poles;
  const Eigen::Vector2d vehicle_m = motion_.town_from_body(stamp_ns).translation_m.head<2>();
  const double time_s = static_cast<double>(stamp_ns - motion_.start_stamp_ns()) * 1e-9;
  const double middle_m = 0.5 * (settings_.nearest_m + settings_.farthest_m);
  const double reach_m = 0.5 * (settings_.farthest_m - settings_.nearest_m);
  poles.reserve(people_.size());
  for (const Person& person : people_) {
    const double bearing_rad =
        person.first_bearing_rad + person.turn_rad_per_s * time_s + 0.4 * person.bearing(time_s);
    const double range_m = middle_m + reach_m * std::clamp(0.7 * person.range(time_s), -1.0, 1.0);
    const Eigen::Vector2d at_m =
        vehicle_m + range_m * Eigen::Vector2d(std::cos(bearing_rad), std::sin(bearing_rad));
    Pole pole;
    pole.foot = {static_cast<float>(at_m.x()), static_cast<float>(at_m.y()),
                 static_cast<float>(town_.height_m(at_m))};
    pole.radius = person.radius_m;
    pole.height = person.height_m;
    pole.reflectivity = person.reflectivity;
    poles.push_back(pole);
  }
  return poles;
}

}  // namespace alces::sim
