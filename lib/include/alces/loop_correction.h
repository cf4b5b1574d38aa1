// Shares the offset of a closed loop out over all poses (paper, sections 3.4 to 3.6 and appendix B).
//
// Two rules:
//
// - paper: four LOA runs weigh every vertex per axis and in rotation; each pose moves by its share of the one
//   offset, seen from f (translation linear, rotation by slerp). Simple, but a pose far from f is swung on a
//   long lever, which bends the map between neighbours.
//
// - trails (default): one LOA run takes the graph apart into trails; along each trail the error goes into the
//   edges where it most likely arose: the maximum-likelihood correction of a chain whose ends are known, in
//   closed form (one 6x6 system a trail). Rotation put into an edge turns what follows about that edge, as
//   drift did. Where every pose is in several loops trails are a few edges long and such turns swing what
//   hangs on them: a loop for which a pose would turn further than the offset can ask for (its own rotation,
//   and a degree for each metre of translation) is shared out by the paper's rule.
//
// With both, scan 0 stays where it was, P_f^-1 P_l becomes what was matched, branches follow rigidly, and
// vertices that are not connected to the loop stay. Neither depends on where the map lies or how it is
// turned: edges' variances are given along the axes of their scans, and the paper's rule weighs along those
// of f.
//
// Cost: O(n) poses beside LOA. Memory: LOA's, and 96 bytes a vertex.
#pragma once

#include <cstdint>
#include <span>

#include "alces/arena.h"
#include "alces/loop_optimizer.h"
#include "alces/pose_graph.h"
#include "alces/status.h"

namespace alces {

enum class CorrectionRule : std::uint8_t { trails, paper };

class LoopCorrection {
 public:
  constexpr LoopCorrection(Arena& arena, const PoseGraph::Capacity& capacity)
      : optimizer_(arena, capacity), bent_(arena.allocate<Pose>(capacity.vertices)) {
    for (std::span<double>& weights : weights_) weights = arena.allocate<double>(capacity.vertices);
  }

  /// Takes the graph apart for the loop f..l. Errors are LoopOptimizer::prepare's.
  [[nodiscard]] Status prepare(const PoseGraph& graph, std::uint32_t f, std::uint32_t l);

  /// Covariance of (place m, rotation vector rad) of l as seen from f, axes of the map: what the edges of the
  /// shortest way from f to l can be off by. After prepare(). O(edges of that way).
  [[nodiscard]] Matrix6d covariance(const PoseGraph& graph) const;

  /// How well the uncertainty accumulated along the shortest way from f to l, and that of the match itself,
  /// explain that l really lies at `map_from_l`: the squared Mahalanobis length of the correction, 6 degrees
  /// of freedom; infinite where the way's edges leave a direction without any. After prepare(). As
  /// covariance().
  [[nodiscard]] double mahalanobis2(const PoseGraph& graph, const Pose& map_from_l,
                                    const EdgeVariance& match) const;

  /// Bends all poses so that l lies at `map_from_l` as seen from f. After prepare(), with the graph
  /// unchanged. O(n). disconnected (nothing is prepared), bad_pose; then nothing has moved.
  [[nodiscard]] Status share(PoseGraph& graph, const Pose& map_from_l, CorrectionRule rule);

 private:
  [[nodiscard]] Status share_as_the_paper(std::span<const Pose> poses, const Pose& map_from_l);
  void share_along_trails(const PoseGraph& graph, const Pose& map_from_l);
  /// Whether trails in bent_ turned a pose further than the offset can ask for.
  [[nodiscard]] bool is_swung(std::span<const Pose> poses, const Pose& map_from_l) const;
  void bend_trail(const PoseGraph& graph, const LoopOptimizer::Trail& trail);

  LoopOptimizer optimizer_;
  std::span<Pose> bent_;
  std::span<double> weights_[4];  // per LoopCost
  std::uint32_t f_ = 0;
  std::uint32_t l_ = 0;
};

}  // namespace alces
