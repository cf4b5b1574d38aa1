// How a block of memory is shared out: the mapper's fixed parts first, what is left is the pool of points.
#pragma once

#include <cstddef>
#include <functional>

#include "alces/mapper.h"
#include "alces_platform/settings/memory_plan.h"
#include "offline/io/scans/scan_source.h"

namespace alces::offline {

using settings::MemoryBlock;
using settings::MemoryPlan;

/// Sets config.voxel.cell_capacity, if it is 0, so that the fullest of `scans` finds its cells: at least
/// settings::usual_cell_capacity, and no more than three quarters of `limit_bytes` have room for beside the
/// other fixed parts. scan_capacity is known. Reads the scans that may be that full; see most_cells().
void fit_cell_capacity(MapperConfig& config, std::size_t limit_bytes, ScanSource& scans,
                       const std::function<bool()>& is_stopped = {});

/// Sets config.voxel.cell_capacity to settings::usual_cell_capacity if it is 0, config.pool_bytes to what the
/// other parts leave of `limit_bytes` if it is 0, and plans. CapacityError, which states the least memory
/// needed, if not even that fits.
[[nodiscard]] MemoryPlan plan_memory(MapperConfig& config, std::size_t limit_bytes);

}  // namespace alces::offline
