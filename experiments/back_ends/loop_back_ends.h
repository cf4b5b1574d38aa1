// TORO and HOG-Man in LOA's place, during the drive (paper, section 4.2): --loop-optimizer toro, hogman.
#pragma once

#include "offline/optimize/graph/loop_back_end.h"

namespace alces::offline {

/// Goes through all of the graph at each closure.
[[nodiscard]] std::unique_ptr<GraphRelaxation> make_toro_relaxation();
/// Keeps its hierarchy, and goes only where something has changed.
[[nodiscard]] std::unique_ptr<GraphRelaxation> make_hogman_relaxation();

/// Both, as "toro" and "hogman"; more than once does nothing.
void add_loop_back_ends();

}  // namespace alces::offline
