// Nearest neighbours by looking at every point, for the tests: in the tree's arithmetic, so that distances
// must be equal to the last bit.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "alces/point.h"

namespace alces::test {

inline float plain_squared_m2(const Point& a, const Point& b) {
  const float dx = a.x - b.x;
  const float dy = a.y - b.y;
  const float dz = a.z - b.z;
  return dx * dx + dy * dy + dz * dz;
}

/// Squared distances of the up to `wanted` points nearer than the radius, ascending.
inline std::vector<float> plain_nearest(std::span<const Point> points, const Point& query, float radius_m2,
                                        std::size_t wanted) {
  std::vector<float> squared_m2;
  for (const Point& point : points) {
    const float distance_m2 = plain_squared_m2(point, query);
    if (distance_m2 < radius_m2) squared_m2.push_back(distance_m2);
  }
  std::ranges::sort(squared_m2);
  if (squared_m2.size() > wanted)
    squared_m2.erase(squared_m2.begin() + static_cast<std::ptrdiff_t>(wanted), squared_m2.end());
  return squared_m2;
}

}  // namespace alces::test
