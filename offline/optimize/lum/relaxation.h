// Global relaxation of all poses: LUM (Appendix A.2 of the paper; Lu and Milios 1997; Borrmann et al. 2008).
//
// An iteration: links between scans that are near, correspondences of each at the poses as they are, normal
// equations B X = A of all poses, poses moved by X, the distance limit of correspondences shrunk. Scan 0
// stays. Once the limit is at its last value the links stay the same too, and the relaxation ends when poses
// change by less than mean_change_m in the mean.
//
// What goes beyond the paper, each a setting: residuals along normals; residuals far above the others count
// little; a link that pulls against all others is given little weight, and named. Scans that no
// correspondences bind to the scans before them keep the relative pose that the map had ("bridges"), so that
// a drive that falls in two stays one map.
//
// The same sums in, the same poses out, bit for bit: everything but the sums runs on one thread.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "link_sum_source.h"
#include "links.h"
#include "offline/optimize/graph/constraint_graph.h"
#include "settings.h"

namespace alces::offline {

/// Where the relaxation stands between two iterations: all that the next one depends on.
struct LumState {
  std::uint32_t iterations = 0;  ///< done
  float distance_limit_m = 0;    ///< of the next one
  bool is_converged = false;
  std::vector<ScanLink> links;  ///< once they stay the same; empty before
  std::vector<Pose> map_from_scan;
};

struct LumIteration {
  std::uint32_t number = 0;  ///< from 1
  float distance_limit_m = 0;
  bool is_fine = false;  ///< all samples, the last distance limit
  std::size_t links = 0;
  std::size_t usable = 0;      ///< with enough correspondences
  std::size_t bridges = 0;     ///< scans held to the one before them by the map's poses alone
  std::size_t distrusted = 0;  ///< links that count less than half
  double median_rms_m = 0;     ///< over the usable links, of what is minimised
  double mean_change_m = 0;
  double most_change_m = 0;
  double mean_change_rad = 0;
  double link_change_m = 0;  ///< mean over the usable links: of the one scan against the other, at the middle
};

/// What became of a link in the last iteration.
struct LinkOutcome {
  ScanLink link;
  bool is_bridge = false;
  bool is_usable = false;
  double weight = 1;  ///< of its information, by the switch; below 0.5: distrusted
  std::uint32_t correspondences = 0;
  double overlap = 0;
  LinkEstimate estimate;
};

class Relaxation {
 public:
  /// From the poses of a map. `sums` outlives it.
  Relaxation(std::vector<Pose> map_from_scan, const LumSettings& settings, LinkSumSource& sums);

  /// Goes on where `state` was; as many poses as before.
  void resume(LumState state) { state_ = std::move(state); }

  /// Nothing left to do: converged, or maximum_iterations.
  [[nodiscard]] bool is_done() const;
  LumIteration iterate(const LinkSumSource::Progress& progress = {});

  [[nodiscard]] const LumState& state() const { return state_; }
  /// Of the last iterate(), in the order of the links, bridges at the end.
  [[nodiscard]] const std::vector<LinkOutcome>& outcomes() const { return outcomes_; }

  /// Sums once more at the poses as they are, moves nothing: for outcomes() after a resume.
  void look(const LinkSumSource::Progress& progress = {});

  /// C_X of each pose from the last equations: of (translation in map axes, rotation vector in map axes about
  /// the scan's place), m and rad, zero for scan 0. Correspondences count as independent, as in the paper.
  [[nodiscard]] std::vector<Matrix6d> covariances() const;

  /// The links as measurements with their information, for other optimisers: what each link alone asks for.
  [[nodiscard]] ConstraintGraph link_graph() const;

 private:
  LumIteration assess(const LinkSumSource::Progress& progress);
  [[nodiscard]] bool solve(std::vector<Vector6d>& changes) const;

  LumSettings settings_;
  LinkSumSource& sums_;
  std::vector<Pose> first_poses_;
  LumState state_;
  std::vector<LinkOutcome> outcomes_;
  std::vector<Pose> outcome_poses_;  // that outcomes_ speak of
};

}  // namespace alces::offline
