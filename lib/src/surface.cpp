#include "alces/surface.h"

#include <algorithm>
#include <array>

#include "alces/symmetric_eigen.h"

namespace alces {
namespace {

constexpr float line_ratio = 0.01F;            // middle over largest eigenvalue: at and below, a line
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
  // On a line, as within one sweep of a 2D laser, the range noise would pass for a plane's width.
  if (!(eigenvalues.y() > line_ratio * eigenvalues.z())) return;
  const Eigen::Vector3f normal = eigen.vectors.col(0);
  if (!normal.allFinite()) return;
  Eigen::Map<Eigen::Vector3f>(sample.normal) = normal;
  sample.roughness = std::clamp(eigenvalues.x() / eigenvalues.y(), 0.0F, 1.0F);
}

}  // namespace

std::uint32_t sample_surface(const KdTree& tree, const SurfaceConfig& config,
                             std::span<SurfaceSample> samples) {
  const auto capacity = std::min(config.sample_capacity, static_cast<std::uint32_t>(samples.size()));
  const std::uint32_t count = std::min(tree.size(), capacity);
  std::array<Neighbor, KdTree::maximum_neighbors> neighbors;
  const float radius_m2 = config.neighbor_radius_m * config.neighbor_radius_m;
  const std::uint32_t wanted = std::min(config.neighbors, KdTree::maximum_neighbors);
  for (std::uint32_t i = 0; i < count; ++i) {
    SurfaceSample& sample = samples[i];
    sample = SurfaceSample{};
    sample.index = static_cast<std::uint32_t>(std::uint64_t{i} * tree.size() / count);
    const std::span<Neighbor> found = std::span(neighbors).first(wanted);
    const std::uint32_t near = tree.nearest(tree.point(sample.index), radius_m2, found);
    if (near >= fewest_neighbors) fit_plane(tree, found.first(near), sample);
  }
  return count;
}

}  // namespace alces
