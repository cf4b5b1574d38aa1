// Every number of the global relaxation (LUM), each with its reason.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "alces/voxel_grid.h"

namespace alces::offline {

enum class LumMetric : std::uint8_t {
  point,  ///< the paper's: whole distances between corresponding points (Appendix A.2)
  plane,  ///< along the surface's normal where there is one, weakly to the point elsewhere
};

struct LumSettings {
  LumMetric metric = LumMetric::plane;

  // What a scan is reduced to. Voxels as in `map`.
  VoxelGridConfig voxel{.cell_capacity = 32768};
  std::uint32_t samples = 768;   ///< points a scan that ask the scan at the link's other end
  std::uint32_t neighbors = 12;  ///< of a sample's plane
  float neighbor_reach = 2.0F;   ///< SurfaceConfig::neighbor_reach

  // Which scans are linked.
  double link_distance_m = 12;  ///< between two scanners
  std::uint32_t links_a_scan =
      24;  ///< the nearest so many earlier scans at most; 0: all within link_distance_m
  std::uint32_t minimum_correspondences = 100;  ///< a link with fewer says nothing
  double minimum_overlap = 0.25;  ///< nor one where a smaller share of the samples finds a partner

  // Correspondences.
  float first_distance_limit_m = 1.5F;  ///< in the first iteration ...
  float last_distance_limit_m = 0.3F;   ///< ... multiplied by limit_factor down to this
  float limit_factor = 0.7F;
  std::uint32_t coarse_stride = 4;  ///< only every so many samples until the last limit is reached
  float robust_share =
      0.15F;  ///< residuals above this share of the limit count little (Geman-McClure); 0: all alike
  float rough_weight = 0.05F;  ///< plane metric: of the distance where there is no plane
  double variance_floor_m =
      0.01;  ///< added to a link's standard deviation: no link is surer than the scanner

  // Links that pull against all others (dynamic covariance scaling, Agarwal et al. 2013).
  bool switches_links = true;
  double switch_factor = 4;      ///< times the median pull of all links ...
  double switch_least_m = 0.05;  ///< ... but never below this

  // When it ends.
  std::uint32_t maximum_iterations = 50;
  double mean_change_m = 0.0005;  ///< of the positions in one iteration at the last limit: converged; or ...
  double link_change_m =
      0.0025;  ///< ... of linked scans against each other, a tenth of a scanner's noise: far from the first
               ///< scan a long drive creeps on when nothing changes between neighbours any more

  // What it may take.
  std::uint32_t loaded_scans = 1024;  ///< in memory at once, some 0.2 MB each
  std::uint32_t threads = 0;          ///< 0: one a core
  bool covariances = false;
};

/// UsageError, one sentence, for values that make no sense.
void check(const LumSettings& settings);

/// The paper's Appendix A.2: whole distances, all correspondences alike, links as they come.
[[nodiscard]] LumSettings paper_lum();

/// What a checkpoint is compared by: all that bears on the result, in one line.
[[nodiscard]] std::string fingerprint(const LumSettings& settings);

}  // namespace alces::offline
