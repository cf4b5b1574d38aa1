// A drive through a place: true poses, scans, odometry, and the pairs of scans that are offered as loops.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "alces/point.h"
#include "alces/pose.h"
#include "alces_platform/sim/drive.h"
#include "places/place.h"
#include "places/scanner_model.h"

namespace alces::places {

/// Two scans that somebody takes for one place.
struct Pair {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  bool is_revisit = false;  ///< at most 2 m apart, in sight of each other; otherwise another place
};

struct PlaceDrive {
  Place place;
  Scanner scanner = Scanner::turning;
  std::vector<Pose> truth;               ///< map_from_scanner, the map being scan 0
  std::vector<std::vector<Point>> scans;  ///< in the scanner's frame
  std::vector<Pair> pairs;

  /// Wheels and a gyro, `noise` times as wrong as sim::OdometrySettings says: the odometry as it is at 1.
  [[nodiscard]] std::vector<Pose> odometry(double noise) const;
};

/// `pairs_a_sort`: at most so many pairs of different places, and so many revisits.
[[nodiscard]] PlaceDrive drive_through(Place place, Scanner scanner, std::size_t pairs_a_sort);

}  // namespace alces::places
