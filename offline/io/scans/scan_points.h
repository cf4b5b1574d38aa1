// A scan as its file or drive has it: points, and what else is known of each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "alces/point.h"

namespace alces::offline {

/// A channel holds one value a point, in the order of the points, or is empty: the scan has none.
struct ScanPoints {
  std::vector<Point> points;            ///< m, body frame
  std::vector<float> time_s;            ///< from the scan's stamp on; may be negative
  std::vector<std::uint8_t> intensity;  ///< 0 to 255

  [[nodiscard]] std::size_t size() const { return points.size(); }
  void clear() {
    points.clear();
    time_s.clear();
    intensity.clear();
  }
};

}  // namespace alces::offline
