// Another back end in LOA's place: whoever maps with a desk under them may bend the map by an optimiser of
// their own whenever a loop is closed (paper, section 4.2: TORO and HOG-Man "replacing LOA").
//
// Detecting, matching and believing loops stay the mapper's; so does LOA when the other back end cannot.
#pragma once

#include <span>

#include "alces/pose.h"
#include "alces/pose_graph.h"

namespace alces {

class LoopRelaxation {
 public:
  /// The graph's last edge has just closed a loop; its poses are still those from before. Writes all poses
  /// anew into `map_from_body`, which holds them on entry; the first one stays. False: it cannot, and has
  /// written nothing; the mapper then shares the offset out itself. Must not throw.
  [[nodiscard]] virtual bool relax(const PoseGraph& graph, std::span<Pose> map_from_body) = 0;

 protected:
  ~LoopRelaxation() = default;
};

}  // namespace alces
