// A small graph as one constraint: what all of it tells of one vertex as seen from another. HOG-Man's
// measurements between groups (Grisetti et al. 2010), on the manifold.
#pragma once

#include <cstdint>

#include "offline/optimize/graph/constraint_graph.h"

namespace alces::offline {

/// Optimises the graph from its measurements (the poses do not matter) with vertex `from` alone fixed, and
/// writes into `joint` the pose of `to` as seen from it and, in the coordinates of constraint_error(), the
/// inverse of its marginal covariance. Dense algebra: O(vertices^3) time and O(vertices^2) memory.
/// InputError when the constraints do not determine it.
void condense(ConstraintGraph& graph, std::uint32_t from, std::uint32_t to, Constraint& joint);

}  // namespace alces::offline
