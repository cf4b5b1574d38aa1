// Samples of the surface that a scan saw: chosen points with the normal of their surroundings. They are what
// moves in a match; all points of the other scan are what they are matched to.
//
// Cost: one k-nearest-neighbour query and a 3x3 eigenvalue problem a sample.
#pragma once

#include <cstdint>
#include <span>

#include "alces/kd_tree.h"

namespace alces {

struct SurfaceConfig {
  std::uint32_t sample_capacity = 1536;  ///< most samples a scan
  std::uint32_t neighbors = 16;          ///< of the plane fit, the sample itself included; 3 to KdTree's most
  float neighbor_radius_m = 1.0F;        ///< neighbours farther than this do not count
};

struct SurfaceSample {
  std::uint32_t index = 0;  ///< of the point in the scan's tree
  float normal[3] = {};     ///< unit length, either way, body frame; zero where there is no plane
  float roughness = 1;      ///< smallest over middle eigenvalue: 0 a perfect plane, 1 none
};

/// Fills `samples` with up to `config.sample_capacity` samples spread evenly over the tree's order, thus over
/// the scan's surface; returns how many.
std::uint32_t sample_surface(const KdTree& tree, const SurfaceConfig& config,
                             std::span<SurfaceSample> samples);

}  // namespace alces
