// A local frame on the WGS 84 ellipsoid: x east, y north, z up, metres, origin where it was made. Exact at
// any distance (through earth-centred coordinates), but "up" is the origin's: 1 km away the ground lies 8 cm
// below z = 0.
#pragma once

#include <Eigen/Core>

namespace alces {

struct Geodetic {
  double latitude_deg = 0;
  double longitude_deg = 0;
  double height_m = 0;  ///< above the ellipsoid
};

/// Earth-centred, earth-fixed: x through 0 N 0 E, z through the north pole.
[[nodiscard]] Eigen::Vector3d ecef_from_geodetic(const Geodetic& position);

class LocalPlane {
 public:
  explicit LocalPlane(const Geodetic& origin);
  [[nodiscard]] Eigen::Vector3d enu_from_geodetic(const Geodetic& position) const;

 private:
  Eigen::Vector3d origin_ecef_m_;
  Eigen::Matrix3d enu_from_ecef_;
};

}  // namespace alces
