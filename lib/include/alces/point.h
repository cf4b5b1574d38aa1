// A measured point, in metres, in the frame that its container names (a scan's points: the body frame).
#pragma once

#include <cmath>

namespace alces {

struct Point {
  float x = 0;
  float y = 0;
  float z = 0;
};

[[nodiscard]] inline bool is_finite(const Point& point) {
  return std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
}

}  // namespace alces
