// The edges and loops of a map as a recording has them (/alces/graph_edges, /alces/loops), and back.
//
// A recording keeps four variances an edge (EdgeVariance), a graph file six by six numbers of information.
// What a mapper wrote goes there and back without a loss; of an edge of the desk (LUM's) the variances along
// the axes of its second scan and the sum of those of rotation stay, and correlations are lost.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "alces_platform/recording/records.h"
#include "offline/optimize/graph/constraint_graph.h"

namespace alces::offline {

struct RecordedGraph {
  std::vector<GraphEdgeRecord> edges;  ///< ends are rows of the trajectory; stamps are not set
  std::vector<LoopRecord> loops;       ///< their texts lie in `verdicts`
  std::vector<std::string> verdicts;
};

/// graph.g2o of a map folder, and the loops of its run.json; what is not there is left out. InputError when a
/// file is not what it should be, or speaks of poses that the trajectory does not have.
[[nodiscard]] RecordedGraph read_recorded_graph(const std::filesystem::path& map_folder, std::size_t poses);

/// Of an edge as write_g2o() has it; see map_writer.h for the frames.
[[nodiscard]] GraphEdgeRecord edge_record(const Constraint& constraint);

/// The graph of a recording: a vertex a pose of the map, with the ids 0, 1, ... InputError: there are no
/// edges, or they speak of poses that are not there.
[[nodiscard]] ConstraintGraph graph_of_recording(const std::filesystem::path& recording,
                                                 const std::vector<Pose>& map_from_body);

}  // namespace alces::offline
