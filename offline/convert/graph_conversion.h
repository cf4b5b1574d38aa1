// Pose graphs of `alces convert`: from one file format into another, and as trajectories.
#pragma once

#include "convert_map.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/optimize/graph/constraint_graph.h"

namespace alces::offline {

/// The poses of a graph file in the order of their ids, which are the stamps. InputError.
[[nodiscard]] Trajectory trajectory_of_graph(const MapConversion& conversion);

/// Writes graph as g2o or TORO, by conversion.form, and counts into `report`.
void write_graph_as(const ConstraintGraph& graph, const MapConversion& conversion,
                    MapConversionReport& report);

}  // namespace alces::offline
