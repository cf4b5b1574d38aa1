// The true poses of the scans of a drive that stands still for each of them: what the mapper's benchmarks
// use. The vehicle that drives on is in vehicle_motion.h.
#pragma once

#include <cstdint>
#include <vector>

#include "alces/pose.h"
#include "alces_platform/sim/world/tour.h"
#include "alces_platform/sim/world/town.h"

namespace alces::sim {

class Route {
 public:
  static constexpr double step_m = way_per_scan_m;

  Route(const Tour& tour, const Town& town, std::size_t scans, std::uint64_t seed);

  /// Poses of the body (on the ground, between the wheels) in the town frame.
  [[nodiscard]] const std::vector<Pose>& poses() const { return town_from_body_; }
  /// Length of the tour before it starts over, m.
  [[nodiscard]] double length_m() const { return length_m_; }

 private:
  std::vector<Pose> town_from_body_;
  double length_m_ = 0;
};

}  // namespace alces::sim
