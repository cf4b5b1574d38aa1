// How a block of memory is shared out: the mapper's fixed parts first, what is left is the pool of points.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "alces/mapper.h"

namespace alces::offline {

struct MemoryPlan {
  std::size_t limit_bytes = 0;       ///< what was allowed
  std::size_t block_bytes = 0;       ///< Mapper::memory_required(): what is taken, and all that is
  std::size_t pool_bytes = 0;        ///< of these, for stored scans
  std::size_t scan_bytes = 0;        ///< for poses, edges, loop detection and LOA, a scan of capacity
  std::size_t scans_bytes = 0;       ///< the same for all scans
  std::size_t cache_slot_bytes = 0;  ///< a slot
  std::size_t cache_bytes = 0;       ///< all slots
  std::size_t working_bytes = 0;     ///< the rest: voxel table, scratch, correspondences, list of loops
};

/// Sets config.pool_bytes to what the other parts leave of `limit_bytes` if it is 0, and plans.
/// CapacityError, which states the least memory needed, if not even that fits.
[[nodiscard]] MemoryPlan plan_memory(MapperConfig& config, std::size_t limit_bytes);

/// One block, aligned for the mapper, given back at the end.
class MemoryBlock {
 public:
  /// std::bad_alloc.
  explicit MemoryBlock(std::size_t bytes);
  [[nodiscard]] std::span<std::byte> bytes() const { return {block_.get(), bytes_}; }

 private:
  struct Free {
    void operator()(std::byte* block) const;
  };
  std::unique_ptr<std::byte, Free> block_;
  std::size_t bytes_;
};

}  // namespace alces::offline
