// What is known of one vertex of a graph when all others are unknown, too, but for the fixed ones.
#pragma once

#include <cstdint>

#include "alces_offline/graph/constraint_graph.h"

namespace alces::offline {

/// Writes into `joint` what the constraints of `graph`, at its present poses, tell of vertex `to` as seen
/// from a fixed vertex `from`: the measurement and, in the coordinates of constraint_error(), the inverse of
/// its marginal covariance. O(a factorisation of the graph). InputError when it is not determined.
void condense(const ConstraintGraph& graph, std::uint32_t from, std::uint32_t to, Constraint& joint);

}  // namespace alces::offline
