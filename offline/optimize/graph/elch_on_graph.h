// ELCH on a bare graph: what the mapper does with its loops, for graphs of other front ends.
//
// The constraints are processed as a drive would have made them: by the later of their two vertices, of these
// the one between consecutive vertices first, otherwise in the graph's order. A vertex is placed by the first
// constraint that joins it to one that is placed; that edge extends the chain. Every further constraint
// closes a loop at once: LOA takes the graph apart (loop_optimizer.h), the measurement says where its later
// vertex lies as seen from the earlier, and the offset is shared out (loop_correction.h). Poses of the file
// are not used, but for the first one.
//
// An optimiser of all edges at once it is not: each loop is closed exactly, and later loops bend it again.
// Where loops are few and far between, CorrectionRule::trails shares their offsets out better; where every
// vertex is in several (parking-garage, sphere2500), most loops fall back to the paper's rule
// (loop_correction.h). The result says both chi-squared, before and after; docs/graphs.md has figures.
//
// Edge costs: EdgeVariance of pose_graph.h, the diagonal of the inverse of the information; g2o's rotation
// error is half an angle, so its variance counts four times.
// Cost: O(n) a loop and LOA's O(j log j), j junctions. Memory: 250 bytes a vertex and 260 bytes an
// edge beside the graph.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "alces/loop_correction.h"
#include "constraint_graph.h"

namespace alces::offline {

struct ElchSettings {
  CorrectionRule rule = CorrectionRule::trails;
};

struct ElchResult {
  double chi_squared_before = 0;    ///< of the graph as it was given
  double chi_squared_odometry = 0;  ///< with each vertex where the first constraint put it, no loop closed
  double chi_squared = 0;           ///< with all loops closed
  std::size_t loops = 0;            ///< closed
  std::size_t parallel = 0;         ///< left out: between vertices that an edge joins already
  bool was_stopped = false;
};

struct ElchCallbacks {
  std::function<void(std::size_t done, std::size_t total)> progress;  ///< constraints; may be empty
  std::function<bool()> stop_requested;                               ///< may be empty
};

/// InputError for a graph that is not connected, or that fixes more than one vertex; where none is fixed, the
/// first keeps its pose. A stop leaves the loops so far closed, and all vertices
/// placed.
ElchResult close_loops_with_elch(ConstraintGraph& graph, const ElchSettings& settings = {},
                                 const ElchCallbacks& callbacks = {});

}  // namespace alces::offline
