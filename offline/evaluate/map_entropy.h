// How crisp is a map? Two figures that need no ground truth: mean map entropy (Droeschel and Behnke 2014;
// Razlaw et al. 2015), and mean plane variance.
//
// For points of the map, the covariance of all points within a radius: its entropy 0.5 ln |2 pi e Cov|, in
// nats, and its smallest eigenvalue, the squared thickness of the surface there. Lower is crisper. Both
// depend on the radius, the density and the place, so that they compare maps of the same scans alone; and a
// map that tears a loop open can have low figures, for each visit is crisp by itself: see them beside the
// consistency of revisits.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "alces/pose.h"
#include "offline/io/scans/scan_source.h"

namespace alces::offline {

struct MapEntropySettings {
  double radius_m = 0.3;
  double cell_size_m = 0.1;  ///< each scan is downsampled to one measured point a cell first
  double min_range_m = 1.5;
  double max_range_m = 20;  ///< as for the consistency figure
  std::size_t min_neighbours = 10;
  std::size_t queries = 100'000;  ///< points asked about, evenly spread over the map; 0: all
};

struct MapEntropy {
  std::size_t points = 0;             ///< of the map
  std::size_t measured = 0;           ///< points that were asked about and have enough neighbours
  double mean_entropy = 0;            ///< nats
  double mean_plane_variance_m2 = 0;  ///< mean smallest eigenvalue
};

/// As many poses as scans: InputError. Directions thinner than 0.1 mm count as 0.1 mm. Some 20 bytes a point
/// of the map; a few seconds for HANNOVER1. The same figures whatever the number of threads.
[[nodiscard]] MapEntropy measure_map_entropy(
    ScanSource& scans, std::span<const Pose> map_from_scan, const MapEntropySettings& settings = {},
    const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace alces::offline
