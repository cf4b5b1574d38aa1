#include "alces/voxel_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace alces {
namespace {

constexpr std::int64_t free_key = std::numeric_limits<std::int64_t>::min();
constexpr float cell_limit = 1 << 20;  // 21 bits an axis fit the key

struct CellIndex {
  std::int64_t x, y, z;
};

CellIndex cell_of(const Point& point, float cells_per_m) {
  return {static_cast<std::int64_t>(std::floor(point.x * cells_per_m)),
          static_cast<std::int64_t>(std::floor(point.y * cells_per_m)),
          static_cast<std::int64_t>(std::floor(point.z * cells_per_m))};
}

std::int64_t key_of(const CellIndex& cell) {
  return (cell.x << 42) ^ ((cell.y & 0x1FFFFF) << 21) ^ (cell.z & 0x1FFFFF);
}

std::uint32_t hash_of(std::int64_t key) {
  const std::uint64_t mixed = static_cast<std::uint64_t>(key) * 0x9E3779B97F4A7C15ULL;  // Fibonacci hashing
  return static_cast<std::uint32_t>(mixed >> 32);
}

float squared_range(const Point& point) {
  return point.x * point.x + point.y * point.y + point.z * point.z;
}

}  // namespace

std::uint32_t VoxelGrid::find(std::int64_t key) const {
  std::uint32_t slot = hash_of(key) & (slot_count_ - 1);
  for (std::uint32_t probe = 0; probe < maximum_probes; ++probe) {
    const std::int64_t found = cells_[slot].key;
    if (found == key || found == free_key) return slot;
    slot = (slot + 1) & (slot_count_ - 1);
  }
  return slot_count_;
}

void VoxelGrid::clear() {
  for (std::uint32_t i = 0; i < used_; ++i) cells_[order_[i]].key = free_key;
  used_ = 0;
}

bool VoxelGrid::sum_up(std::span<const Point> points, const RangeLimits& limits, float cell_size_m,
                       std::uint32_t capacity, bool leaves_out, VoxelGridCounts& counts) {
  counts = VoxelGridCounts{};
  counts.points = static_cast<std::uint32_t>(points.size());
  counts.cell_size_m = cell_size_m;
  const float cells_per_m = 1.0F / cell_size_m;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& point = points[i];
    const float range_m2 = squared_range(point);
    if (!(range_m2 <= limits.far_m2)) {  // also NaN, and what overflows when squared
      ++(is_finite(point) ? counts.too_far : counts.not_finite);
      continue;
    }
    if (range_m2 < limits.near_m2) {
      ++counts.too_near;
      continue;
    }
    const std::int64_t key = key_of(cell_of(point, cells_per_m));
    const std::uint32_t slot = find(key);
    if (slot == slot_count_ || (cells_[slot].key == free_key && used_ == capacity)) {
      if (leaves_out) {
        ++counts.without_cell;
        continue;
      }
      clear();
      return false;
    }
    Cell& cell = cells_[slot];
    if (cell.key == free_key) {
      cell = Cell{key, 0, 0, 0, 0, std::numeric_limits<float>::max(), static_cast<std::uint32_t>(i)};
      order_[used_++] = slot;
    } else {
      ++counts.merged;
    }
    cell.sum_x += point.x;
    cell.sum_y += point.y;
    cell.sum_z += point.z;
    ++cell.count;
  }
  counts.kept = used_;
  return true;
}

void VoxelGrid::choose_nearest_centroid(std::span<const Point> points, const RangeLimits& limits,
                                        float cell_size_m) {
  for (std::uint32_t i = 0; i < used_; ++i) {  // sums become centroids
    Cell& cell = cells_[order_[i]];
    const float share = 1.0F / static_cast<float>(cell.count);
    cell.sum_x *= share;
    cell.sum_y *= share;
    cell.sum_z *= share;
  }
  const float cells_per_m = 1.0F / cell_size_m;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& point = points[i];
    const float range_m2 = squared_range(point);
    if (!(range_m2 <= limits.far_m2) || range_m2 < limits.near_m2) continue;
    const std::int64_t key = key_of(cell_of(point, cells_per_m));
    const std::uint32_t slot = find(key);
    if (slot == slot_count_ || cells_[slot].key != key) continue;
    Cell& cell = cells_[slot];
    const float squared_m2 =
        squared_range({point.x - cell.sum_x, point.y - cell.sum_y, point.z - cell.sum_z});
    if (squared_m2 < cell.best_squared_m2) {
      cell.best_squared_m2 = squared_m2;
      cell.best = static_cast<std::uint32_t>(i);
    }
  }
}

Point VoxelGrid::representative(const Cell& cell, std::span<const Point> points, float cell_size_m) const {
  switch (config_.representative) {
    case CellRepresentative::measured:
      break;
    case CellRepresentative::centroid: {
      const float share = 1.0F / static_cast<float>(cell.count);
      return {cell.sum_x * share, cell.sum_y * share, cell.sum_z * share};
    }
    case CellRepresentative::center: {
      const auto unpack = [&](std::int64_t bits) {  // sign-extends 21 bits
        return (static_cast<float>((bits << 43) >> 43) + 0.5F) * cell_size_m;
      };
      return {(static_cast<float>(cell.key >> 42) + 0.5F) * cell_size_m, unpack(cell.key >> 21),
              unpack(cell.key)};
    }
  }
  return points[cell.best];
}

Status VoxelGrid::reduce(std::span<const Point> points, std::span<Point> reduced, VoxelGridCounts& counts) {
  if (!cleared_) {
    for (Cell& cell : cells_) cell.key = free_key;
    cleared_ = true;
  }
  const float range_limit_m = std::min(config_.maximum_range_m, (cell_limit - 1) * config_.cell_size_m);
  const RangeLimits limits{config_.minimum_range_m * config_.minimum_range_m, range_limit_m * range_limit_m};
  const auto capacity = static_cast<std::uint32_t>(std::min(order_.size(), reduced.size()));

  // Cells beyond the range limit are at most the eight around the origin: larger ones would be no fewer.
  float cell_size_m = config_.cell_size_m;
  while (!sum_up(points, limits, cell_size_m, capacity, cell_size_m > range_limit_m, counts))
    cell_size_m *= 2;

  if (config_.representative == CellRepresentative::measured)
    choose_nearest_centroid(points, limits, cell_size_m);
  for (std::uint32_t i = 0; i < used_; ++i)
    reduced[i] = representative(cells_[order_[i]], points, cell_size_m);
  clear();
  const bool is_coarser = cell_size_m > config_.cell_size_m || counts.without_cell > 0;
  if (is_coarser) return Status::no_voxel_capacity;
  return counts.kept == 0 ? Status::empty_scan : Status::ok;
}

}  // namespace alces
