#include "flat_patches.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

namespace alces::offline {
namespace {

constexpr double least_share = 0.9;        // of a cell's points that must lie in its plane
constexpr double outlier_factor = 3;       // tolerances off the plane: not of it
constexpr double least_width_factor = 3;   // tolerances that a patch is wide, as a standard deviation
constexpr double least_slenderness = 0.1;  // width by length: what one sweep hits far away is a line

class Splitter {
 public:
  Splitter(std::span<const Eigen::Vector3d> points_m, const FlatPatchSettings& settings)
      : points_m_(points_m), settings_(settings) {}

  void split(std::vector<std::uint32_t> which, const Eigen::Vector3d& center_m, double cell_m) {
    if (which.size() < settings_.least_points) return;
    if (take(which)) return;
    const double child_m = cell_m / 2;
    if (child_m < std::max(settings_.smallest_cell_m, 10 * settings_.tolerance_m) - 1e-9) return;
    std::array<std::vector<std::uint32_t>, 8> children;
    for (const std::uint32_t i : which) {
      const Eigen::Vector3d& p = points_m_[i];
      const std::size_t octant = (p.x() >= center_m.x() ? 1U : 0U) + (p.y() >= center_m.y() ? 2U : 0U) +
                                 (p.z() >= center_m.z() ? 4U : 0U);
      children[octant].push_back(i);
    }
    which = {};
    for (std::size_t octant = 0; octant < 8; ++octant) {
      const Eigen::Vector3d side((octant & 1U) != 0 ? 1 : -1, (octant & 2U) != 0 ? 1 : -1,
                                 (octant & 4U) != 0 ? 1 : -1);
      split(std::move(children[octant]), center_m + 0.5 * child_m * side, child_m);
    }
  }

  std::vector<FlatPatch> patches;

 private:
  // The plane through most of the points, if there is one.
  bool take(const std::vector<std::uint32_t>& which) {
    std::vector<std::uint32_t> kept = which;
    for (int round = 0; round < 3; ++round) {
      const PlaneFit plane = fit_plane(points_m_, kept);
      if (plane.rms_m > outlier_factor * settings_.tolerance_m) return false;
      std::vector<std::uint32_t> near;
      for (const std::uint32_t i : which)
        if (std::abs(plane.normal.dot(points_m_[i] - plane.center_m)) <=
            outlier_factor * settings_.tolerance_m)
          near.push_back(i);
      if (static_cast<double>(near.size()) < least_share * static_cast<double>(which.size())) return false;
      const bool is_settled = near.size() == kept.size();
      kept = std::move(near);
      if (is_settled) break;
    }
    const PlaneFit plane = fit_plane(points_m_, kept);
    const bool is_wide = plane.width_m >= least_width_factor * settings_.tolerance_m &&
                         plane.width_m >= least_slenderness * plane.length_m;
    if (plane.rms_m > settings_.tolerance_m || !is_wide) return false;
    patches.push_back({std::move(kept)});
    return true;
  }

  std::span<const Eigen::Vector3d> points_m_;
  FlatPatchSettings settings_;
};

}  // namespace

PlaneFit fit_plane(std::span<const Eigen::Vector3d> points_m, std::span<const std::uint32_t> which,
                   std::span<const double> weights) {
  PlaneFit plane;
  double sum = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < which.size(); ++k) {
    const double weight = weights.empty() ? 1 : weights[k];
    sum += weight;
    mean += weight * points_m[which[k]];
  }
  if (!(sum > 0)) return plane;
  mean /= sum;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < which.size(); ++k) {
    const Eigen::Vector3d offset = points_m[which[k]] - mean;
    spread += (weights.empty() ? 1 : weights[k]) * offset * offset.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread / sum);
  plane.center_m = mean;
  plane.normal = axes.eigenvectors().col(0);
  plane.across = axes.eigenvectors().col(1);
  plane.along = axes.eigenvectors().col(2);
  plane.rms_m = std::sqrt(std::max(0.0, axes.eigenvalues()[0]));
  plane.width_m = std::sqrt(std::max(0.0, axes.eigenvalues()[1]));
  plane.length_m = std::sqrt(std::max(0.0, axes.eigenvalues()[2]));
  return plane;
}

std::vector<FlatPatch> find_flat_patches(std::span<const Eigen::Vector3d> points_m,
                                         std::vector<std::uint32_t> which,
                                         const FlatPatchSettings& settings) {
  using Cell = std::tuple<std::int64_t, std::int64_t, std::int64_t>;
  std::vector<std::pair<Cell, std::uint32_t>> by_cell;
  by_cell.reserve(which.size());
  const auto cell_of = [&settings](double x_m) {
    return static_cast<std::int64_t>(std::floor(x_m / settings.largest_cell_m + 0.5));
  };
  for (const std::uint32_t i : which) {
    const Eigen::Vector3d& p = points_m[i];
    by_cell.emplace_back(Cell{cell_of(p.x()), cell_of(p.y()), cell_of(p.z())}, i);
  }
  std::sort(by_cell.begin(), by_cell.end());
  Splitter splitter(points_m, settings);
  for (std::size_t begin = 0; begin < by_cell.size();) {
    const Cell cell = by_cell[begin].first;
    std::vector<std::uint32_t> members;
    std::size_t end = begin;
    for (; end < by_cell.size() && by_cell[end].first == cell; ++end) members.push_back(by_cell[end].second);
    const Eigen::Vector3d center_m =
        settings.largest_cell_m * Eigen::Vector3d(static_cast<double>(std::get<0>(cell)),
                                                  static_cast<double>(std::get<1>(cell)),
                                                  static_cast<double>(std::get<2>(cell)));
    splitter.split(std::move(members), center_m, settings.largest_cell_m);
    begin = end;
  }
  return std::move(splitter.patches);
}

}  // namespace alces::offline
