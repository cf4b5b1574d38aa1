// One link of the relaxation: what the correspondences of two scans say, as sums (Appendix A.2).
//
// Both ends ask: samples of j find their nearest points in k and samples of k theirs in j. With p the point
// of j and q that of k in the axes of the map, seen from the link's middle r, a change X_j, X_k of the poses
// (translation, rotation vector about r) leaves the residual
//   Z - M (X_j - X_k),   Z = q - p,   M = [ I | -[p]x ],
// or its part along a normal. M does not know the poses, which is the paper's decomposition; H takes a pose's
// own change, about its own place, to r (middle_from_change). With it numbers stay small however far the
// drive goes. Only M^T M, M^T Z and Z^T Z are kept; nothing is stacked.
//
// Time: a nearest-neighbour query a sample, about 1 ms a link of 2 x 1536 samples.
#pragma once

#include <cstdint>

#include "alces/pose.h"
#include "prepared_scan.h"
#include "settings.h"

namespace alces::offline {

struct ScanLink {
  std::uint32_t j = 0;  ///< the later scan, as in the paper: data
  std::uint32_t k = 0;  ///< the earlier scan: model
  friend bool operator==(const ScanLink&, const ScanLink&) = default;
};

/// How correspondences are taken in one iteration.
struct LinkPass {
  float distance_limit_m = 1;
  float robust_scale_m = 0;  ///< 0: all count alike
  std::uint32_t stride = 1;  ///< every so many samples
};

/// Trivially copyable: goes over the wire as it is.
struct LinkSums {
  double mtm[21] = {};  ///< upper triangle, row by row
  double mtz[6] = {};
  double ztz_m2 = 0;
  double weight = 0;  ///< sum of the weights of the residuals
  std::uint32_t queries = 0;
  std::uint32_t correspondences = 0;

  [[nodiscard]] Matrix6d information_sum() const;
  [[nodiscard]] Vector6d right_side() const;
  [[nodiscard]] double overlap() const;
};

/// The sums of one link at the poses given.
[[nodiscard]] LinkSums sum_link(const PreparedScan& scan_j, const Pose& map_from_j,
                                const PreparedScan& scan_k, const Pose& map_from_k, const LinkPass& pass,
                                const LumSettings& settings);

/// r: halfway between the two scanners, in the map.
[[nodiscard]] Eigen::Vector3d middle_of(const Pose& map_from_j, const Pose& map_from_k);

/// H: what a change of a pose about its own place (translation, rotation vector, map axes) is at `middle`.
[[nodiscard]] Matrix6d middle_from_change(const Pose& map_from_body, const Eigen::Vector3d& middle);

/// What a link asks for, from its sums.
struct LinkEstimate {
  bool is_usable = false;                   ///< enough correspondences and overlap
  Vector6d offset = Vector6d::Zero();       ///< E: of j against k, at the middle
  double variance_m2 = 0;                   ///< s^2
  Matrix6d information = Matrix6d::Zero();  ///< C^-1 = M^T M / s^2
  Vector6d right_side = Vector6d::Zero();   ///< C^-1 E
  double pull_m = 0;  ///< rms over the correspondences of what E would move them by: 0 once all is at peace
  double rms_m = 0;
};
[[nodiscard]] LinkEstimate estimate_link(const LinkSums& sums, const LumSettings& settings,
                                         std::uint32_t stride);

}  // namespace alces::offline
