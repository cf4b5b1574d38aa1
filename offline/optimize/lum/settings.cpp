#include "settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "alces/kd_tree.h"
#include "offline/io/files/error.h"

namespace alces::offline {

void check(const LumSettings& settings) {
  const auto at_least = [](const char* name, double value, double least) {
    if (!(value >= least) || !std::isfinite(value))
      throw UsageError(fmt::format("{} is {}; it must be a number of at least {}", name, value, least));
  };
  const auto in_float = [](float value) { return static_cast<double>(value); };
  at_least("the number of samples a scan", settings.samples, 10);
  at_least("the number of neighbours of a normal", settings.neighbors, 5);
  if (settings.neighbors > KdTree::maximum_neighbors)
    throw UsageError(fmt::format("the number of neighbours of a normal is {}; it may be {} at most",
                                 settings.neighbors, KdTree::maximum_neighbors));
  at_least("the voxel size (m)", in_float(settings.voxel.cell_size_m), 0.001);
  at_least("the distance between linked scans (m)", settings.link_distance_m, 0.01);
  at_least("the first distance limit (m)", in_float(settings.first_distance_limit_m), 0.001);
  at_least("the last distance limit (m)", in_float(settings.last_distance_limit_m), 0.001);
  if (!(settings.limit_factor > 0 && settings.limit_factor < 1))
    throw UsageError(fmt::format("the factor of the distance limit is {}; it must lie between 0 and 1",
                                 in_float(settings.limit_factor)));
  at_least("the mean change to stop at (m)", settings.mean_change_m, 0);
  at_least("the change between linked scans to stop at (m)", settings.link_change_m, 0);
  at_least("the number of loaded scans", static_cast<double>(settings.loaded_scans), 2);
}

LumSettings paper_lum() {
  LumSettings settings;
  settings.metric = LumMetric::point;
  settings.robust_share = 0;
  settings.variance_floor_m = 0;
  settings.switches_links = false;
  return settings;
}

std::string fingerprint(const LumSettings& s) {
  return fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {}",
                     static_cast<int>(s.metric), s.voxel.cell_size_m,
                     static_cast<int>(s.voxel.representative), s.voxel.cell_capacity, s.voxel.minimum_range_m,
                     s.voxel.maximum_range_m, s.samples, s.neighbors, s.neighbor_reach, s.link_distance_m,
                     s.links_a_scan, s.minimum_correspondences, s.minimum_overlap, s.first_distance_limit_m,
                     s.last_distance_limit_m, s.limit_factor, s.coarse_stride, s.robust_share, s.rough_weight,
                     s.variance_floor_m, s.switches_links, s.switch_factor, s.switch_least_m);
}

}  // namespace alces::offline
