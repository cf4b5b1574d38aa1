// The graph that TORO and HOG-Man get as post-processing: the links of LUM, each matched with ICP until it
// rests.
//
// LUM matches and solves in turns. The paper's TORO and HOG-Man rows do not: "we used the same SLAM graph as
// for LUM, but iterated the scan matching part of the front end first and then optimized the resulting graph"
// (section 4.2).
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "alces/mapper.h"
#include "offline/optimize/graph/constraint_graph.h"
#include "offline/optimize/lum/scan_cache.h"

namespace alces::offline {

struct LinkMatchingSettings {
  LumSettings links;  ///< which scans are linked, what a scan is reduced to, threads
  IcpConfig match;    ///< from where the map has the two scans
  EdgeUncertainty uncertainty;
  double minimum_overlap = 0.4;  ///< of a link that is believed, as in the mapper
  double maximum_rms_m = 0.10;
  double bridge_m = 0.05;  ///< standard deviation of scans that no match binds to those before: they keep the
  double bridge_rad = 0.01;  ///< map's relative pose
};

struct LinkMatching {
  ConstraintGraph graph;
  std::size_t links = 0;
  std::size_t refused = 0;  ///< did not match, or badly
  std::size_t bridges = 0;
  bool was_stopped = false;
};

/// The mapper's settings for the match and for belief.
[[nodiscard]] LinkMatchingSettings link_matching_settings(const MapperConfig& config, const LumSettings& lum);

/// On all cores; equal input gives equal bits. `progress` comes from any thread, one call at a time.
[[nodiscard]] LinkMatching match_links(std::span<const Pose> map_from_scan, ScanCache& cache,
                                       const LinkMatchingSettings& settings,
                                       const std::function<void(std::size_t, std::size_t)>& progress = {},
                                       const std::function<bool()>& stop_requested = {});

}  // namespace alces::offline
