// Mapper: how a scan is matched to those before it, and what becomes of a match that is not believed.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "alces/mapper.h"

namespace alces {
namespace {

IcpPrior prior_of(const MotionPrior::Prediction& prediction) {
  IcpPrior prior;
  prior.model_from_data = prediction.last_from_next;
  const Eigen::Matrix3d axes = prediction.last_from_next.rotation.toRotationMatrix();
  prior.covariance.setZero();
  prior.covariance.topLeftCorner<3, 3>() =
      axes * prediction.variance.head<3>().asDiagonal() * axes.transpose();
  prior.covariance.bottomRightCorner<3, 3>() =
      axes * prediction.variance.tail<3>().asDiagonal() * axes.transpose();
  return prior;
}

bool has_plane(const SurfaceSample& sample) {
  return sample.normal[0] != 0 || sample.normal[1] != 0 || sample.normal[2] != 0;
}

}  // namespace

EdgeVariance Mapper::match_variance(const IcpResult& match, const IcpPrior* prior) const {
  PairCovariance covariance = config_.label_with_appendix_a
                                  ? appendix_a(match.sums)
                                  : from_curvature(match, config_.scan_match.uncertainty, prior);
  // What did not come to rest is less sure, and so is what fits worse than usual; one is often the other.
  double factor =
      match.verdict == IcpVerdict::iteration_limit ? config_.edge_uncertainty.unconverged_factor : 1.0;
  if (config_.judge_steps) {
    const double shortfall = std::max(1.0, usual_fit_.fit() / std::max(match.balanced_fit, 0.05));
    factor = std::max(factor, shortfall * shortfall * shortfall * shortfall);
  }
  covariance.covariance *= factor;
  return edge_variance(covariance, match.model_from_data, config_.edge_uncertainty);
}

// Without an odometry the motion within a scan is still in it. Where that is much, surfaces fit less than
// usual, and the step is off by a share of its own motion.
void Mapper::widen_for_motion_within(const IcpResult& match, EdgeVariance& variance) const {
  const double lost = usual_fit_.lost(match.balanced_fit);
  constexpr double share =
      2;  // of the motion, by the square of the fit that is lost: bends of simulated drives
  const double off2 = share * share * lost * lost * lost * lost;
  const Pose& step = match.model_from_data;
  const double axis_m2 = off2 * step.translation_m.squaredNorm() / 3;
  variance.x_m2 += axis_m2;
  variance.y_m2 += axis_m2;
  variance.z_m2 += axis_m2;
  variance.rotation_rad2 += off2 * log_so3(step.rotation).squaredNorm();
}

Mapper::Step Mapper::match_step(std::uint32_t n, const MotionPrior::Prediction& prediction,
                                ScanReport& report) {
  const Pose map_from_last = graph_.poses()[n - 1];
  const IcpPrior prior = prior_of(prediction);
  // Constant velocity is a guess to start from, and no measurement.
  const IcpPrior* const used_prior = config_.use_motion_prior && prediction.from_odometry ? &prior : nullptr;
  std::array<IcpScan, maximum_metascan> room;
  std::uint32_t model_count = 0;
  StoredScan newest;
  IcpResult match;
  match.model_from_data = prediction.last_from_next;
  StepDoubt doubt = StepDoubt::no_match;
  const UsualFit usual_fit = usual_fit_;
  bool was_searched = false;
  bool contradicts_odometry = false;
  const auto match_to = [&](std::uint32_t first) {
    if (!load_metascan(first, n, map_from_last, room, model_count) || store_.load(n, newest) != Status::ok) {
      report.archive_failed = true;
      ++counters_.archive_failures;
      return;
    }
    const std::span<const IcpScan> model = std::span(room).first(model_count);
    const IcpScan data{newest.tree, newest.samples, Pose{}};
    const IcpConfig config = step_config(prediction, newest.spacing);
    match = icp_.match(model, {&data, 1}, prediction.last_from_next, config, used_prior);
    doubt = judge_step(match, prediction, usual_fit_.fit(), false, config_.step_verification);
    constexpr double a_little = 0.9;
    if (config_.search_steps && !prediction.from_odometry &&
        match.balanced_fit < a_little * usual_fit_.fit()) {
      // Mostly a vehicle goes on as it went, and pairs from far off may have led away from there.
      IcpConfig near = config;
      near.first_distance_limit_m = near.last_distance_limit_m;
      const IcpResult as_it_went = icp_.match(model, {&data, 1}, prediction.last_from_next, near, used_prior);
      if (as_it_went.balanced_fit > match.balanced_fit + config_.start_search.gain) {
        match = as_it_went;
        doubt = judge_step(match, prediction, usual_fit_.fit(), false, config_.step_verification);
      }
    }
    const bool is_doubted = doubt != StepDoubt::none;
    if (is_doubted && config_.search_steps) {
      was_searched = search_step(model, data, map_from_last, prediction, config, match);
      doubt = judge_step(match, prediction, usual_fit_.fit(), true, config_.step_verification);
    }
    // An odometry that has frozen holds a match where it stands, and what is seen from there fits a little
    // worse.
    const double expected_fit = (is_doubted ? 1.0 : a_little) * usual_fit_.fit();
    if (config_.search_steps && prediction.from_odometry &&
        (doubt != StepDoubt::none || match.balanced_fit < expected_fit)) {
      contradicts_odometry = search_against_odometry(model, data, map_from_last, newest.spacing, prediction,
                                                     config, match, doubt);
      was_searched = was_searched || contradicts_odometry;
    }
    if (doubt == StepDoubt::none) usual_fit_.learn(match.balanced_fit);
  };
  // After a break the scans before it show another place, where they lie by chance: they are asked only if
  // those since then do not know the scan, which one scan in a cloud of steam does not.
  const std::uint32_t first = model_begin(n);
  std::uint32_t since_break = n - 1;
  while (since_break > first && steps_[since_break].verdict != StepVerdict::apart) --since_break;
  match_to(since_break);
  if (doubt != StepDoubt::none && since_break > first && !report.archive_failed) match_to(first);
  if (!is_valid(map_from_last * match.model_from_data))
    doubt = StepDoubt::no_match;  // at the edge of what is a place

  Step step;
  step.has_odometry = prediction.from_odometry;
  const bool is_verified = doubt == StepDoubt::none || (!config_.judge_steps && doubt != StepDoubt::no_match);
  step.last_from_next = is_verified ? match.model_from_data : prediction.last_from_next;
  if (is_verified) {
    step.verdict = contradicts_odometry ? StepVerdict::against_odometry
                   : was_searched       ? StepVerdict::found
                                        : StepVerdict::believed;
    step.variance = match_variance(match, contradicts_odometry ? nullptr : used_prior);
    if (config_.judge_steps && (contradicts_odometry || !prediction.from_odometry))
      widen_for_motion_within(match, step.variance);
  } else {
    step.verdict = prediction.from_odometry ? StepVerdict::on_odometry : StepVerdict::apart;
    const Pose turn{prediction.last_from_next.rotation, Eigen::Vector3d::Zero()};  // it is of that place
    step.variance =
        edge_variance({true, Vector6d::Zero(), 0, prior.covariance}, turn, config_.edge_uncertainty);
  }
  step.support = match.overlap * (1 - usual_fit.lost(match.balanced_fit));
  report.match = match.verdict;
  report.iterations = match.iterations;
  report.correspondences = match.correspondences;
  report.overlap = match.overlap;
  report.fit = match.balanced_fit;
  report.rms_m = match.rms_m;
  report.samples = static_cast<std::uint32_t>(newest.samples.size());
  report.surfaces = static_cast<std::uint32_t>(std::ranges::count_if(newest.samples, has_plane));
  report.held = held_directions(match);
  report.step = step.verdict;
  report.doubt = doubt;
  report.motion_mahalanobis2 = prediction.mahalanobis2(match.model_from_data);
  report.is_predicted = !is_verified;
  return step;
}

// The first scan that scan n is matched to.
std::uint32_t Mapper::model_begin(std::uint32_t n) {
  // From farther off than this share of the range, surfaces are seen from another side.
  constexpr float near_share = 0.5F;
  std::uint32_t begin = n - std::min(n, config_.model_scans);
  if (config_.model_points == 0) return begin;
  const std::uint32_t most = std::min(maximum_metascan, config_.cache_slots - 1);
  std::uint32_t points = 0;
  float near_m = 0;
  StoredScan stored;
  const std::span<const Pose> poses = graph_.poses();
  for (std::uint32_t scan = n; scan-- > 0;) {
    const bool is_more = scan < begin;
    if (is_more) {
      const bool is_wanted = points < config_.model_points && n - scan <= most;
      const double way_m = (poses[n - 1].translation_m - poses[scan].translation_m).norm();
      if (!is_wanted || way_m > static_cast<double>(near_m)) break;
    }
    if (store_.load(scan, stored) != Status::ok) break;
    if (is_more) begin = scan;
    points += stored.tree->size();
    if (near_m == 0) near_m = near_share * stored.spacing.typical_range_m;
  }
  return begin;
}

// How far pairs may be apart: at first as far as the prediction can be off, at last as far as points of one
// surface are.
IcpConfig Mapper::step_config(const MotionPrior::Prediction& prediction, const ScanSpacing& spacing) const {
  IcpConfig config = config_.scan_match;
  config.groups = config_.model_scans;
  config.last_distance_limit_m =
      std::max(config.last_distance_limit_m, config_.pair_reach * spacing.typical_m);
  if (config_.use_motion_prior) {
    const double off_m =
        3 * (prediction.sigma_m() + prediction.sigma_rad() * static_cast<double>(spacing.typical_range_m));
    config.first_distance_limit_m =
        std::clamp(static_cast<float>(off_m), config.first_distance_limit_m, config_.longest_reach_m);
  }
  config.first_distance_limit_m = std::max(config.first_distance_limit_m, config.last_distance_limit_m);
  return config;
}

// Tries other starts than the prediction. True: `match` is a better one.
bool Mapper::search_step(std::span<const IcpScan> model, const IcpScan& data, const Pose& map_from_last,
                         const MotionPrior::Prediction& prediction, const IcpConfig& config,
                         IcpResult& match) {
  const double most_turn_rad = prediction.from_odometry
                                   ? std::clamp(4 * prediction.sigma_rad(), 0.3, std::numbers::pi)
                                   : std::numbers::pi;
  const IcpPrior prior = prior_of(prediction);
  const IcpPrior* const used = config_.use_motion_prior && prediction.from_odometry ? &prior : nullptr;
  std::array<Start, StartSearch::most_starts> room;
  room[0].model_from_data = prediction.last_from_next;
  const std::uint32_t found =
      1 + start_search_.find(model, {&data, 1}, prediction.last_from_next, map_from_last.rotation,
                             static_cast<float>(most_turn_rad), config_.start_search,
                             std::span(room).subspan(1));
  const double gain = prediction.from_odometry ? config_.start_search.gain_against_odometry * usual_fit_.fit()
                                               : config_.start_search.gain;
  IcpResult best = match;
  bool is_better = try_starts(model, data, std::span(room).first(found), gain, config, used, best);
  if (is_better) {
    IcpConfig full = config;
    full.maximum_iterations = 2 * config.maximum_iterations;
    best = icp_.match(model, {&data, 1}, best.model_from_data, full, used);
  }
  // Between long walls it may have slid, as a loop may.
  const bool is_found = best.verdict == IcpVerdict::converged || best.verdict == IcpVerdict::degenerate;
  const IcpResult shifted = is_found ? match_shifted(model, {&data, 1}, config, used, best) : best;
  if (shifted.balanced_fit > best.balanced_fit + (is_better ? 0 : gain)) {
    best = shifted;
    is_better = true;
  }
  if (is_better) match = best;
  return is_better;
}

// A short match from each start. True: the one that fits best fits better than `best`, by at least `gain`,
// and replaces it.
bool Mapper::try_starts(std::span<const IcpScan> model, const IcpScan& data, std::span<const Start> starts,
                        double gain, const IcpConfig& config, const IcpPrior* prior, IcpResult& best) {
  constexpr float reach_cells = 2.5F;  // a start is off by no more
  IcpConfig quick = config;
  quick.maximum_iterations = config_.start_search.iterations;
  quick.finish_iterations = 0;
  quick.first_distance_limit_m =
      std::max(config.last_distance_limit_m, reach_cells * config_.start_search.cell_m);
  double least_fit = best.balanced_fit + gain;
  bool is_better = false;
  for (const Start& start : starts) {
    const IcpResult tried = icp_.match(model, {&data, 1}, start.model_from_data, quick, prior);
    if (tried.verdict == IcpVerdict::too_few_correspondences || tried.balanced_fit < least_fit) continue;
    best = tried;
    least_fit = tried.balanced_fit;
    is_better = true;
  }
  return is_better;
}

// Wheels spin, and buses freeze: a match that goes on as the vehicle went, fits as well as matches do, and
// better than the one which the odometry allows, is believed against it. Where what the vehicle did last
// speaks against the odometry, too, less will do. True: so it is, and `match` is that one.
bool Mapper::search_against_odometry(std::span<const IcpScan> model, const IcpScan& data,
                                     const Pose& map_from_last, const ScanSpacing& spacing,
                                     const MotionPrior::Prediction& prediction, const IcpConfig& config,
                                     IcpResult& match, StepDoubt& doubt) {
  constexpr double clearly_worse = 0.85;  // than the free match: how the match that odometry allows fits
  constexpr double half2 = 0.25;          // squared: of the odometry's distance to constant velocity
  const MotionPrior::Prediction free = motion_[0].as_it_went();
  IcpResult free_match = icp_.match(model, {&data, 1}, free.last_from_next, step_config(free, spacing));
  if (judge_step(free_match, free, usual_fit_.fit(), false, config_.step_verification) != StepDoubt::none)
    (void)search_step(model, data, map_from_last, free, config, free_match);
  const double off2 = free.mahalanobis2(free_match.model_from_data);
  const bool odometry_breaks_off =
      !free.is_blind && off2 <= half2 * free.mahalanobis2(prediction.last_from_next);
  const StepVerification& thresholds = config_.step_verification;
  const double least_share = odometry_breaks_off ? thresholds.least_fit_share : thresholds.usual_fit_share;
  const bool is_usual = free_match.verdict == IcpVerdict::converged &&
                        free_match.balanced_fit >= least_share * usual_fit_.fit();
  const bool is_smooth = off2 <= thresholds.maximum_mahalanobis2;
  const bool is_held_off = doubt == StepDoubt::motion && odometry_breaks_off;
  const bool is_better = match.balanced_fit <= clearly_worse * free_match.balanced_fit;
  if (!is_usual || !is_smooth || !(is_better || is_held_off)) return false;
  match = free_match;
  doubt = StepDoubt::none;
  return true;
}

void Mapper::add_step(std::uint32_t n, const Step& step) {
  // Certain: there is room for as many vertices as scans and for an edge each, and the poses are valid.
  steps_[n] = {step.verdict, static_cast<std::uint8_t>(std::clamp(100 * step.support, 0.0, 255.0)),
               step.has_odometry};
  if (n == 0) {
    (void)graph_.add_vertex(Pose{});
    return;
  }
  const Pose map_from_last = graph_.poses()[n - 1];
  (void)graph_.add_vertex(map_from_last * step.last_from_next);
  Edge edge;
  edge.from = n - 1;
  edge.to = n;
  edge.from_from_to = step.last_from_next;
  edge.variance = step.variance;
  (void)graph_.add_edge(edge);
  const double step_m2 = step.last_from_next.translation_m.squaredNorm();
  driven_m_ += std::sqrt(step_m2);
  uncertainties_[n].rotation_rad2 = uncertainties_[n - 1].rotation_rad2 + edge.variance.rotation_rad2;
  uncertainties_[n].translation_m2 = uncertainties_[n - 1].translation_m2 + edge.variance.x_m2 +
                                     edge.variance.y_m2 + edge.variance.z_m2 +
                                     uncertainties_[n].rotation_rad2 * step_m2;
}

}  // namespace alces
