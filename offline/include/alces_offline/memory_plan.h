// How a block of memory is shared out: the mapper's fixed parts first, what is left is the pool of points.
#pragma once

#include <cstddef>

#include "alces/mapper.h"
#include "alces_platform/settings/memory_plan.h"

namespace alces::offline {

using settings::MemoryBlock;
using settings::MemoryPlan;

/// Sets config.pool_bytes to what the other parts leave of `limit_bytes` if it is 0, and plans.
/// CapacityError, which states the least memory needed, if not even that fits.
[[nodiscard]] MemoryPlan plan_memory(MapperConfig& config, std::size_t limit_bytes);

}  // namespace alces::offline
