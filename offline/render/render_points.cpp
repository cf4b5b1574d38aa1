#include "render_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace alces::offline {
namespace {

double unit(double value) {
  return std::clamp(value, 0.0, 1.0);
}

Rgb8 mix(const Rgb8& from, const Rgb8& to, double fraction) {
  const auto channel = [&](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::lround(a + (b - a) * unit(fraction)));
  };
  return {channel(from.r, to.r), channel(from.g, to.g), channel(from.b, to.b)};
}

double fraction_of(const HeightRange& range, float height_m) {
  return unit((static_cast<double>(height_m) - range.low_m) / std::max(range.high_m - range.low_m, 1e-6));
}

std::size_t pixel_index(const Camera& camera, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width_px()) +
         static_cast<std::size_t>(x);
}

std::size_t pixel_count(const Camera& camera) {
  return pixel_index(camera, 0, camera.height_px());
}

/// Calls take(pixel index, projection, point) for what lies in the picture.
template <typename Take>
std::size_t splat(const Camera& camera, std::span<const Point> points, Take take) {
  std::size_t inside = 0;
  for (const Point& point : points) {
    if (!is_finite(point)) continue;
    const Projected at = camera.project(Eigen::Vector3f(point.x, point.y, point.z).cast<double>());
    if (!(at.x >= 0 && at.y >= 0 && at.x < camera.width_px() && at.y < camera.height_px() && at.depth_m > 0))
      continue;
    take(pixel_index(camera, static_cast<int>(at.x), static_cast<int>(at.y)), at, point);
    ++inside;
  }
  return inside;
}

}  // namespace

double quantile(std::vector<float>& values, double fraction) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return static_cast<double>(*at);
}

Camera Camera::top(const Box& box, int longer_side_px) {
  Camera camera;
  const Eigen::Vector3d size_m = box.max - box.min;
  camera.scale_ = longer_side_px / std::max(size_m.x(), size_m.y());
  camera.width_px_ = std::max(1, static_cast<int>(std::ceil(size_m.x() * camera.scale_)));
  camera.height_px_ = std::max(1, static_cast<int>(std::ceil(size_m.y() * camera.scale_)));
  camera.middle_ = 0.5 * (box.min + box.max);
  camera.view_from_map_ << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  camera.principal_px_ = 0.5 * Eigen::Vector2d(camera.width_px_, camera.height_px_);
  return camera;
}

Camera Camera::oblique(const Box& box, std::span<const Point> driven, std::span<const Point> points,
                       int width_px, int max_height_px) {
  constexpr double azimuth_rad = 60 * std::numbers::pi / 180;  // looking along x and y, more along y
  constexpr double elevation_rad = 38 * std::numbers::pi / 180;
  Camera camera;
  camera.middle_ = 0.5 * (box.min + box.max);
  camera.distance_m_ = 1.5 * (box.max - box.min).norm();
  const Eigen::Vector3d away(std::cos(azimuth_rad) * std::cos(elevation_rad),
                             std::sin(azimuth_rad) * std::cos(elevation_rad), -std::sin(elevation_rad));
  const Eigen::Vector3d right = away.cross(Eigen::Vector3d::UnitZ()).normalized();
  const Eigen::Vector3d down = away.cross(right);
  camera.view_from_map_ << right.transpose(), down.transpose(), away.transpose();

  // Projected at scale 1 without offset, the points say which scale and offset fill the picture.
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::max());
  Eigen::Vector2d high = -low;
  const auto project = [&](const Point& point) {
    const Projected at = camera.project(Eigen::Vector3f(point.x, point.y, point.z).cast<double>());
    return Eigen::Vector2d(at.x, at.y);
  };
  for (const Point& point : driven) {
    low = low.cwiseMin(project(point));
    high = high.cwiseMax(project(point));
  }
  std::vector<float> xs;
  std::vector<float> ys;
  for (const Point& point : points) {
    xs.push_back(static_cast<float>(project(point).x()));
    ys.push_back(static_cast<float>(project(point).y()));
  }
  if (!xs.empty()) {
    low = low.cwiseMin(Eigen::Vector2d(quantile(xs, 0.005), quantile(ys, 0.005)));
    high = high.cwiseMax(Eigen::Vector2d(quantile(xs, 0.995), quantile(ys, 0.995)));
  }
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(std::max(0.5, 0.03 * (high - low).maxCoeff()));
  low -= margin;
  high += margin;
  const Eigen::Vector2d extent = high - low;
  camera.scale_ = std::min(width_px / extent.x(), max_height_px / extent.y());
  camera.width_px_ = width_px;
  camera.height_px_ = std::clamp(static_cast<int>(std::ceil(extent.y() * camera.scale_)), 1, max_height_px);
  camera.principal_px_ =
      0.5 * Eigen::Vector2d(camera.width_px_, camera.height_px_) - 0.5 * camera.scale_ * (low + high);
  return camera;
}

