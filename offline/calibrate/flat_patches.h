// Flat pieces of what a scanner sees: space is cut into cubes, and a cube whose points do not lie in a plane
// into eight, down to a least size (the adaptive voxels of Liu and Zhang, BALM: Bundle Adjustment for Lidar
// Mapping, RA-L 6(2), 2021). Large cubes say how flat a wall is, small ones hold what is left.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace alces::offline {

struct FlatPatchSettings {
  double largest_cell_m = 8;
  double smallest_cell_m = 0.5;
  double tolerance_m = 0.04;  ///< rms of the points' distances from their plane; no cell below 10 of it
  std::size_t least_points = 24;
};

struct FlatPatch {
  std::vector<std::uint32_t> points;  ///< places in the span, ascending; those off the plane are left out
};

/// A plane with weights; axes of the weighted points' spread: widest, narrower, normal.
struct PlaneFit {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d along = Eigen::Vector3d::UnitX();
  Eigen::Vector3d across = Eigen::Vector3d::UnitY();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double rms_m = 0;     ///< along the normal
  double width_m = 0;   ///< standard deviation along `across`
  double length_m = 0;  ///< standard deviation along `along`
};
/// `weights` empty: all alike. At least three points.
[[nodiscard]] PlaneFit fit_plane(std::span<const Eigen::Vector3d> points_m,
                                 std::span<const std::uint32_t> which, std::span<const double> weights = {});

/// Of the points `which` in the frame whose origin is the middle of a largest cell. In a fixed order. About
/// 0.1 s for 100,000 points.
[[nodiscard]] std::vector<FlatPatch> find_flat_patches(std::span<const Eigen::Vector3d> points_m,
                                                       std::vector<std::uint32_t> which,
                                                       const FlatPatchSettings& settings);

}  // namespace alces::offline
