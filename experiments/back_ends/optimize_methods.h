// TORO and HOG-Man over a whole graph, after the drive: `alces optimize --with toro`, `hogman`.
#pragma once

namespace alces::offline {

void add_optimize_methods();

}  // namespace alces::offline
