// Thins a scan out to one point a cell of a regular grid, through a hash table of fixed size.
//
// A scan of more cells than there is room for is thinned coarser instead of losing a region: the cell size
// doubles until all of it fits, and the result is that of a grid of this size. The size follows from the set
// of points, not from their order.
//
// Cost: two passes over the points, O(1) a point (at most `maximum_probes` table slots are looked at); a
// doubling costs one more over the points that came before the table was full. At most 24 doublings.
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
  std::uint32_t cell_capacity = 16384;  ///< most points that a reduced scan can have; for more, cells grow
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
  std::uint32_t without_cell = 0;  ///< no cells left however large: only where there is room for fewer than 8
  float cell_size_m = 0;           ///< as the scan was downsampled: the configured one, or 2, 4, 8, ... of it
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
  /// no_voxel_capacity (more cells than the capacity or `reduced` allow: counts.cell_size_m says how far
  /// cells grew) or empty_scan (no usable point).
  [[nodiscard]] Status reduce(std::span<const Point> points, std::span<Point> reduced,
                              VoxelGridCounts& counts);

  /// Which of the points stands for cell `i` of the last reduce(), so that its intensity goes with it: the
  /// measured point itself; for the other representatives the cell's first point. i < counts.kept.
  [[nodiscard]] std::uint32_t chosen(std::uint32_t i) const { return cells_[order_[i]].best; }

 private:
  struct Cell {
    std::int64_t key;  // packed cell coordinates; `free_key` if unused
    float sum_x, sum_y, sum_z;
    std::uint32_t count;
    float best_squared_m2;  // of the measured point nearest the centroid so far
    std::uint32_t best;     // its index; at first, of the cell's first point
  };

  static constexpr std::uint32_t slots_for(std::uint32_t capacity) {
    std::uint32_t slots = 64;
    while (slots < 2 * capacity && slots < (1U << 30)) slots *= 2;
    return slots;
  }

  // What is left out by its range, whatever the size of the cells.
  struct RangeLimits {
    float near_m2, far_m2;
  };

  // First pass: the sums of all cells. False: the table is full; it is empty again then.
  [[nodiscard]] bool sum_up(std::span<const Point> points, const RangeLimits& limits, float cell_size_m,
                            std::uint32_t capacity, bool leaves_out, VoxelGridCounts& counts);
  // Second pass, for CellRepresentative::measured.
  void choose_nearest_centroid(std::span<const Point> points, const RangeLimits& limits, float cell_size_m);
  [[nodiscard]] Point representative(const Cell& cell, std::span<const Point> points,
                                     float cell_size_m) const;
  void clear();

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
