// A world of rectangles and what a scanner would bring back from it, for tests: points drawn evenly from the
// surfaces in reach, with noise, seen through walls. Nothing of it depends on the platform's random numbers.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "alces/point.h"
#include "alces/pose.h"
#include "alces_platform/sim/random.h"

namespace alces::test {

inline Point as_point(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

inline Eigen::Vector3d as_vector(const Point& p) {
  return Eigen::Vector3f(p.x, p.y, p.z).cast<double>();
}

inline Pose pose_at(double x_m, double y_m, double z_m, double yaw_deg, double pitch_deg = 0,
                    double roll_deg = 0) {
  constexpr double deg = 3.14159265358979323846 / 180;
  Pose pose;
  pose.translation_m = {x_m, y_m, z_m};
  pose.rotation = Eigen::AngleAxisd(yaw_deg * deg, Eigen::Vector3d::UnitZ()) *
                  Eigen::AngleAxisd(pitch_deg * deg, Eigen::Vector3d::UnitY()) *
                  Eigen::AngleAxisd(roll_deg * deg, Eigen::Vector3d::UnitX());
  return pose;
}

inline double distance_m(const Pose& a, const Pose& b) {
  return (a.translation_m - b.translation_m).norm();
}
inline double distance_rad(const Pose& a, const Pose& b) {
  return angle_between_rad(a.rotation, b.rotation);
}

class Scene {
 public:
  void rectangle(const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    patches_.push_back({corner, u, v, u.cross(v).norm()});
  }

  /// A box that stands in the world; its floor is left out.
  void box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    const Eigen::Vector3d size = high - low;
    const Eigen::Vector3d x(size.x(), 0, 0);
    const Eigen::Vector3d y(0, size.y(), 0);
    const Eigen::Vector3d z(0, 0, size.z());
    rectangle(low, x, z);
    rectangle(low + y, x, z);
    rectangle(low, y, z);
    rectangle(low + x, y, z);
    rectangle(low + z, x, y);
  }

  /// `count` points, fewer if little lies in reach, in the body frame.
  [[nodiscard]] std::vector<Point> scan(const Pose& map_from_body, std::size_t count, double reach_m,
                                        double noise_m, std::uint64_t seed) const {
    sim::Random random(seed);
    const Pose body_from_map = map_from_body.inverse();
    std::vector<double> up_to;  // cumulated area
    double area_m2 = 0;
    for (const Patch& patch : patches_) up_to.push_back(area_m2 += patch.area_m2);
    std::vector<Point> points;
    for (std::size_t attempt = 0; attempt < 200 * count && points.size() < count; ++attempt) {
      const double at = random.uniform(0, area_m2);
      std::size_t number = 0;
      while (number + 1 < up_to.size() && up_to[number] < at) ++number;
      const Patch& patch = patches_[number];
      const double along = random.uniform();
      const double across = random.uniform();
      Eigen::Vector3d body =
          body_from_map * Eigen::Vector3d(patch.corner + along * patch.u + across * patch.v);
      if (body.norm() > reach_m || body.norm() < 0.5) continue;
      body += noise_m * Eigen::Vector3d{random.normal(), random.normal(), random.normal()};
      points.push_back(as_point(body));
    }
    return points;
  }

 private:
  struct Patch {
    Eigen::Vector3d corner;
    Eigen::Vector3d u;
    Eigen::Vector3d v;
    double area_m2;
  };
  std::vector<Patch> patches_;
};

/// A room of 10 m by 8 m by 3 m with furniture.
inline Scene room() {
  Scene scene;
  scene.rectangle({-5, -4, 0}, {10, 0, 0}, {0, 8, 0});
  scene.box({-5, -4, 0}, {5, 4, 3});
  scene.box({1, 1, 0}, {2.5, 2.2, 0.8});
  scene.box({-4, 2, 0}, {-3, 4, 2});
  scene.box({-2, -3.5, 0}, {-0.5, -2.5, 1.2});
  return scene;
}

/// A street along x between houses that stand back by different amounts, with side walls, 60 m long.
inline Scene street() {
  Scene scene;
  scene.rectangle({-30, -12, 0}, {60, 0, 0}, {0, 24, 0});
  sim::Random random(77);
  for (const double side : {-1.0, 1.0}) {
    for (double x = -30; x < 28;) {
      const double width = random.uniform(5, 9);
      const double back = random.uniform(4.5, 7);
      const double y0 = side * back;
      const double y1 = side * (back + 4);
      scene.box({x, std::min(y0, y1), 0}, {x + width, std::max(y0, y1), random.uniform(4, 8)});
      x += width + random.uniform(0, 2.5);
    }
  }
  return scene;
}

/// Floor and two parallel walls along x, all much longer than the reach of a scan.
inline Scene corridor() {
  Scene scene;
  scene.rectangle({-100, -2, 0}, {200, 0, 0}, {0, 4, 0});
  scene.rectangle({-100, -2, 0}, {200, 0, 0}, {0, 0, 3});
  scene.rectangle({-100, 2, 0}, {200, 0, 0}, {0, 0, 3});
  return scene;
}

/// A street along x between smooth walls, 120 m long. What lies across them are pillars and porches, of which
/// a scan sees few points.
inline Scene walled_street() {
  Scene scene;
  scene.rectangle({-60, -30, 0}, {120, 0, 0}, {0, 60, 0});
  scene.box({-60, 7, 0}, {60, 9, 5});
  scene.box({-60, -9, 0}, {60, -7, 5});
  for (const double x_m : {-13.0, -8.6, -3.1, 2.0, 8.9, 14.2}) scene.box({x_m, 4, 0}, {x_m + 0.6, 4.6, 3});
  scene.box({4, -7, 0}, {7, -5, 4});
  scene.box({-12, -7, 0}, {-9, -5.5, 4});
  return scene;
}

}  // namespace alces::test
