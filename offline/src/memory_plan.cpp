#include "alces_offline/memory_plan.h"

#include <fmt/format.h>

#include "alces_offline/byte_size.h"
#include "alces_offline/error.h"

namespace alces::offline {

MemoryPlan plan_memory(MapperConfig& config, std::size_t limit_bytes) {
  const std::size_t least_bytes = settings::least_memory(config);
  if (least_bytes > limit_bytes) {
    const std::size_t kib = (least_bytes + 1023) / 1024;
    const std::string scans =
        config.scan_capacity == 1 ? "one scan" : fmt::format("{} scans", config.scan_capacity);
    throw CapacityError(
        fmt::format("{} of memory are not enough for {} of up to {} points: give at least --memory '{} KiB'",
                    format_byte_size(limit_bytes), scans, config.voxel.cell_capacity, kib));
  }
  return settings::plan_memory(config, limit_bytes);
}

}  // namespace alces::offline
