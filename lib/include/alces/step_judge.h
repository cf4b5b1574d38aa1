// Whether the match of a scan to those before it is believed.
//
// A match can come together where it should not: a facade slides along itself, a crowd follows the vehicle,
// ten scans' worth of road are missing. So it is asked what the paper's front end takes for granted: do
// enough samples of both sides find each other, do they lie on each other, did the match come to rest, and
// does it agree with the motion that was predicted, as far as either can be off.
#pragma once

#include <algorithm>
#include <cstdint>

#include "alces/icp.h"
#include "alces/motion_prior.h"

namespace alces {

enum class StepVerdict : std::uint8_t {
  first,             ///< scan 0: nothing to be matched to
  believed,          ///< matched from the prediction
  found,             ///< matched from a start that had to be searched for
  against_odometry,  ///< found, and believed though the odometry says otherwise
  on_odometry,       ///< the match is not believed: the scan lies where the odometry says
  apart,             ///< nor is there an odometry: a new part of the map begins here
  rejoined,          ///< as apart, but a loop ties the two parts since
};
[[nodiscard]] const char* to_string(StepVerdict verdict);

struct StepVerification {
  double minimum_overlap = 0.4;  ///< share of the samples that find a partner
  /// Share of the samples that lie on the other side's surfaces, as a share of what is usual on this drive:
  /// what a scanner sees of a place again depends on the scanner and on the place.
  double usual_fit_share = 0.8;
  double least_fit_share = 0.5;  ///< after a search has found nothing better
  double held_fit_share = 0.3;   ///< the same where the odometry agrees with the match
  double minimum_fit = 0.15;     ///< anywhere
  /// Squared deviation from the prediction in its standard deviations, 6 degrees of freedom: one in 30,000
  /// steps is farther off by chance.
  double maximum_mahalanobis2 = 30;
};

/// What is usual on a drive: the mean fit of the steps believed so far.
class UsualFit {
 public:
  void learn(double fit) {
    constexpr double most_steps = 50;  // surroundings change
    steps_ = std::min(steps_ + 1, most_steps);
    fit_ += (fit - fit_) / steps_;
  }
  [[nodiscard]] double fit() const { return fit_; }
  /// What a fit lacks of the usual one, 0 to 1. As long as the usual one is more assumed than seen, it tells
  /// little: sparse scans fit less from the first step on.
  [[nodiscard]] double lost(double fit) const {
    const double seen = (steps_ - assumed_steps) / steps_;
    return seen * std::clamp(1 - fit / fit_, 0.0, 1.0);
  }

 private:
  static constexpr double assumed_steps = 3;
  double fit_ = 0.6;
  double steps_ = assumed_steps;
};

enum class StepDoubt : std::uint8_t {
  none,
  no_match,  ///< too few correspondences
  overlap,   ///< too few samples find a partner
  fit,       ///< they find partners, but do not lie on them
  restless,  ///< the match used up its iterations and still moved
  motion,    ///< the motion is not one that the prediction explains
};
[[nodiscard]] const char* to_string(StepDoubt doubt);

/// Why a match is not believed, or none. `usual_fit`: UsualFit::fit().
/// `was_searched`: no other start has led to a better match, so that less will do.
[[nodiscard]] StepDoubt judge_step(const IcpResult& match, const MotionPrior::Prediction& prediction,
                                   double usual_fit, bool was_searched, const StepVerification& thresholds);

}  // namespace alces
