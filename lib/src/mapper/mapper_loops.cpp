// Mapper: what becomes of a loop that was detected: matched, judged, shared out (paper, sections 3.3 to 3.6).
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "alces/mapper.h"
#include "alces/portable_math.h"
#include "alces/symmetric_eigen.h"

namespace alces {
namespace {

bool is_found(const IcpResult& match) {
  return match.verdict == IcpVerdict::converged || match.verdict == IcpVerdict::iteration_limit;
}

// The less the map knows, the more places there are that l may be at, and the more of them look alike: a
// given correction becomes less likely with the volume of the uncertainty. Its logarithm, in units of the
// squared Mahalanobis length; places within a metre of each other are one, and no
// more are offered than lie in the detector's reach.
double log_places(const Matrix6d& uncertainty, double reach_m) {
  const Eigen::Matrix3d place_m2 = uncertainty.topLeftCorner<3, 3>();
  double sum = 0;
  for (const double axis_m2 : symmetric_eigen<3>(place_m2).values)
    if (axis_m2 > 1) sum += portable::logarithm(axis_m2);
  return std::min(sum, 2 * portable::logarithm(std::max(1.0, reach_m * reach_m)));
}

// How far a correction moves what scan l sees: a turn moves it, too, by its lever.
double moved_m(const LoopReport& loop) {
  constexpr double lever_m = 15;  // from the scanner to what decides a match
  return loop.correction_m + lever_m * loop.correction_rad;
}

}  // namespace

const char* to_string(LoopVerdict verdict) {
  switch (verdict) {
    case LoopVerdict::closed:
      return "closed";
    case LoopVerdict::known:
      return "not needed: the map knows it as well";
    case LoopVerdict::refused_no_match:
      return "refused: the metascans do not come together";
    case LoopVerdict::refused_overlap:
      return "refused: too little overlap";
    case LoopVerdict::refused_residual:
      return "refused: the residuals are too large";
    case LoopVerdict::refused_walls:
      return "refused: too few walls fit";
    case LoopVerdict::refused_fit:
      return "refused: the surfaces fit worse than is usual";
    case LoopVerdict::refused_ambiguous:
      return "refused: the surfaces fit as well elsewhere along a direction that the map does not hold";
    case LoopVerdict::refused_free_space:
      return "refused: surfaces would stand where the other end looked through";
    case LoopVerdict::refused_needless:
      return "refused: nothing that is seen speaks for so large a correction";
    case LoopVerdict::refused_implausible:
      return "refused: the correction is larger than the accumulated uncertainty explains";
    case LoopVerdict::refused_capacity:
      return "refused: no room for another edge";
    case LoopVerdict::refused_archive:
      return "refused: a scan could not be brought back";
  }
  return "unknown verdict";
}

Status Mapper::offer_loop(std::uint32_t first, std::uint32_t last, LoopReport& loop) {
  if (first >= last || last >= scan_count()) return Status::no_such_scan;
  StageTimes times;
  const double distance_m = (graph_.poses()[first].translation_m - graph_.poses()[last].translation_m).norm();
  close_loop({first, last, distance_m}, 1, loop, times);
  return Status::ok;
}

void Mapper::close_loop(LoopTrigger::Loop candidate, std::uint32_t tries, LoopReport& loop,
                        StageTimes& times) {
  for (std::uint32_t attempt = 0; attempt < tries; ++attempt) {
    loop = LoopReport{};
    loop.first = candidate.first;
    loop.last = candidate.last;
    loop.distance_m = candidate.distance_m;
    judge_loop(candidate, tries > 1 || config_.loop_search.candidates == 1, loop, times);
    if (loop.verdict == LoopVerdict::known) {
      ++counters_.loops_known;
      return;
    }
    ++counters_.loops_offered;
    if (loop.verdict == LoopVerdict::closed) ++counters_.loops_closed;
    if (loop_count_ < loops_.size()) {
      loops_[loop_count_++] = loop;
    } else {
      ++counters_.loops_not_listed;
    }
    const bool came_together =
        loop.verdict != LoopVerdict::refused_no_match && loop.verdict != LoopVerdict::refused_overlap &&
        loop.verdict != LoopVerdict::refused_residual && loop.verdict != LoopVerdict::refused_walls &&
        loop.verdict != LoopVerdict::refused_fit && loop.verdict != LoopVerdict::refused_free_space &&
        loop.verdict != LoopVerdict::refused_needless;
    if (came_together) return;
    // The pose has drifted: perhaps the nearest scan is of another street. An earlier visit may be the right
    // one.
    const Eigen::Vector3d place_m = graph_.poses()[candidate.last].translation_m;
    const std::optional<LoopDetector::Nearby> earlier =
        detector_.nearest(place_m, candidate.first, std::sqrt(uncertainties_[candidate.last].translation_m2));
    if (!earlier) return;
    candidate.first = earlier->scan;
    candidate.distance_m = earlier->distance_m;
  }
}

IcpResult Mapper::match_loop(std::span<const IcpScan> model, std::span<const IcpScan> data,
                             const IcpPrior& prior, const IcpConfig& config,
                             const Eigen::Quaterniond& map_from_f) {
  const IcpPrior* const used = config_.use_motion_prior ? &prior : nullptr;
  const IcpResult straight = icp_.match(model, data, prior.model_from_data, config, used);
  const bool is_sure = is_found(straight) && straight.overlap >= config_.loop_search.sure_overlap &&
                       straight.balanced_fit >= config_.loop_search.sure_fit_share * usual_fit_.fit();
  const IcpResult best = is_sure || !config_.search_steps
                             ? straight
                             : match_searched(model, data, prior, config, map_from_f, straight);
  // Where what lies across is taken for outliers altogether, the direction along is undetermined.
  const bool may_have_slid = is_found(best) || best.verdict == IcpVerdict::degenerate;
  return may_have_slid ? match_shifted(model, data, config, used, best) : best;
}

// Other starts, as far around as the map can be off.
IcpResult Mapper::match_searched(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                 const IcpPrior& prior, const IcpConfig& config,
                                 const Eigen::Quaterniond& map_from_f, const IcpResult& straight) {
  const double off_m = std::sqrt(prior.covariance.topLeftCorner<2, 2>().trace());
  const double off_rad = std::sqrt(prior.covariance(5, 5));
  StartSearchConfig around = config_.start_search;
  around.reach_m = std::clamp(static_cast<float>(3 * off_m), 2 * around.cell_m, around.reach_m);
  const double turn_rad = std::clamp(3 * off_rad, 0.2, std::numbers::pi);
  std::array<Start, StartSearch::most_starts> room;
  const std::uint32_t found = start_search_.find(model, data.last(1), prior.model_from_data, map_from_f,
                                                 static_cast<float>(turn_rad), around, room);
  // They are tried with scan l alone and few iterations, as the place where the match came to rest is; the
  // best of them is matched in full.
  const IcpPrior* const used = config_.use_motion_prior ? &prior : nullptr;
  IcpResult best;
  const Start straight_start{straight.model_from_data, 1};
  (void)try_starts(model, data.back(), {&straight_start, 1}, 0, config, used, best);
  return try_starts(model, data.back(), std::span(room).first(found), config_.start_search.gain, config, used,
                    best)
             ? icp_.match(model, data, best.model_from_data, config, used)
             : straight;
}

IcpResult Mapper::match_shifted(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                const IcpConfig& config, const IcpPrior* prior, const IcpResult& match) {
  const LoopSearchConfig& search = config_.loop_search;
  if (search.shift_steps == 0) return match;
  const Eigen::Matrix3d information = match.information.topLeftCorner<3, 3>();
  const Eigen::Vector3d weakest = symmetric_eigen<3>(information).vectors.col(0);
  // As with turns: scan l alone, few iterations, the best of them in full.
  const std::span<const IcpScan> scan_l = data.last(1);
  std::array<double, 3> shifts_m;
  const std::uint32_t shift_count =
      icp_.likely_shifts(model, scan_l, match.model_from_data, weakest, search.shift_step_m,
                         search.shift_steps, config, shifts_m);
  if (shift_count == 0) return match;

  constexpr float near_m = 1.0F;  // a likely shift is off by no more than a fit
  IcpConfig near = config;
  near.first_distance_limit_m = std::max(near.last_distance_limit_m, near_m);
  IcpConfig quick = near;
  quick.maximum_iterations = search.iterations;
  quick.finish_iterations = 0;
  IcpConfig where_it_is = config;
  where_it_is.first_distance_limit_m = where_it_is.last_distance_limit_m;
  where_it_is.maximum_iterations = 1;
  IcpResult best = icp_.match(model, scan_l, match.model_from_data, where_it_is, prior);
  bool is_shifted = false;
  for (const double shift_m : std::span(shifts_m).first(shift_count)) {
    Pose shifted = match.model_from_data;
    shifted.translation_m += shift_m * weakest;
    const IcpResult next = icp_.match(model, scan_l, shifted, quick, prior);
    if (!is_found(next) || next.fit < best.fit + search.shift_gain) continue;
    best = next;
    is_shifted = true;
  }
  return is_shifted ? icp_.match(model, data, best.model_from_data, near, prior) : match;
}

double Mapper::wall_fit(std::span<const IcpScan> model, const IcpScan& scan_l, const IcpResult& match) {
  const Eigen::Matrix3d information = match.information.topLeftCorner<3, 3>();
  const SymmetricEigen<3> directions = symmetric_eigen<3>(information);
  FacingFit both;
  for (const int weaker : {0, 1}) {
    const FacingFit fit = icp_.facing_fit(model, {&scan_l, 1}, match.model_from_data,
                                          directions.vectors.col(weaker), config_.loop_match);
    both.samples += fit.samples;
    both.fitting += fit.fitting;
  }
  return both.samples == 0 ? 0.0 : static_cast<double>(both.fitting) / both.samples;
}

// Both ends in turn look at the other's surfaces, where the map has them and where the match has them; and at
// those of the scan after and before, which tells what is usual there.
void Mapper::look_through(std::uint32_t f, std::uint32_t l, const Pose& f_from_matched, float tolerance_m,
                          LoopReport& loop) {
  const std::span<const Pose> poses = graph_.poses();
  const Pose f_from_l = poses[f].inverse() * poses[l];
  const auto look = [&](std::uint32_t viewer, std::uint32_t other, std::uint32_t neighbor,
                        const Pose& viewer_from_before, const Pose& viewer_from_after) {
    StoredScan seen;
    if (store_.load(viewer, seen) != Status::ok) return;
    free_space_.look(*seen.tree);
    if (store_.load(other, seen) != Status::ok) return;
    loop.before.add(free_space_.count(*seen.tree, seen.samples, viewer_from_before, tolerance_m));
    loop.after.add(free_space_.count(*seen.tree, seen.samples, viewer_from_after, tolerance_m));
    if (store_.load(neighbor, seen) != Status::ok) return;
    const Pose viewer_from_neighbor = poses[viewer].inverse() * poses[neighbor];
    loop.usual.add(free_space_.count(*seen.tree, seen.samples, viewer_from_neighbor, tolerance_m));
  };
  look(f, l, f + 1, f_from_l, f_from_matched);
  look(l, f, l - 1, f_from_l.inverse(), f_from_matched.inverse());
}

// Whether the scans fit as well elsewhere along the two weaker directions of the match, as far as the map can
// be off: along a corridor, on a field, at the next pillar.
bool Mapper::is_ambiguous(std::span<const IcpScan> model, std::span<const IcpScan> data,
                          const IcpPrior& prior, const IcpResult& match, const IcpConfig& config) {
  const Eigen::Matrix3d information = match.information.topLeftCorner<3, 3>();
  const SymmetricEigen<3> directions = symmetric_eigen<3>(information);
  const Eigen::Matrix3d doubt_m2 = prior.covariance.topLeftCorner<3, 3>();
  const Eigen::Vector3d back_m = prior.model_from_data.translation_m - match.model_from_data.translation_m;
  for (const int weaker : {0, 1}) {
    const Eigen::Vector3d direction = directions.vectors.col(weaker);
    const double reach_m =
        config_.loop_verification.ambiguity_sigmas * std::sqrt(direction.dot(doubt_m2 * direction));
    const double middle_m = direction.dot(back_m);
    if (!icp_.is_held(model, data, match.model_from_data, direction, middle_m - reach_m, middle_m + reach_m,
                      config))
      return true;
  }
  return false;
}

// A loop is worth an edge where the map can be off by more than this. While loops are used up faster than
// scans, only larger doubts are, the larger the fewer loops are left, so that loops last as long as the scans
// do.
double Mapper::known_m() const {
  const double loops_used =
      static_cast<double>(counters_.loops_closed) / std::max<std::uint32_t>(1, config_.loop_capacity);
  const double scans_used = static_cast<double>(scan_count()) / config_.scan_capacity;
  constexpr double reserve = 0.05;    // of the loops, that may be used early
  constexpr double m_per_share = 10;  // a tenth too many: a metre
  const double left = std::max(1e-6, 1 - loops_used);
  return config_.loop_verification.known_m +
         m_per_share * std::max(0.0, loops_used - scans_used - reserve) / left;
}

// Whether the two ends came together: closed, or why not.
LoopVerdict Mapper::judge_fit(const IcpResult& match, const LoopReport& loop) const {
  const LoopVerification& thresholds = config_.loop_verification;
  if (!is_found(match)) return LoopVerdict::refused_no_match;
  if (match.overlap < thresholds.minimum_overlap) return LoopVerdict::refused_overlap;
  if (match.rms_m > thresholds.maximum_rms_m) return LoopVerdict::refused_residual;
  if (moved_m(loop) <= thresholds.small_correction_m) return LoopVerdict::closed;
  if (loop.wall_fit < thresholds.minimum_wall_fit) return LoopVerdict::refused_walls;
  if (loop.fit < thresholds.minimum_fit_share * loop.usual_fit) return LoopVerdict::refused_fit;
  return LoopVerdict::closed;
}

void Mapper::judge_loop(const LoopTrigger::Loop& candidate, bool may_skip_known, LoopReport& loop,
                        StageTimes& times) {
  const std::uint32_t f = candidate.first;
  const std::uint32_t l = candidate.last;
  const Pose map_from_f = graph_.poses()[f];
  const Pose map_from_l = graph_.poses()[l];

  // Dissociated: l and the scans just before it move as one body, whatever they were matched to before.
  const std::uint64_t begin_ns = now_ns();
  const std::uint32_t data_begin = std::max(l - std::min(l, config_.scans_before_last), f + 1);
  const std::uint32_t model_begin = f - std::min(f, config_.scans_around_first);
  const std::uint32_t model_end = std::min(f + config_.scans_around_first + 1, data_begin);
  std::array<IcpScan, maximum_metascan> model;
  std::array<IcpScan, maximum_metascan> data;
  std::uint32_t model_count = 0;
  std::uint32_t data_count = 0;
  StoredScan scan_l;
  if (!load_metascan(model_begin, model_end, map_from_f, model, model_count) ||
      !load_metascan(data_begin, l + 1, map_from_l, data, data_count) ||
      store_.load(l, scan_l) != Status::ok) {
    loop.verdict = LoopVerdict::refused_archive;
    return;
  }
  if (correction_.prepare(graph_, f, l) != Status::ok) {
    loop.verdict = LoopVerdict::refused_capacity;
    return;
  }
  const Matrix6d uncertainty = correction_.covariance(graph_);
  Matrix6d f_from_map = Matrix6d::Zero();
  f_from_map.topLeftCorner<3, 3>() = map_from_f.rotation.conjugate().toRotationMatrix();
  f_from_map.bottomRightCorner<3, 3>() = f_from_map.topLeftCorner<3, 3>();
  const IcpPrior prior{map_from_f.inverse() * map_from_l, f_from_map * uncertainty * f_from_map.transpose()};
  loop.expected_m = std::sqrt(uncertainty.topLeftCorner<3, 3>().trace());
  if (may_skip_known && loop.expected_m < known_m()) {
    loop.verdict = LoopVerdict::known;
    return;
  }
  IcpConfig config = config_.loop_match;
  config.last_distance_limit_m =
      std::max(config.last_distance_limit_m, config_.pair_reach * scan_l.spacing.typical_m);
  config.first_distance_limit_m = std::max(config.first_distance_limit_m, config.last_distance_limit_m);
  const IcpResult match = match_loop(std::span(model).first(model_count), std::span(data).first(data_count),
                                     prior, config, map_from_f.rotation);
  times.loop_match_ns += now_ns() - begin_ns;
  loop.overlap = match.overlap;
  loop.rms_m = match.rms_m;
  loop.fit = match.balanced_fit;
  loop.usual_fit = usual_fit_.fit();
  loop.iterations = match.iterations;
  const Pose map_from_matched = map_from_f * match.model_from_data;
  loop.correction_m = (map_from_matched.translation_m - map_from_l.translation_m).norm();
  loop.correction_rad = angle_between_rad(map_from_matched.rotation, map_from_l.rotation);
  if (is_found(match))
    loop.wall_fit = wall_fit(std::span(model).first(model_count), data[data_count - 1], match);
  loop.verdict = judge_fit(match, loop);
  if (loop.verdict != LoopVerdict::closed) {
    if (config_.loop_verification.free_space_sigmas > 0) {
      look_through(f, l, match.model_from_data, config.last_distance_limit_m, loop);
      loop.lies_apart = lies_apart(loop.before, loop.usual, config_.loop_verification.free_space_sigmas);
    }
    return;
  }
  if (config_.loop_verification.free_space_sigmas > 0 &&
      moved_m(loop) > config_.loop_verification.small_correction_m) {
    const double sigmas = config_.loop_verification.free_space_sigmas;
    look_through(f, l, match.model_from_data, config.last_distance_limit_m, loop);
    if (is_clearly_more(loop.after, loop.usual, sigmas)) {
      loop.verdict = LoopVerdict::refused_free_space;
      return;
    }
    // Nearer than that both places are the same to it. A part of the map that hangs on nothing lies anywhere.
    const double visible_m = 2 * static_cast<double>(config.last_distance_limit_m);
    const bool hangs_together =
        std::ranges::none_of(steps_.subspan(f + 1, l - f),
                             [](const StepRecord& step) { return step.verdict == StepVerdict::apart; });
    if (hangs_together && loop.correction_m > visible_m &&
        !is_clearly_more(loop.before, loop.after, sigmas)) {
      loop.verdict = LoopVerdict::refused_needless;
      return;
    }
  }
  if (config_.loop_verification.ambiguity_sigmas > 0 &&
      is_ambiguous(std::span(model).first(model_count), std::span(data).first(data_count), prior, match,
                   config)) {
    loop.verdict = LoopVerdict::refused_ambiguous;
    return;
  }
  if (counters_.loops_closed == config_.loop_capacity) {
    loop.verdict = LoopVerdict::refused_capacity;
    return;
  }

  const std::uint64_t matched_ns = now_ns();
  const EdgeVariance variance = match_variance(match, nullptr);
  loop.mahalanobis2 = correction_.mahalanobis2(graph_, map_from_matched, variance);
  const double look_alikes = config_.loop_verification.ambiguity_sigmas > 0
                                 ? log_places(uncertainty, config_.detector.radius_cap_m)
                                 : 0.0;
  // So that the second yard of two (23 and 9) stays out, and a real turn among trees (37 and 0) comes in.
  constexpr double look_alike_weight = 3;
  if (!(loop.mahalanobis2 + look_alike_weight * look_alikes <=
        config_.loop_verification.maximum_mahalanobis2)) {
    loop.verdict = LoopVerdict::refused_implausible;
    return;
  }
  Edge edge;
  edge.from = f;
  edge.to = l;
  edge.closes_loop = true;
  edge.from_from_to = match.model_from_data;
  edge.variance = variance;
  // LOA's time begins with its decomposition; another back end uses that for verification alone.
  const std::uint64_t bend_ns = relaxation_ == nullptr ? matched_ns : now_ns();
  if (bend(edge, map_from_matched) != Status::ok) {
    loop.verdict = LoopVerdict::refused_no_match;
    return;
  }
  (void)detector_.rebuild(graph_.poses());
  for (std::uint32_t i = l; i < scan_count(); ++i) {  // l is again as sure as f
    const PoseUncertainty grown{uncertainties_[i].translation_m2 - uncertainties_[l].translation_m2,
                                uncertainties_[i].rotation_rad2 - uncertainties_[l].rotation_rad2};
    if (i > l)
      uncertainties_[i] = {uncertainties_[f].translation_m2 + grown.translation_m2,
                           uncertainties_[f].rotation_rad2 + grown.rotation_rad2};
  }
  uncertainties_[l] = uncertainties_[f];
  for (std::uint32_t scan = f + 1; scan <= l; ++scan) {  // both sides of a break hang together now
    steps_[scan].is_spanned = true;
    if (steps_[scan].verdict == StepVerdict::apart) steps_[scan].verdict = StepVerdict::rejoined;
    if (steps_[scan].verdict == StepVerdict::against_odometry) steps_[scan].verdict = StepVerdict::found;
  }
  loop.share_ns = now_ns() - bend_ns;
  times.loop_share_ns += loop.share_ns;
  loop.verdict = LoopVerdict::closed;
}

// After correction_.prepare(), which knows the graph as it was before the edge. An error leaves the map as it
// was.
Status Mapper::bend(const Edge& edge, const Pose& map_from_l) {
  const Status checked = is_valid(map_from_l) ? graph_.check_edge(edge) : Status::bad_pose;
  if (checked != Status::ok) return checked;
  if (relaxation_ != nullptr) {
    const Status added = graph_.add_edge(edge);
    if (added != Status::ok) return added;
    if (relaxation_->relax(graph_, graph_.poses())) return Status::ok;
    ++counters_.loops_not_relaxed;
    return correction_.share(graph_, map_from_l, config_.correction_rule);
  }
  const Status shared = correction_.share(graph_, map_from_l, config_.correction_rule);
  return shared == Status::ok ? graph_.add_edge(edge) : shared;
}

}  // namespace alces
