// Does the map hold a matched scan in every direction? Only surfaces that face the same way on both sides
// count: ICP alone would let the ground beside a wall hold on to the wall's foot, and call the height known.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "alces/kd_tree.h"
#include "alces/pose.h"
#include "offline/optimize/lum/prepared_scan.h"

namespace alces::offline {

struct SurfaceAgreement {
  std::size_t samples = 0;   ///< of the scan that lie on a plane and have a point of the map within the limit
  std::size_t agreeing = 0;  ///< of these, with the map's surface facing the same way there
  /// Smallest over largest curvature of the distances along the normals, radians weighed by the points' rms
  /// distance from their middle: 0 where a direction is left open, about 0.5 in a room, 0.05 in a street.
  double least_curvature_ratio = 0;
};

[[nodiscard]] SurfaceAgreement surface_agreement(const PreparedScan& scan, const Pose& map_from_body,
                                                 const KdTree& map, double limit_m);

}  // namespace alces::offline
