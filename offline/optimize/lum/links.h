// Which scans are linked: all near enough, the nearest first.
#pragma once

#include <span>
#include <vector>

#include "link_sums.h"

namespace alces::offline {

/// Pairs whose scanners are within link_distance_m, of each scan at most the links_a_scan nearest earlier
/// ones, and always each scan with the one before it. Ascending by (j, k). Expected O(n) through a grid.
[[nodiscard]] std::vector<ScanLink> find_links(std::span<const Pose> map_from_scan,
                                               const LumSettings& settings);

}  // namespace alces::offline
