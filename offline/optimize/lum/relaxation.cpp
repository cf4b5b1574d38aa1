#include "relaxation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "block_equations.h"
#include "offline/evaluate/evaluation.h"

namespace alces::offline {
namespace {

// A bridge is as sure as odometry over a stretch between two scans.
constexpr double bridge_m = 0.2;
constexpr double bridge_rad = 0.02;

Matrix6d diagonal_information(double deviation_m, double deviation_rad) {
  Vector6d diagonal;
  diagonal.head<3>().setConstant(1 / (deviation_m * deviation_m));
  diagonal.tail<3>().setConstant(1 / (deviation_rad * deviation_rad));
  return diagonal.asDiagonal();
}

// Moves a pose by a change about its own place, in map axes.
Pose moved(const Pose& map_from_body, const Vector6d& change) {
  return {(exp_so3(change.tail<3>()) * map_from_body.rotation).normalized(),
          map_from_body.translation_m + change.head<3>()};
}

// The change that takes a pose to `target`.
Vector6d change_to(const Pose& map_from_body, const Pose& target) {
  Vector6d change;
  change << target.translation_m - map_from_body.translation_m,
      log_so3(target.rotation * map_from_body.rotation.conjugate());
  return change;
}

class Parts {
 public:
  explicit Parts(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t part_of(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) {
    parent_[std::max(part_of(a), part_of(b))] = std::min(part_of(a), part_of(b));
  }

 private:
  std::vector<std::size_t> parent_;
};

void fill(BlockEquations& equations, const std::vector<LinkOutcome>& outcomes,
          std::span<const Pose> map_from_scan) {
  for (const LinkOutcome& outcome : outcomes) {
    if (!outcome.is_usable) continue;
    const auto [j, k] = outcome.link;
    const Eigen::Vector3d middle = middle_of(map_from_scan[j], map_from_scan[k]);
    equations.add_link(
        j, middle_from_change(map_from_scan[j], middle), k, middle_from_change(map_from_scan[k], middle),
        outcome.weight * outcome.estimate.information, outcome.weight * outcome.estimate.right_side);
  }
}

}  // namespace

Relaxation::Relaxation(std::vector<Pose> map_from_scan, const LumSettings& settings, LinkSumSource& sums)
    : settings_(settings), sums_(sums), first_poses_(map_from_scan) {
  state_.map_from_scan = std::move(map_from_scan);
  state_.distance_limit_m = std::max(settings.first_distance_limit_m, settings.last_distance_limit_m);
}

bool Relaxation::is_done() const {
  return state_.is_converged || state_.iterations >= settings_.maximum_iterations ||
         state_.map_from_scan.size() < 2;
}

LumIteration Relaxation::assess(const LinkSumSource::Progress& progress) {
  const std::vector<Pose>& poses = state_.map_from_scan;
  LumIteration iteration;
  iteration.number = state_.iterations + 1;
  iteration.distance_limit_m = state_.distance_limit_m;
  iteration.is_fine = state_.distance_limit_m <= settings_.last_distance_limit_m;
  const LinkPass pass{state_.distance_limit_m, settings_.robust_share * state_.distance_limit_m,
                      iteration.is_fine ? 1 : std::max<std::uint32_t>(1, settings_.coarse_stride)};
  if (state_.links.empty() || !iteration.is_fine) state_.links = find_links(poses, settings_);
  const std::vector<ScanLink>& links = state_.links;
  std::vector<LinkSums> sums(links.size());
  sums_.sum(links, poses, pass, sums, progress);

  outcomes_.assign(links.size(), {});
  outcome_poses_ = poses;
  std::vector<double> pulls_m;
  std::vector<double> rms_m;
  Parts parts(poses.size());
  for (std::size_t i = 0; i < links.size(); ++i) {
    LinkOutcome& outcome = outcomes_[i];
    outcome.link = links[i];
    outcome.estimate = estimate_link(sums[i], settings_, pass.stride);
    outcome.is_usable = outcome.estimate.is_usable;
    outcome.correspondences = sums[i].correspondences;
    outcome.overlap = sums[i].overlap();
    if (!outcome.is_usable) continue;
    parts.join(links[i].j, links[i].k);
    pulls_m.push_back(outcome.estimate.pull_m);
    rms_m.push_back(outcome.estimate.rms_m);
  }
  iteration.links = links.size();
  iteration.usable = pulls_m.size();
  iteration.median_rms_m = median(rms_m);

  if (settings_.switches_links && iteration.is_fine) {
    const double bound_m = std::max(settings_.switch_least_m, settings_.switch_factor * median(pulls_m));
    const double bound_m2 = bound_m * bound_m;
    for (LinkOutcome& outcome : outcomes_) {
      if (!outcome.is_usable) continue;
      const double pull_m2 = outcome.estimate.pull_m * outcome.estimate.pull_m;
      const double scale = std::min(1.0, 2 * bound_m2 / (bound_m2 + pull_m2));
      outcome.weight = scale * scale;
      if (outcome.weight < 0.5) ++iteration.distrusted;
    }
  }

  for (std::uint32_t j = 1; j < poses.size(); ++j) {
    if (parts.part_of(j) == parts.part_of(j - 1)) continue;
    parts.join(j, j - 1);
    LinkOutcome bridge;
    bridge.link = {j, j - 1};
    bridge.is_bridge = bridge.is_usable = true;
    const Pose wanted = poses[j - 1] * (first_poses_[j - 1].inverse() * first_poses_[j]);
    bridge.estimate.is_usable = true;
    bridge.estimate.offset =
        middle_from_change(poses[j], middle_of(poses[j], poses[j - 1])) * change_to(poses[j], wanted);
    bridge.estimate.information = diagonal_information(bridge_m, bridge_rad);
    bridge.estimate.right_side = bridge.estimate.information * bridge.estimate.offset;
    outcomes_.push_back(bridge);
    ++iteration.bridges;
  }
  return iteration;
}

bool Relaxation::solve(std::vector<Vector6d>& changes) const {
  // The weakest of holds for what correspondences leave open (a corridor's length): first next to nothing,
  // then enough for rounding.
  for (const double deviation_m : {100.0, 1.0}) {
    BlockEquations equations(state_.map_from_scan.size());
    equations.hold(0);
    for (std::size_t i = 1; i < state_.map_from_scan.size(); ++i)
      equations.add_prior(i, diagonal_information(deviation_m, 0.1 * deviation_m));
    fill(equations, outcomes_, state_.map_from_scan);
    if (equations.solve(changes)) return true;
  }
  return false;
}

LumIteration Relaxation::iterate(const LinkSumSource::Progress& progress) {
  LumIteration iteration = assess(progress);
  std::vector<Vector6d> changes;
  if (!solve(changes))
    throw std::runtime_error(
        fmt::format("the poses' equations have no solution in iteration {}", iteration.number));
  for (const LinkOutcome& outcome : outcomes_) {
    if (!outcome.is_usable || outcome.is_bridge) continue;
    const auto [j, k] = outcome.link;
    const Eigen::Vector3d middle = middle_of(outcome_poses_[j], outcome_poses_[k]);
    const Vector6d apart = middle_from_change(outcome_poses_[j], middle) * changes[j] -
                           middle_from_change(outcome_poses_[k], middle) * changes[k];
    iteration.link_change_m += apart.head<3>().norm() / static_cast<double>(iteration.usable);
  }
  const auto count = static_cast<double>(changes.size());
  for (std::size_t i = 0; i < changes.size(); ++i) {
    state_.map_from_scan[i] = moved(state_.map_from_scan[i], changes[i]);
    const double change_m = changes[i].head<3>().norm();
    iteration.mean_change_m += change_m / count;
    iteration.most_change_m = std::max(iteration.most_change_m, change_m);
    iteration.mean_change_rad += changes[i].tail<3>().norm() / count;
  }
  ++state_.iterations;
  state_.is_converged = iteration.is_fine && (iteration.mean_change_m < settings_.mean_change_m ||
                                              iteration.link_change_m < settings_.link_change_m);
  if (!iteration.is_fine) {
    state_.links.clear();  // found anew at the new poses
    state_.distance_limit_m =
        std::max(settings_.last_distance_limit_m, state_.distance_limit_m * settings_.limit_factor);
  }
  return iteration;
}

void Relaxation::look(const LinkSumSource::Progress& progress) {
  (void)assess(progress);
}

std::vector<Matrix6d> Relaxation::covariances() const {
  BlockEquations equations(outcome_poses_.size());
  if (outcome_poses_.empty()) return {};
  equations.hold(0);
  fill(equations, outcomes_, outcome_poses_);
  std::vector<Vector6d> changes;
  if (!equations.solve(changes)) {  // a direction is open: give it the deviation of the weakest hold
    BlockEquations held(outcome_poses_.size());
    held.hold(0);
    for (std::size_t i = 1; i < outcome_poses_.size(); ++i) held.add_prior(i, diagonal_information(100, 10));
    fill(held, outcomes_, outcome_poses_);
    if (!held.solve(changes)) return std::vector<Matrix6d>(outcome_poses_.size(), Matrix6d::Zero());
    return held.covariances();
  }
  return equations.covariances();
}

ConstraintGraph Relaxation::link_graph() const {
  ConstraintGraph graph;
  for (std::size_t i = 0; i < state_.map_from_scan.size(); ++i)
    graph.vertices.push_back({static_cast<std::int64_t>(i), state_.map_from_scan[i], i == 0});
  for (const LinkOutcome& outcome : outcomes_) {
    if (!outcome.is_usable) continue;
    const Pose& map_from_j = outcome_poses_[outcome.link.j];
    const Pose& map_from_k = outcome_poses_[outcome.link.k];
    const Matrix6d h = middle_from_change(map_from_j, middle_of(map_from_j, map_from_k));
    // h takes a change about j's place to the middle; its inverse differs in the sign of the lever alone.
    Matrix6d back = h;
    back.topRightCorner<3, 3>() *= -1;
    // g2o's error is (t, vector part of q) in the axes of j: a change of it, seen from the map.
    Matrix6d change_from_error = Matrix6d::Zero();
    change_from_error.topLeftCorner<3, 3>() = map_from_j.rotation.toRotationMatrix();
    change_from_error.bottomRightCorner<3, 3>() = 2 * change_from_error.topLeftCorner<3, 3>();
    const Matrix6d middle_from_error = h * change_from_error;
    Constraint constraint;
    constraint.from = outcome.link.k;
    constraint.to = outcome.link.j;
    constraint.from_from_to = map_from_k.inverse() * moved(map_from_j, back * outcome.estimate.offset);
    constraint.information =
        middle_from_error.transpose() * (outcome.weight * outcome.estimate.information) * middle_from_error;
    graph.constraints.push_back(constraint);
  }
  return graph;
}

}  // namespace alces::offline
