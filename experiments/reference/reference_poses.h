// Ground truth as the paper made it (section 4.1, Figure 9): each scan matched to a surveyed 3D map. One pose
// does not depend on the others, so nothing drifts.
//
// The match starts from the last pose that can be trusted, moved on by the start trajectory's step; before
// there is one, from the start trajectory as it stands, which must then be within some metres and degrees of
// the map. A pose is trusted when enough of the scan's surface finds the map, closely, and no direction is
// left open. Walls alone say nothing about height and tilt: join them with a cloud that has the ground.
//
// Cost: one ICP a scan, some 10 to 50 ms. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "alces/icp.h"
#include "alces/voxel_grid.h"
#include "offline/io/scans/scan_source.h"
#include "reference_map.h"

namespace alces::offline {

struct ReferenceSettings {
  VoxelGridConfig voxel;         ///< what a scan is reduced to
  std::uint32_t samples = 1536;  ///< of its surface that ask the map
  IcpConfig match{.maximum_iterations = 60,
                  .first_distance_limit_m = 3,
                  .last_distance_limit_m = 0.3F,
                  .limit_factor = 0.8F};
  double minimum_overlap = 0.5;  ///< share of the samples that find the map within the last distance limit
  double maximum_rms_m = 0.10;
};

enum class ReferenceVerdict : std::uint8_t {
  trusted,
  no_start,       ///< the start trajectory has no pose for the scan
  empty_scan,     ///< no usable point
  too_few,        ///< hardly anything of the scan is in the map
  low_overlap,    ///< below minimum_overlap
  large_rms,      ///< above maximum_rms_m
  undetermined,   ///< a direction is left open, and kept from the start
  not_converged,  ///< the last iteration still moved by more than a centimetre
};
[[nodiscard]] const char* to_string(ReferenceVerdict verdict);

struct ReferencePose {
  ReferenceVerdict verdict = ReferenceVerdict::no_start;
  Pose map_from_body;
  double overlap = 0;
  double rms_m = 0;
  std::uint32_t correspondences = 0;
  double moved_m = 0;  ///< by the match, from where it started
  double turned_rad = 0;
};

struct ReferenceRun {
  std::vector<ReferencePose> poses;  ///< one a scan; fewer after a stop
  bool was_stopped = false;
};

/// `start`: a pose a scan, none where it has none. InputError for a scan that cannot be read.
[[nodiscard]] ReferenceRun find_reference_poses(
    ScanSource& scans, std::span<const std::optional<Pose>> start, const ReferenceMap& map,
    const ReferenceSettings& settings = {},
    const std::function<void(std::size_t, std::size_t)>& progress = {},
    const std::function<bool()>& stop_requested = {});

/// TUM with the trusted poses (the others as comments that say why not, or all of them with `writes_all`),
/// and beside it the same name with .quality.csv: scan, stamp, trusted, reason, overlap, rms_m,
/// correspondences, moved_m, turned_deg of every scan. OutputError.
void write_reference_poses(const std::filesystem::path& tum, const ScanSource& scans, const ReferenceRun& run,
                           bool writes_all);

}  // namespace alces::offline
