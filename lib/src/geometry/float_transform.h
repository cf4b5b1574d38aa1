// A pose and points in single precision: what the loops over thousands of points work with.
#pragma once

#include <Eigen/Core>

#include "alces/point.h"
#include "alces/pose.h"

namespace alces {

struct FloatTransform {
  float r[9];  // rows
  float t[3];

  explicit FloatTransform(const Pose& pose = Pose{}) {
    const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        r[3 * row + column] = static_cast<float>(rotation(row, column));
      t[row] = static_cast<float>(pose.translation_m[row]);
    }
  }
  [[nodiscard]] Point rotate(const Point& p) const {
    return {r[0] * p.x + r[1] * p.y + r[2] * p.z, r[3] * p.x + r[4] * p.y + r[5] * p.z,
            r[6] * p.x + r[7] * p.y + r[8] * p.z};
  }
  Point operator*(const Point& p) const {
    const Point q = rotate(p);
    return {q.x + t[0], q.y + t[1], q.z + t[2]};
  }
};

inline Point operator-(const Point& a, const Point& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline float dot(const Point& a, const Point& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Point cross(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Eigen::Vector3d as_vector(const Point& p) {
  return {static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
}

}  // namespace alces
