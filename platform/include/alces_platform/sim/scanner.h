// The scanner of a vehicle that stands still: two SICK LMS 291 back to back on a yawing head (ScanDriveDuo).
// A profile is a vertical fan of 181 rays from straight down to straight up; the head turns between profiles.
// The one that drives is in sweep_caster.h.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "alces/point.h"
#include "alces/pose.h"
#include "alces_platform/sim/world/range_errors.h"
#include "alces_platform/sim/world/scene.h"

namespace alces::sim {

struct ScannerSettings : RangeErrors {
  /// Rays a scan; rounded to whole profiles of 181. What looks into the sky or into windows comes back as
  /// nothing.
  std::size_t points_per_scan = 35000;
  double height_m = 1.0;       ///< of the head above the ground, on the body's z axis
  double own_radius_m = 0.45;  ///< rays that would end on the own vehicle are left out
};

class Scanner {
 public:
  static constexpr std::size_t rays_per_profile = 181;

  Scanner(const ScannerSettings& settings, std::uint64_t seed);

  [[nodiscard]] std::size_t profiles() const { return profiles_; }
  [[nodiscard]] std::size_t rays() const { return profiles_ * rays_per_profile; }

  /// Scan number `scan` from where the body stands, in the body frame, profile by profile.
  void scan(const Scene& scene, const Pose& town_from_body, std::size_t scan,
            std::vector<Point>& points) const;

 private:
  ScannerSettings settings_;
  std::uint64_t seed_;
  std::size_t profiles_;
  std::vector<Eigen::Vector3d> directions_;  ///< in the body frame
};

}  // namespace alces::sim
