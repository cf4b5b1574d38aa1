// Samples of the surface that a scan saw: chosen points with the normal of their surroundings. They are what
// moves in a match; all points of the other scan are what they are matched to.
//
// Cost: one k-nearest-neighbour query and a 3x3 eigenvalue problem a sample.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "alces/kd_tree.h"

namespace alces {

struct SurfaceConfig {
  std::uint32_t sample_capacity = 1536;  ///< most samples a scan
  std::uint32_t neighbors = 16;          ///< of the plane fit, the sample itself included; 3 to KdTree's most
  /// Neighbours farther than this many times what is typical of the scan at that range do not count: they are
  /// of another surface.
  float neighbor_reach = 2.0F;
};

/// How densely a scan sees, measured on the scan itself.
///
/// A scanner turns by fixed angles, so that its points lie farther apart in proportion to their range. Near
/// the scanner the cells that a scan was downsampled to keep them apart.
struct ScanSpacing {
  float per_range = 0;        ///< typical distance to the last of SurfaceConfig::neighbors, a metre of range
  float smallest_m = 0;       ///< the same where points are densest (the nearest tenth of such distances)
  float typical_m = 0;        ///< their median
  float typical_range_m = 0;  ///< median range of the points

  /// That distance at a range.
  [[nodiscard]] float at(float range_m) const { return std::max(smallest_m, per_range * range_m); }
};

/// Measures at most 128 points, spread evenly over the tree's order: as many searches.
[[nodiscard]] ScanSpacing measure_spacing(const KdTree& tree, std::uint32_t neighbors);

struct SurfaceSample {
  std::uint32_t index = 0;  ///< of the point in the scan's tree
  float normal[3] = {};     ///< unit length, body frame, towards its origin; zero where there is no plane
  float roughness = 1;      ///< smallest over middle eigenvalue: 0 a perfect plane, 1 none
};

/// Fills `samples` with up to `config.sample_capacity` samples spread evenly over the tree's order, thus over
/// the scan's surface; returns how many.
std::uint32_t sample_surface(const KdTree& tree, const SurfaceConfig& config, const ScanSpacing& spacing,
                             std::span<SurfaceSample> samples);

}  // namespace alces
