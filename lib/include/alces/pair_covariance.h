// The uncertainty of a matched pair of scans, from the sums that the match has left.
//
// appendix_a() is the paper's: E = (M^T M)^-1 M^T Z, s^2 = (Z - M E)^T (Z - M E) / (2m - 3), C = s^2 (M^T
// M)^-1, with rows M_i = [ I | -[p_i]x ], columns (translation, rotation). The text prints C = s^2 (M^T M);
// dimensions, and the use of C^-1 in W, say the inverse. Nothing is stacked: (Z - M E)^T (Z - M E) = Z^T Z -
// E^T M^T Z.
#pragma once

#include "alces/icp.h"
#include "alces/pose.h"
#include "alces/pose_graph.h"

namespace alces {

struct PairCovariance {
  bool is_known = false;                   ///< false: too few correspondences, or a direction is undetermined
  Vector6d residual = Vector6d::Zero();    ///< E: what is left of the offset (m, rad)
  double variance_m2 = 0;                  ///< s^2
  Matrix6d covariance = Matrix6d::Zero();  ///< C, of (translation, rotation vector) about the frame's origin
};

/// Appendix A from the sums of the last iteration.
[[nodiscard]] PairCovariance appendix_a(const IcpSums& sums);

/// C from the curvature that a match has minimised on: right where surfaces could slide, and with what
/// correspondences have in common (IcpUncertainty). `prior`, unless null: what the match was held by counts,
/// too.
[[nodiscard]] PairCovariance from_curvature(const IcpResult& result, const IcpUncertainty& uncertainty = {},
                                            const IcpPrior* prior = nullptr);

/// What an edge's label has beside the covariance of its match.
struct EdgeUncertainty {
  double inflation = 15;  ///< factor on the covariance: real drives err more than simulated ones
  double minimum_translation_m = 0.003;  ///< standard deviation added on each axis
  double minimum_rotation_rad = 0.0003;  ///< standard deviation added about each axis
  /// Factor on the covariance of a match that used up its iterations: it was still moving, and by how much it
  /// would have gone on, its residuals do not tell.
  double unconverged_factor = 5;
};

/// Labels an edge: the covariance, about the model frame's origin, taken to the data's place
/// `model_from_data`, and to the axes of the data's body. An unknown covariance gives `unknown` for every
/// axis (m and rad standard deviation).
[[nodiscard]] EdgeVariance edge_variance(const PairCovariance& pair, const Pose& model_from_data,
                                         const EdgeUncertainty& uncertainty, double unknown_m = 0.5,
                                         double unknown_rad = 0.05);

}  // namespace alces
