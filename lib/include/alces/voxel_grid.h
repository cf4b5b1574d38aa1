// Thins a scan out to one point a cell of a regular grid, through a hash table of fixed size.
//
// Cost: two passes over the points, O(1) a point (at most `maximum_probes` table slots are looked at).
// Memory: 32 bytes a slot, two to four slots a cell of capacity (a power of two), and 4 bytes a cell.
#pragma once

#include <cstdint>
#include <span>

#include "alces/arena.h"
#include "alces/point.h"
#include "alces/status.h"

namespace alces {

/// What stands for the points of a cell.
enum class CellRepresentative : std::uint8_t {
  measured,  ///< the measured point nearest the centroid: no point is invented (default)
  centroid,  ///< the mean: averages the noise, rounds corners
  center,    ///< the middle of the cell: what 3DTK's octree reduction may give
};

struct VoxelGridConfig {
  float cell_size_m = 0.10F;
  CellRepresentative representative = CellRepresentative::measured;
  std::uint32_t cell_capacity = 16384;  ///< most points that a reduced scan can have
  float minimum_range_m = 0.5F;         ///< from the frame's origin; nearer points are the robot itself
  float maximum_range_m = 100.0F;       ///< farther points are counted and left out
};

/// Where the points of one scan went; the counts add up to the points handed in.
struct VoxelGridCounts {
  std::uint32_t points = 0;        ///< handed in
  std::uint32_t kept = 0;          ///< cells, thus points that came out
  std::uint32_t merged = 0;        ///< fell into a cell that another point stands for
  std::uint32_t not_finite = 0;    ///< NaN or Inf
  std::uint32_t too_near = 0;      ///< below minimum_range_m
  std::uint32_t too_far = 0;       ///< above maximum_range_m
  std::uint32_t without_cell = 0;  ///< the table was full
};

class VoxelGrid {
 public:
  static constexpr std::uint32_t maximum_probes = 256;

  constexpr VoxelGrid(Arena& arena, const VoxelGridConfig& config)
      : config_(config),
        slot_count_(slots_for(config.cell_capacity)),
        cells_(arena.allocate<Cell>(slot_count_)),
        order_(arena.allocate<std::uint32_t>(config.cell_capacity)) {}

  /// Writes one point a cell to `reduced`, cells in the order of their first point, and returns ok,
  /// no_voxel_capacity (more cells than the capacity or `reduced` allow: points of cells seen before
  /// that count on, later cells are left out and counted) or empty_scan (no usable point).
  [[nodiscard]] Status reduce(std::span<const Point> points, std::span<Point> reduced,
                              VoxelGridCounts& counts);

 private:
  struct Cell {
    std::int64_t key;  // packed cell coordinates; `free_key` if unused
    float sum_x, sum_y, sum_z;
    std::uint32_t count;
    float best_squared_m2;  // of the measured point nearest the centroid so far
    std::uint32_t best;     // its index
  };

  static constexpr std::uint32_t slots_for(std::uint32_t capacity) {
    std::uint32_t slots = 64;
    while (slots < 2 * capacity && slots < (1U << 30)) slots *= 2;
    return slots;
  }

  // Slot of the key, or of the free slot where it belongs; slot_count_ after too many probes.
  [[nodiscard]] std::uint32_t find(std::int64_t key) const;

  VoxelGridConfig config_;
  std::uint32_t slot_count_;
  std::span<Cell> cells_;           // open addressing, linear probing
  std::span<std::uint32_t> order_;  // used slots in the order of their first point
  std::uint32_t used_ = 0;
  bool cleared_ = false;
};

}  // namespace alces
