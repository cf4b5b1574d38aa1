#include "memory_plan.h"

#include <fmt/format.h>

#include "alces_platform/settings/mapper_settings.h"
#include "offline/io/files/byte_size.h"
#include "offline/io/files/error.h"
#include "offline/io/scans/scan_survey.h"

namespace alces::offline {

void fit_cell_capacity(MapperConfig& config, std::size_t limit_bytes, ScanSource& scans,
                       const std::function<bool()>& is_stopped) {
  if (config.voxel.cell_capacity != 0) return;
  constexpr std::uint32_t step = 1024;
  constexpr std::uint32_t usual = settings::usual_cell_capacity;
  const std::uint32_t needed = most_cells(scans, config.voxel, usual, is_stopped);
  std::uint32_t steps = (needed + step - 1) / step;
  for (; steps > usual / step; --steps) {
    config.voxel.cell_capacity = steps * step;
    if (settings::least_memory(config) <= limit_bytes / 4 * 3) return;
  }
  config.voxel.cell_capacity = usual;
}

MemoryPlan plan_memory(MapperConfig& config, std::size_t limit_bytes) {
  if (config.voxel.cell_capacity == 0) config.voxel.cell_capacity = settings::usual_cell_capacity;
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
