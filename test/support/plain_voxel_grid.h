// Voxel reduction with a std::map, for the tests: no table, no capacity but the one asked for.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "alces/point.h"
#include "alces/voxel_grid.h"

namespace alces::test {

struct PlainCell {
  std::array<long, 3> index{};
  std::vector<std::size_t> points;  // in order
  std::array<double, 3> centroid{};

  [[nodiscard]] double distance_m(const Point& p) const {
    const double dx = static_cast<double>(p.x) - centroid[0];
    const double dy = static_cast<double>(p.y) - centroid[1];
    const double dz = static_cast<double>(p.z) - centroid[2];
    return std::sqrt(dx * dx + dy * dy + dz * dz);
  }
};

struct PlainReduction {
  std::vector<PlainCell> cells;  // in the order of their first point
  VoxelGridCounts counts;
};

// With cells of the configured size alone: what finds no cell is left out.
inline PlainReduction plain_reduce_at_size(std::span<const Point> points, const VoxelGridConfig& config) {
  PlainReduction reduction;
  VoxelGridCounts& counts = reduction.counts;
  counts.cell_size_m = config.cell_size_m;
  std::map<std::array<long, 3>, std::size_t> cell_of;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& p = points[i];
    ++counts.points;
    if (!is_finite(p)) {
      ++counts.not_finite;
      continue;
    }
    const double range_m =
        std::hypot(static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
    if (range_m < static_cast<double>(config.minimum_range_m)) {
      ++counts.too_near;
      continue;
    }
    if (range_m > static_cast<double>(config.maximum_range_m)) {
      ++counts.too_far;
      continue;
    }
    const float cells_per_m = 1.0F / config.cell_size_m;
    const std::array<long, 3> index = {std::lround(std::floor(p.x * cells_per_m)),
                                       std::lround(std::floor(p.y * cells_per_m)),
                                       std::lround(std::floor(p.z * cells_per_m))};
    const auto known = cell_of.find(index);
    if (known != cell_of.end()) {
      ++counts.merged;
      reduction.cells[known->second].points.push_back(i);
    } else if (reduction.cells.size() == config.cell_capacity) {
      ++counts.without_cell;
    } else {
      ++counts.kept;
      cell_of[index] = reduction.cells.size();
      reduction.cells.push_back({index, {i}, {}});
    }
  }
  for (PlainCell& cell : reduction.cells) {
    for (const std::size_t i : cell.points) {
      cell.centroid[0] += static_cast<double>(points[i].x) / static_cast<double>(cell.points.size());
      cell.centroid[1] += static_cast<double>(points[i].y) / static_cast<double>(cell.points.size());
      cell.centroid[2] += static_cast<double>(points[i].z) / static_cast<double>(cell.points.size());
    }
  }
  return reduction;
}

// With the smallest of 1, 2, 4, ... times the configured size at which all points find a cell.
inline PlainReduction plain_reduce(std::span<const Point> points, VoxelGridConfig config) {
  PlainReduction reduction = plain_reduce_at_size(points, config);
  while (reduction.counts.without_cell > 0 && config.cell_size_m <= config.maximum_range_m) {
    config.cell_size_m *= 2;
    reduction = plain_reduce_at_size(points, config);
  }
  return reduction;
}

}  // namespace alces::test
