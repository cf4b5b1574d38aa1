// PCL's ICP and GICP behind an interface without PCL, so that its headers are compiled once and apart.
#pragma once

#include <span>
#include <string>

#include "alces/point.h"
#include "alces/pose.h"

namespace alces::bench {

enum class PclMethod { icp, gicp };

struct PclMatch {
  Pose model_from_data;
  bool has_converged = false;
  double ms = 0;  ///< trees, covariances and iterations; not the copy into PCL's clouds
};

/// Ends when a step moves less than `translation_epsilon_m` and turns less than `rotation_epsilon_rad` (ICP;
/// GICP compares the entries of the matrices with PCL's defaults).
[[nodiscard]] PclMatch pcl_match(PclMethod method, std::span<const Point> model, std::span<const Point> data,
                                 const Pose& model_from_data, double distance_limit_m, int iterations,
                                 double translation_epsilon_m, double rotation_epsilon_rad);

[[nodiscard]] std::string pcl_version();

}  // namespace alces::bench
