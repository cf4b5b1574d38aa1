#include "alces/surface.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alces/symmetric_eigen.h"
#include "geometry/float_transform.h"

namespace alces {
namespace {

constexpr float line_ratio = 0.01F;  // middle over largest eigenvalue: at and below, a line ...
constexpr float bent_ratio = 5e-4F;  // ... or a bent one, and the bend tells its plane ...
constexpr float bent_m2 = 0.0009F;   // ... if it is wider than lasers' range noise (1 to 3 cm): 3 cm
constexpr std::uint32_t fewest_neighbors = 5;  // fewer do not tell a plane from noise

void fit_plane(const KdTree& tree, std::span<const Neighbor> neighbors, SurfaceSample& sample) {
  const Point origin = tree.point(sample.index);  // differences keep their digits far from the scanner
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  Eigen::Matrix3f products = Eigen::Matrix3f::Zero();
  for (const Neighbor& neighbor : neighbors) {
    const Point p = tree.point(neighbor.index);
    const Eigen::Vector3f d(p.x - origin.x, p.y - origin.y, p.z - origin.z);
    sum += d;
    products += d * d.transpose();
  }
  const float share = 1.0F / static_cast<float>(neighbors.size());
  const Eigen::Matrix3f covariance = share * products - (share * sum) * (share * sum).transpose();
  const SymmetricEigen<3, float> eigen = symmetric_eigen<3, float>(covariance);
  const Eigen::Vector3f eigenvalues = eigen.values;
  // On a line, as within one sweep of a 2D laser, the range noise would pass for a plane's width. A ring on
  // the ground is none: far from the scanner such rings alone say how the ground is tilted.
  const bool is_bent = eigenvalues.y() > bent_ratio * eigenvalues.z() && eigenvalues.y() > bent_m2;
  if (!(eigenvalues.y() > line_ratio * eigenvalues.z() || is_bent)) return;
  Eigen::Vector3f normal = eigen.vectors.col(0);
  if (!normal.allFinite()) return;
  if (normal.dot(Eigen::Vector3f(origin.x, origin.y, origin.z)) > 0) normal = -normal;  // towards the scanner
  Eigen::Map<Eigen::Vector3f>(sample.normal) = normal;
  sample.roughness = std::clamp(eigenvalues.x() / eigenvalues.y(), 0.0F, 1.0F);
}

}  // namespace

ScanSpacing measure_spacing(const KdTree& tree, std::uint32_t neighbors) {
  constexpr std::uint32_t most_measured = 128;
  constexpr float farthest_m2 = 1e8F;  // no scanner sees so far
  constexpr float nearest_range_m = 0.1F;
  const std::uint32_t count = std::min(tree.size(), most_measured);
  const std::uint32_t wanted = std::min(neighbors, KdTree::maximum_neighbors);
  std::array<float, most_measured> distance_m;
  std::array<float, most_measured> per_range;
  std::array<float, most_measured> range_m;
  std::array<Neighbor, KdTree::maximum_neighbors> room;
  std::uint32_t measured = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Point point = tree.point(static_cast<std::uint32_t>(std::uint64_t{i} * tree.size() / count));
    const std::span<Neighbor> found = std::span(room).first(wanted);
    const std::uint32_t near = tree.nearest(point, farthest_m2, found);
    if (near < wanted || near == 0) continue;  // a scan of a few points
    distance_m[measured] = std::sqrt(found[near - 1].squared_m2);
    range_m[measured] = std::sqrt(dot(point, point));
    per_range[measured] = distance_m[measured] / std::max(nearest_range_m, range_m[measured]);
    ++measured;
  }
  if (measured == 0) return {};
  const auto at_share = [measured](std::span<float> values, std::uint32_t tenths) {
    float* const place = &values[tenths * measured / 10];
    std::nth_element(values.data(), place, values.data() + measured);
    return *place;
  };
  return {at_share(per_range, 5), at_share(distance_m, 1), at_share(distance_m, 5), at_share(range_m, 5)};
}

std::uint32_t sample_surface(const KdTree& tree, const SurfaceConfig& config, const ScanSpacing& spacing,
                             std::span<SurfaceSample> samples) {
  const auto capacity = std::min(config.sample_capacity, static_cast<std::uint32_t>(samples.size()));
  const std::uint32_t count = std::min(tree.size(), capacity);
  std::array<Neighbor, KdTree::maximum_neighbors> neighbors;
  const std::uint32_t wanted = std::min(config.neighbors, KdTree::maximum_neighbors);
  for (std::uint32_t i = 0; i < count; ++i) {
    SurfaceSample& sample = samples[i];
    sample = SurfaceSample{};
    sample.index = static_cast<std::uint32_t>(std::uint64_t{i} * tree.size() / count);
    const std::span<Neighbor> found = std::span(neighbors).first(wanted);
    const Point point = tree.point(sample.index);
    const float radius_m = config.neighbor_reach * spacing.at(std::sqrt(dot(point, point)));
    const std::uint32_t near = tree.nearest(point, radius_m * radius_m, found);
    if (near >= fewest_neighbors) fit_plane(tree, found.first(near), sample);
  }
  return count;
}

}  // namespace alces
