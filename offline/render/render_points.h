// Points to pixels in plain software, in bounded memory: one pass over the points, then tone mapping.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "alces/point.h"

namespace alces::offline {

struct Box {
  Eigen::Vector3d min = Eigen::Vector3d::Zero();
  Eigen::Vector3d max = Eigen::Vector3d::Zero();
};

/// The value that `fraction` of the values do not exceed; reorders them. At least one value.
[[nodiscard]] double quantile(std::vector<float>& values, double fraction);

/// Where a place of the map lands in the picture: pixels right and down, and how far it is from the eye.
struct Projected {
  double x = 0;
  double y = 0;
  double depth_m = 0;
};

/// A camera: from above (x right, y up) or oblique, a mild perspective on the middle of the box.
class Camera {
 public:
  [[nodiscard]] static Camera top(const Box& box, int longer_side_px);
  /// Fits all of `driven` and the middle 99 % of `points` into the picture: as wide as `width_px`, as high as
  /// that needs, but at most `max_height_px`. `driven` is not empty.
  [[nodiscard]] static Camera oblique(const Box& box, std::span<const Point> driven,
                                      std::span<const Point> points, int width_px, int max_height_px);

  [[nodiscard]] Projected project(const Eigen::Vector3d& point) const;
  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }
  [[nodiscard]] double pixels_per_metre() const {
    return scale_;
  }  ///< from above; oblique: in the middle of the box

 private:
  int width_px_ = 0;
  int height_px_ = 0;
  double scale_ = 1;
  double distance_m_ = 0;  // of the eye from the middle; 0: parallel rays
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d view_from_map_ = Eigen::Matrix3d::Identity();  // rows: right, down, away from the eye
  Eigen::Vector2d principal_px_ = Eigen::Vector2d::Zero();
};

struct Rgb8 {
  std::uint8_t r = 0, g = 0, b = 0;
};
inline constexpr Rgb8 background{11, 15, 23};

/// The colour of a height, 0 to 1 over the map's range.
[[nodiscard]] Rgb8 height_color(double fraction);

struct HeightRange {
  double low_m = 0;
  double high_m = 1;
};

/// From above: a pixel is as bright as it holds many points (logarithmically) and as they span much height,
/// so walls stand out of the ground; its colour is the height of the highest point.
class TopImage {
 public:
  explicit TopImage(const Camera& camera);
  /// Returns how many fell into the picture.
  std::size_t add(std::span<const Point> points);
  [[nodiscard]] std::vector<Rgb8> tone_mapped(const HeightRange& range) const;

 private:
  struct Pixel {
    std::uint32_t count = 0;
    float low_m = 0;
    float high_m = 0;
  };
  Camera camera_;
  std::vector<Pixel> pixels_;
};

/// Oblique: the nearest point of a pixel, coloured by height, shaded by the depth of its neighbours (eye-dome
/// lighting).
class ObliqueImage {
 public:
  explicit ObliqueImage(const Camera& camera);
  std::size_t add(std::span<const Point> points);
  [[nodiscard]] std::vector<Rgb8> tone_mapped(const HeightRange& range) const;

 private:
  struct Pixel {
    float depth_m = 0;  // 0: empty
    float height_m = 0;
  };
  Camera camera_;
  std::vector<Pixel> pixels_;
};

}  // namespace alces::offline
