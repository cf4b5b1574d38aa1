// A drive through a place: true poses, scans, odometry, and the pairs of scans that are offered as loops.
#pragma once

#include <cstdint>
#include <functional>
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
  bool is_bare = false;     ///< too little stands around one of them to tell where one is, even for a person
};

struct PlaceDrive {
  Place place;
  Scanner scanner = Scanner::turning;
  std::vector<Pose> truth;                ///< map_from_scanner, the map being scan 0
  std::vector<std::vector<Point>> scans;  ///< in the scanner's frame
  std::vector<Pair> pairs;

  /// Wheels and a gyro, `noise` times as wrong as sim::OdometrySettings says: the odometry as it is at 1.
  [[nodiscard]] std::vector<Pose> odometry(double noise) const;
};

/// Which pairs of scans are offered. Both sorts are spread over the drive; every other pair of different
/// places is the nearest such scan, as the mapper itself would offer it, the rest are any within reach.
struct PairRules {
  std::size_t most = 4;        ///< of each sort
  double least_way_m = 12;     ///< driven in between
  double reach_m = 15;         ///< how far apart at most
  double nearest_other_m = 2;  ///< places in sight of each other are different from here on
  double revisit_way_m = 12;   ///< driven in between at a revisit
  std::uint64_t seed = 0;
  /// Whether nothing stands between two scans; where it is not known, yes.
  std::function<bool(std::uint32_t, std::uint32_t)> in_sight = [](std::uint32_t, std::uint32_t) {
    return true;
  };
};
[[nodiscard]] std::vector<Pair> choose_pairs(std::span<const Pose> truth, const PairRules& rules);

/// Odometry that is `noise` times as wrong as it is, where it is only known as it is: the errors of
/// sim::OdometrySettings, noise - 1 times, on top.
[[nodiscard]] std::vector<Pose> disturbed(std::span<const Pose> odometry, double noise, std::uint64_t seed);

/// `pairs_a_sort`: at most so many pairs of different places, and so many revisits.
[[nodiscard]] PlaceDrive drive_through(Place place, Scanner scanner, std::size_t pairs_a_sort);

}  // namespace alces::places
