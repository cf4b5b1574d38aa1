#include "alces_drivers/gps/local_plane.h"

#include <cmath>
#include <numbers>

#include "alces/portable_math.h"

namespace alces {
namespace {

constexpr double deg = std::numbers::pi / 180;
constexpr double semi_major_axis_m = 6378137.0;  // WGS 84
constexpr double flattening = 1 / 298.257223563;
constexpr double eccentricity_squared = flattening * (2 - flattening);

}  // namespace

Eigen::Vector3d ecef_from_geodetic(const Geodetic& position) {
  const auto [sin_lat, cos_lat] = portable::sine_cosine(deg * position.latitude_deg);
  const auto [sin_lon, cos_lon] = portable::sine_cosine(deg * position.longitude_deg);
  const double normal_m = semi_major_axis_m / std::sqrt(1 - eccentricity_squared * sin_lat * sin_lat);
  const double axis_distance_m = (normal_m + position.height_m) * cos_lat;
  return {axis_distance_m * cos_lon, axis_distance_m * sin_lon,
          (normal_m * (1 - eccentricity_squared) + position.height_m) * sin_lat};
}

LocalPlane::LocalPlane(const Geodetic& origin) : origin_ecef_m_(ecef_from_geodetic(origin)) {
  const auto [sin_lat, cos_lat] = portable::sine_cosine(deg * origin.latitude_deg);
  const auto [sin_lon, cos_lon] = portable::sine_cosine(deg * origin.longitude_deg);
  enu_from_ecef_ << -sin_lon, cos_lon, 0,               //
      -sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat,  //
      cos_lat * cos_lon, cos_lat * sin_lon, sin_lat;
}

Eigen::Vector3d LocalPlane::enu_from_geodetic(const Geodetic& position) const {
  return enu_from_ecef_ * (ecef_from_geodetic(position) - origin_ecef_m_);
}

}  // namespace alces
