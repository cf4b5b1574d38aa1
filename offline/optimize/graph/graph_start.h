// Poses for an optimiser to start from, out of a graph's constraints alone. Fixed vertices keep their poses;
// where none is fixed, the first vertex does. Connected graphs only (graph_parts.h).
#pragma once

#include <cstdint>

#include "constraint_graph.h"

namespace alces::offline {

enum class GraphStart : std::uint8_t {
  file,           ///< the poses as they are
  odometry,       ///< along the edges between consecutive vertices, wherever there are some
  spanning_tree,  ///< along the fewest edges from a fixed vertex
  chordal,        ///< orientations from all edges at once, then positions
  best,           ///< file or chordal, whichever has the lower chi-squared
};

/// Composes measurements along a tree. O(n + m).
void start_from_odometry(ConstraintGraph& graph);
void start_from_spanning_tree(ConstraintGraph& graph);

/// Chordal initialisation (Martinec and Pajdla, CVPR 2007; Carlone, Tron, Daniilidis, Dellaert, ICRA 2015):
/// the 3x3 matrices that least squares finds when it forgets that they are rotations, each turned into the
/// nearest rotation; then the positions that fit best to these orientations. Two linear systems, about the
/// cost of two iterations of Gauss-Newton. Errors of 10 degrees an edge do not trouble it; a wrong loop does.
void start_from_chordal(ConstraintGraph& graph);

/// Makes the first vertex fixed when none is; returns how many are.
std::size_t ensure_fixed(ConstraintGraph& graph);

}  // namespace alces::offline
