// The most likely poses of a graph: nonlinear least squares over all constraints at once, Gauss-Newton damped
// by Levenberg and Marquardt where a step would not help, on SE(3) and, for planar graphs, on SE(2).
//
// An iteration linearises every constraint in closed form (constraint_jacobian.h), solves the sparse normal
// equations (block_system.h) and moves each vertex in its own frame. Damping multiplies the diagonal by
// 1 + lambda, so it does not depend on units; lambda follows the gain as Nielsen proposes (1999).
// Objective: chi-squared as g2o counts it (constraint_graph.h), through a robust kernel (robust_kernel.h) for
// constraints that do not join consecutive vertices: the chain of a drive is not in doubt, a loop may be.
//
// Cost: an iteration is O(m) and a Cholesky factorization of the graph; figures are in docs/graphs.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "constraint_graph.h"
#include "graph_start.h"
#include "robust_kernel.h"

namespace alces::offline {

struct GaussNewtonSettings {
  GraphStart start = GraphStart::best;
  RobustKernel kernel = RobustKernel::none;
  /// Standard deviations at which a kernel sets in: chi-squared of 25, which one good edge in 3000 exceeds.
  double kernel_width = 5;
  std::size_t most_iterations = 100;
  double least_decrease = 1e-8;  ///< of the cost, as a fraction: what counts as no decrease
};

struct GaussNewtonStep {
  std::size_t iteration = 0;  ///< from 1; 0: the start
  double cost = 0;
  double lambda = 0;
  bool was_accepted = true;  ///< false: the step was taken back, lambda grows
};

enum class GaussNewtonEnd : std::uint8_t {
  converged,  ///< no step lowers the cost by more than least_decrease
  iteration_limit,
  stopped,  ///< by stop_requested
};

struct GaussNewtonResult {
  double chi_squared_before = 0;        ///< of the graph as it was given
  double chi_squared_start = 0;         ///< after the start was chosen
  double chi_squared = 0;               ///< at the end, without the kernel
  double cost = 0;                      ///< at the end, with it
  GraphStart start = GraphStart::file;  ///< `best` resolved
  std::size_t iterations = 0;
  std::size_t factor_numbers = 0;  ///< in the Cholesky factor
  GaussNewtonEnd end = GaussNewtonEnd::converged;
  /// Positions in the graph's constraints that the kernel weighs less than half.
  std::vector<std::uint32_t> distrusted;
};

struct GaussNewtonCallbacks {
  std::function<void(const GaussNewtonStep&)> progress;  ///< may be empty
  std::function<bool()> stop_requested;                  ///< asked once an iteration; may be empty
};

/// Whatever ends it, the graph holds the best poses so far. Fixed vertices stay to the bit; where none is,
/// the first does. InputError for a graph that is not connected, CapacityError when memory does not suffice.
GaussNewtonResult optimize_gauss_newton(ConstraintGraph& graph, const GaussNewtonSettings& settings = {},
                                        const GaussNewtonCallbacks& callbacks = {});

/// Does the constraint join vertices that do not follow each other?
[[nodiscard]] inline bool is_loop(const Constraint& constraint) {
  return constraint.from + std::uint64_t{1} != constraint.to &&
         constraint.to + std::uint64_t{1} != constraint.from;
}

}  // namespace alces::offline
