// How well a match holds each of the six directions of motion: along a tunnel nothing holds x, in an open
// field nothing holds x, y and yaw.
//
// A direction's share is the mean square by which the distances along normals change, a metre moved that way,
// while the other five directions give way as they like to: 1 where every sample resists in full, 0 where
// moving changes no distance or only what another direction makes good. A turn is measured where the samples
// are, at their typical distance, so that it compares with a shift. Surfaces spread evenly over all
// directions give shares of about 1/3.
//
// Cost: O(1), an inversion of a 6x6 matrix; some 2,000 instructions. Memory: none.
#pragma once

#include <algorithm>

#include "alces/icp.h"

namespace alces {

/// Shares, 0 to 1, along and about the axes of the new scan's body frame.
struct HeldDirections {
  float x = 0;
  float y = 0;
  float z = 0;
  float roll = 0;
  float pitch = 0;
  float yaw = 0;
  [[nodiscard]] float weakest() const { return std::min({x, y, z, roll, pitch, yaw}); }
};

/// All 0 where the match had too few correspondences.
[[nodiscard]] HeldDirections held_directions(const IcpResult& match);

}  // namespace alces
