#include "alces/step_judge.h"

namespace alces {

const char* to_string(StepVerdict verdict) {
  switch (verdict) {
    case StepVerdict::first:
      return "first";
    case StepVerdict::believed:
      return "believed";
    case StepVerdict::found:
      return "found by search";
    case StepVerdict::against_odometry:
      return "found by search, against the odometry";
    case StepVerdict::on_odometry:
      return "on odometry alone";
    case StepVerdict::apart:
      return "apart: begins a new part of the map";
    case StepVerdict::rejoined:
      return "apart, and joined by a loop since";
  }
  return "unknown verdict";
}

const char* to_string(StepDoubt doubt) {
  switch (doubt) {
    case StepDoubt::none:
      return "none";
    case StepDoubt::no_match:
      return "too few correspondences";
    case StepDoubt::overlap:
      return "too little overlap";
    case StepDoubt::fit:
      return "the surfaces do not fit";
    case StepDoubt::restless:
      return "the match does not come to rest";
    case StepDoubt::motion:
      return "the motion is not plausible";
  }
  return "unknown doubt";
}

StepDoubt judge_step(const IcpResult& match, const MotionPrior::Prediction& prediction, double usual_fit,
                     bool was_searched, const StepVerification& thresholds) {
  if (match.verdict == IcpVerdict::too_few_correspondences) return StepDoubt::no_match;
  if (prediction.is_blind && !was_searched) return StepDoubt::motion;
  if (match.overlap < thresholds.minimum_overlap) return StepDoubt::overlap;
  const bool is_usual = match.balanced_fit >= thresholds.usual_fit_share * usual_fit;
  const bool is_plausible = prediction.mahalanobis2(match.model_from_data) <= thresholds.maximum_mahalanobis2;
  // A match that the odometry held, and agrees with, is no worse than the odometry alone.
  const bool is_held = prediction.from_odometry && is_plausible;
  const double least_share = !was_searched ? thresholds.usual_fit_share
                             : is_held     ? thresholds.held_fit_share
                                           : thresholds.least_fit_share;
  const double least = least_share * usual_fit;
  if (match.balanced_fit < std::max(least, thresholds.minimum_fit)) return StepDoubt::fit;
  const bool is_at_rest = match.verdict != IcpVerdict::iteration_limit;
  if (!is_at_rest && !was_searched) return StepDoubt::restless;
  // Without odometry a prediction is a guess: it asks for a search, and has no say against what that found.
  if (was_searched && !prediction.from_odometry) return StepDoubt::none;
  return is_plausible || (was_searched && is_usual) ? StepDoubt::none : StepDoubt::motion;
}

}  // namespace alces