Projected Camera::project(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d view = view_from_map_ * (point - middle_);
  if (distance_m_ <= 0) {
    return {principal_px_.x() + scale_ * view.x(), principal_px_.y() + scale_ * view.y(), 1};
  }
  const double depth_m = distance_m_ + view.z();
  const double shrink = scale_ * distance_m_ / std::max(depth_m, 1e-3);
  return {principal_px_.x() + shrink * view.x(), principal_px_.y() + shrink * view.y(), depth_m};
}

Rgb8 height_color(double fraction) {
  // From slate (ground) over teal, green and yellow to coral: brightness rises with height.
  constexpr std::array<Rgb8, 6> anchors{
      {{62, 84, 140}, {38, 132, 160}, {52, 176, 134}, {150, 206, 92}, {246, 208, 80}, {255, 128, 84}}};
  const double place = unit(fraction) * (anchors.size() - 1);
  const std::size_t below = std::min(static_cast<std::size_t>(place), anchors.size() - 2);
  return mix(anchors[below], anchors[below + 1], place - static_cast<double>(below));
}

TopImage::TopImage(const Camera& camera) : camera_(camera), pixels_(pixel_count(camera)) {}

std::size_t TopImage::add(std::span<const Point> points) {
  return splat(camera_, points, [&](std::size_t index, const Projected&, const Point& point) {
    Pixel& pixel = pixels_[index];
    pixel.low_m = pixel.count == 0 ? point.z : std::min(pixel.low_m, point.z);
    pixel.high_m = pixel.count == 0 ? point.z : std::max(pixel.high_m, point.z);
    ++pixel.count;
  });
}

std::vector<Rgb8> TopImage::tone_mapped(const HeightRange& range) const {
  // Full brightness at the density that only 1 % of the filled pixels exceed.
  std::vector<std::uint32_t> counts;
  for (const Pixel& pixel : pixels_) {
    if (pixel.count > 0) counts.push_back(pixel.count);
  }
  double full = 1;
  if (!counts.empty()) {
    const auto dense = counts.begin() + static_cast<std::ptrdiff_t>(counts.size() * 99 / 100);
    std::nth_element(counts.begin(), dense, counts.end());
    full = std::log1p(static_cast<double>(*dense));
  }
  constexpr double wall_m = 2.5;
  std::vector<Rgb8> image(pixels_.size(), background);
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    const Pixel& pixel = pixels_[i];
    if (pixel.count == 0) continue;
    const double density = unit(std::log1p(static_cast<double>(pixel.count)) / full);
    const double wall = unit(static_cast<double>(pixel.high_m - pixel.low_m) / wall_m);
    const double brightness = 0.12 + 0.38 * density + 0.6 * wall * std::sqrt(density);
    image[i] = mix(background, height_color(fraction_of(range, pixel.high_m)), brightness);
  }
  return image;
}

ObliqueImage::ObliqueImage(const Camera& camera) : camera_(camera), pixels_(pixel_count(camera)) {}

std::size_t ObliqueImage::add(std::span<const Point> points) {
  return splat(camera_, points, [&](std::size_t index, const Projected& at, const Point& point) {
    Pixel& pixel = pixels_[index];
    const auto depth_m = static_cast<float>(at.depth_m);
    if (pixel.depth_m <= 0 || depth_m < pixel.depth_m) pixel = {depth_m, point.z};
  });
}

std::vector<Rgb8> ObliqueImage::tone_mapped(const HeightRange& range) const {
  const int width = camera_.width_px();
  const int height = camera_.height_px();
  // Pixels that most neighbours surround are holes between the points of a surface: they take the nearest
  // neighbour.
  std::vector<Pixel> closed = pixels_;
  const auto for_neighbours = [&](int x, int y, auto take) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const bool inside = x + dx >= 0 && y + dy >= 0 && x + dx < width && y + dy < height;
        if ((dx != 0 || dy != 0) && inside) take(pixel_index(camera_, x + dx, y + dy));
      }
    }
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Pixel& pixel = closed[pixel_index(camera_, x, y)];
      if (pixel.depth_m > 0) continue;
      int filled = 0;
      Pixel nearest;
      for_neighbours(x, y, [&](std::size_t i) {
        if (pixels_[i].depth_m <= 0) return;
        ++filled;
        if (nearest.depth_m <= 0 || pixels_[i].depth_m < nearest.depth_m) nearest = pixels_[i];
      });
      if (filled >= 4) pixel = nearest;
    }
  }
  constexpr double edl_strength = 10;
  std::vector<Rgb8> image(closed.size(), background);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t index = pixel_index(camera_, x, y);
      const Pixel& pixel = closed[index];
      if (pixel.depth_m <= 0) continue;
      double occlusion = 0;
      for_neighbours(x, y, [&](std::size_t i) {
        if (closed[i].depth_m > 0 && closed[i].depth_m < pixel.depth_m) {
          occlusion += std::min(0.02, std::log(static_cast<double>(pixel.depth_m / closed[i].depth_m)));
        }
      });
      const double fraction = fraction_of(range, pixel.height_m);
      const double light = (0.45 + 0.55 * std::sqrt(fraction)) * std::exp(-edl_strength * occlusion);
      image[index] = mix(background, height_color(fraction), light);
    }
  }
  return image;
}

}  // namespace alces::offline
