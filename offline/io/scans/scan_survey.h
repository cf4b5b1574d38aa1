// How many cells the fullest of a folder's scans has, found before the mapper's memory is taken.
#pragma once

#include <cstdint>
#include <functional>

#include "alces/voxel_grid.h"
#include "scan_source.h"

namespace alces::offline {

/// The most cells that a scan of `scans` is downsampled to, or `enough`, whichever is more. Only those scans
/// are read whose files could hold more than `enough` points, by what the largest file holds a byte; of a
/// source that can be read only once, none. A scan that cannot be read counts nothing here: the run says so.
/// `is_stopped`, unless empty, ends the survey early.
[[nodiscard]] std::uint32_t most_cells(ScanSource& scans, const VoxelGridConfig& voxel, std::uint32_t enough,
                                       const std::function<bool()>& is_stopped = {});

}  // namespace alces::offline
