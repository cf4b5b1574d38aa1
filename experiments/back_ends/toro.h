// TORO: maximum-likelihood poses by stochastic gradient descent over a tree.
// From: Grisetti, Stachniss, Grzonka, Burgard, "A tree parameterization for efficiently computing maximum
// likelihood maps using gradient descent", RSS 2007; Grisetti, Grzonka, Stachniss, Pfaff, Burgard, "Efficient
// estimation of accurate maximum likelihood maps in 3D", IROS 2007; Grisetti, Stachniss, Burgard, "Non-linear
// constraint network optimization for efficient map learning", IEEE T-ITS 10(3), 2009.
//
// A spanning tree gives every vertex its pose seen from its parent. One constraint after the other, those
// nearest the root first, its error is spread over the way through the tree between its two vertices: first
// the rotation, by slerp about one axis, then the translation that is left. A vertex takes the more of it the
// less is known about its place from all constraints whose ways run over it (a diagonal preconditioner). The
// learning rate falls from iteration to iteration, so that contradicting constraints come to a compromise.
//
// Good where the first guess is poor: no linear system, nothing can blow up. It does not reach the optimum:
// covariances are taken as spheres, and positions do not correct rotations. docs/back-ends.md has figures.
//
// Cost of an iteration: the lengths of all ways, at best O(m log n), at worst O(m n). Memory: 150 bytes a
// vertex and 32 a constraint beside the graph. One thread; equal graphs give equal bits.
#pragma once

#include <cstdint>
#include <functional>

#include "offline/optimize/graph/constraint_graph.h"

namespace alces::offline {

struct ToroSettings {
  std::uint32_t iterations = 100;
  /// The learning rate: held for a share of the iterations, then falling as 1 / time. 1 would be a step of
  /// the preconditioned gradient; above it, each constraint is all but satisfied when its turn comes.
  double first_rate = 100;
  double first_rate_share = 0.1;
  double last_rate = 0.03;
};

struct ToroResult {
  std::uint32_t iterations = 0;  ///< done
  double chi_squared_before = 0;
  double chi_squared = 0;  ///< at the end
  bool stopped = false;    ///< by stop_requested
};

struct ToroCallbacks {
  std::function<void(std::uint32_t done, std::uint32_t total)> progress;  ///< after each iteration
  std::function<bool()> stop_requested;  ///< asked before each iteration; the poses so far stay in the graph
};

/// Fixed vertices keep their poses to the last bit; where none is, the first does. InputError: the graph
/// falls apart, holds NaN, or a constraint has no positive information. UsageError: rates that are none.
ToroResult optimize_toro(ConstraintGraph& graph, const ToroSettings& settings = {},
                         const ToroCallbacks& callbacks = {});

}  // namespace alces::offline
