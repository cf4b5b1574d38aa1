// How a block of memory is shared out: the mapper's fixed parts first, what is left is the pool of points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "alces/mapper.h"

namespace alces::settings {

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

/// What the configuration needs at least: everything but a pool that is still to be sized (pool_bytes 0).
[[nodiscard]] std::size_t least_memory(const MapperConfig& config);

/// A stored scan of full size, in the pool or the archive.
[[nodiscard]] std::size_t largest_stored_scan(const MapperConfig& config);

/// For a drive of unknown length: how many scans `limit_bytes` have room for. With an archive half of what
/// the other parts leave goes to poses and edges (some hundred bytes a scan), the rest is pool; without one
/// the pool is the limit of a drive, so there is room for as many scans as it holds when they fill an eighth
/// of voxel.cell_capacity. 0: not even one.
[[nodiscard]] std::uint32_t scans_that_fit(const MapperConfig& config, std::size_t limit_bytes,
                                           bool has_archive);

/// Sets config.pool_bytes, if it is 0, to what the other parts leave of `limit_bytes`, which is at least
/// least_memory(config), and plans.
[[nodiscard]] MemoryPlan plan_memory(MapperConfig& config, std::size_t limit_bytes);

/// One block, aligned for an Arena, given back at the end.
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

}  // namespace alces::settings
