// What bends the map when a loop is closed during a drive: LOA in the mapper itself ("elch"), or another
// optimiser over the mapper's graph. "none" closes no loops. experiments/ adds those that the paper compares
// with (paper, section 4.2).
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "alces/loop_relaxation.h"
#include "alces/pose_graph.h"
#include "constraint_graph.h"

namespace alces::offline {

/// The mapper's vertex; the first is fixed.
[[nodiscard]] ConstraintVertex vertex_of(const PoseGraph& graph, std::uint32_t i);
/// The mapper's edge as a constraint with full information; see g2o_information().
[[nodiscard]] Constraint constraint_of(const Edge& edge);
/// The whole graph.
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

using MakeGraphRelaxation = std::unique_ptr<GraphRelaxation> (*)();

/// Offers one more, as --loop-optimizer and run.json are to name it. Before the command line is built, by one
/// thread; a name that is there already keeps what it stands for.
void add_loop_back_end(std::string name, MakeGraphRelaxation make);

/// elch, those that were added, none.
[[nodiscard]] std::vector<std::string> loop_back_end_names();

/// Null for elch and none, which need no other back end. UsageError: no such name.
[[nodiscard]] std::unique_ptr<GraphRelaxation> make_graph_relaxation(std::string_view name);

}  // namespace alces::offline
