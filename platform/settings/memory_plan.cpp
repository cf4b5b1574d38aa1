#include "alces_platform/settings/memory_plan.h"

#include <algorithm>
#include <new>

#include "alces/arena.h"

namespace alces::settings {
namespace {

// What one part costs is what the plan grows by: the library is asked, nothing is calculated twice.
template <typename Change>
std::size_t difference(const MapperConfig& config, Change change) {
  MapperConfig changed = config;
  change(changed);
  return Mapper::memory_required(changed) - Mapper::memory_required(config);
}

constexpr std::uint32_t many = 64;  // arrays are rounded up to 64 bytes

MapperConfig with_no_pool(const MapperConfig& config) {
  MapperConfig changed = config;
  changed.pool_bytes = 0;
  return changed;
}

}  // namespace

std::size_t least_memory(const MapperConfig& config) {
  return Mapper::memory_required(with_no_pool(config)) + config.pool_bytes;
}

std::size_t largest_stored_scan(const MapperConfig& config) {
  return 8 * std::size_t{config.voxel.cell_capacity} + 16 * std::size_t{config.surface.sample_capacity} +
         StoredScanLayout::record_bytes(0, 0, Mapper::stored_channels(config));
}

std::uint32_t scans_that_fit(const MapperConfig& config, std::size_t limit_bytes, bool has_archive) {
  constexpr std::size_t most_scans = 10'000'000;  // four months of one a second
  MapperConfig no_scans = config;
  no_scans.scan_capacity = 0;
  const std::size_t fixed_bytes = least_memory(no_scans);
  if (fixed_bytes >= limit_bytes) return 0;
  const std::size_t left_bytes = limit_bytes - fixed_bytes;
  const std::size_t scan_bytes =
      difference(no_scans, [](MapperConfig& c) { c.scan_capacity += many; }) / many + 1;
  std::size_t scans = 0;
  if (has_archive || config.pool_bytes != 0) {
    scans = (config.pool_bytes != 0 ? left_bytes : left_bytes / 2) / scan_bytes;
  } else {
    scans = left_bytes / (scan_bytes + largest_stored_scan(config) / 8);
  }
  // rounding of arrays may cost a little more than scan_bytes says
  scans = std::min(scans, most_scans);
  for (; scans > 0; --scans) {
    no_scans.scan_capacity = static_cast<std::uint32_t>(scans);
    if (least_memory(no_scans) <= limit_bytes) break;
  }
  return static_cast<std::uint32_t>(scans);
}

MemoryPlan plan_memory(MapperConfig& config, std::size_t limit_bytes) {
  const MapperConfig without_pool = with_no_pool(config);
  const std::size_t fixed_bytes = Mapper::memory_required(without_pool);
  if (config.pool_bytes == 0 && limit_bytes > fixed_bytes) {
    // all that is left, but no more than the scans can fill
    const std::size_t largest_scan_bytes = largest_stored_scan(config);
    const std::size_t left_bytes = limit_bytes - fixed_bytes;
    const std::size_t useful_scans =
        std::min<std::size_t>(config.scan_capacity, left_bytes / largest_scan_bytes + 1);
    config.pool_bytes =
        std::min(left_bytes, useful_scans * largest_scan_bytes) / Arena::alignment * Arena::alignment;
  }

  MemoryPlan plan;
  plan.limit_bytes = limit_bytes;
  plan.block_bytes = Mapper::memory_required(config);
  plan.pool_bytes = config.pool_bytes;
  plan.cache_slot_bytes = difference(without_pool, [](MapperConfig& c) { c.cache_slots += many; }) / many;
  MapperConfig no_scans = without_pool;
  no_scans.scan_capacity = 0;
  MapperConfig no_slots = without_pool;
  no_slots.cache_slots = 0;
  plan.scans_bytes = fixed_bytes - Mapper::memory_required(no_scans);
  plan.scan_bytes = plan.scans_bytes / std::max<std::size_t>(config.scan_capacity, 1);
  plan.cache_bytes = fixed_bytes - Mapper::memory_required(no_slots);
  plan.working_bytes = plan.block_bytes - plan.pool_bytes - plan.scans_bytes - plan.cache_bytes;
  return plan;
}

MemoryBlock::MemoryBlock(std::size_t bytes)
    : block_(static_cast<std::byte*>(::operator new (bytes, std::align_val_t{Arena::alignment}))),
      bytes_(bytes) {}

void MemoryBlock::Free::operator()(std::byte* block) const {
  ::operator delete (block, std::align_val_t{Arena::alignment});
}

}  // namespace alces::settings
