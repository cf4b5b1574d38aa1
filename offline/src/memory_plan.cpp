#include "alces_offline/memory_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>

#include "alces/arena.h"
#include "alces_offline/byte_size.h"
#include "alces_offline/error.h"

namespace alces::offline {
namespace {

// What one part costs is what the plan grows by: the library is asked, nothing is calculated twice.
template <typename Change>
std::size_t difference(const MapperConfig& config, Change change) {
  MapperConfig changed = config;
  change(changed);
  return Mapper::memory_required(changed) - Mapper::memory_required(config);
}

}  // namespace

MemoryPlan plan_memory(MapperConfig& config, std::size_t limit_bytes) {
  MapperConfig without_pool = config;
  without_pool.pool_bytes = 0;
  const std::size_t fixed_bytes = Mapper::memory_required(without_pool);
  const std::size_t least_bytes = fixed_bytes + config.pool_bytes;
  if (least_bytes > limit_bytes) {
    const std::size_t kib = (least_bytes + 1023) / 1024;
    throw CapacityError(fmt::format(
        "{} of memory are not enough for {} scans of up to {} points: give at least --memory {}KiB",
        format_byte_size(limit_bytes), config.scan_capacity, config.voxel.cell_capacity, kib));
  }
  if (config.pool_bytes == 0) {
    // all that is left, but no more than the scans can fill: a stored scan is smaller than this
    const std::size_t largest_scan_bytes = 8 * std::size_t{config.voxel.cell_capacity} +
                                           16 * std::size_t{config.surface.sample_capacity} +
                                           Arena::alignment;
    const std::size_t left_bytes = limit_bytes - fixed_bytes;
    const std::size_t useful_scans =
        std::min<std::size_t>(config.scan_capacity, left_bytes / largest_scan_bytes + 1);
    config.pool_bytes =
        std::min(left_bytes, useful_scans * largest_scan_bytes) / Arena::alignment * Arena::alignment;
  }

  constexpr std::uint32_t many = 64;  // arrays are rounded up to 64 bytes
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

}  // namespace alces::offline
