// What bends the map when a loop is closed during a drive: LOA in the mapper itself, or one of the optimisers
// that the paper compares it with, over the mapper's graph (paper, section 4.2).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "alces/loop_relaxation.h"
#include "alces/pose_graph.h"
#include "constraint_graph.h"

namespace alces::offline {

enum class LoopBackEnd : std::uint8_t { elch, toro, hogman, none };

/// As --loop-optimizer and run.json name it.
[[nodiscard]] std::string_view name(LoopBackEnd back_end);
[[nodiscard]] std::optional<LoopBackEnd> loop_back_end(std::string_view name);
[[nodiscard]] std::vector<std::string> loop_back_end_names();

/// The mapper's edge as a constraint with full information; see g2o_information().
[[nodiscard]] Constraint constraint_of(const Edge& edge);
/// The whole graph; its first vertex is fixed.
[[nodiscard]] ConstraintGraph constraint_graph_of(const PoseGraph& graph);

/// Owned by whoever runs the mapper, one a map.
class GraphRelaxation : public LoopRelaxation {
 public:
  virtual ~GraphRelaxation() = default;
  /// Why relax() said no the last time; empty as long as it has not.
  [[nodiscard]] const std::string& problem() const { return problem_; }

 protected:
  std::string problem_;
};

/// TORO goes through all of the graph at each closure; HOG-Man keeps its hierarchy and goes only where
/// something has changed. Null for elch and none, which need no other back end.
[[nodiscard]] std::unique_ptr<GraphRelaxation> make_graph_relaxation(LoopBackEnd back_end);

}  // namespace alces::offline
