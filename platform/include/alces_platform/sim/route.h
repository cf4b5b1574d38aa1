// The way of the vehicle through the town: a closed tour with nested loops, and the true pose of every scan
// on it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "alces/pose.h"
#include "alces_platform/sim/town.h"

namespace alces::sim {

/// A tour over crossings of a layout's street lines, (column line, row line) one after the other, closed.
struct Tour {
  Layout layout;
  std::vector<Eigen::Vector2i> crossings;
  bool closed = true;
  double start_fraction = 0;  ///< of the first street that lies behind the first scan
};

/// The tour for a drive of so many scans. From about 230 scans: 26 streets, about 1.24 km with loops in
/// loops, some streets driven twice the same way and some the other way; longer drives start over. Below:
/// around one small block.
[[nodiscard]] Tour make_tour(std::size_t scans, std::uint64_t seed);

class Route {
 public:
  static constexpr double step_m = 1.34;  ///< mean way from scan to scan: 1.2 s at 1.1 m/s

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
