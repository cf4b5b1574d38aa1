// A map folder as an optimiser's input and output: its graph goes in, a complete map folder comes out, every
// scan's points moved with its pose.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "constraint_graph.h"
#include "offline/io/map_folder/trajectory.h"

namespace alces::offline {

struct MapGraph {
  std::filesystem::path folder;
  ConstraintGraph graph;  ///< of graph.g2o, a vertex a scan
  Trajectory trajectory;  ///< as many poses; for the stamps
  nlohmann::json report;  ///< run.json; null where there is none
};

/// graph.g2o, trajectory.tum and run.json of a map folder. InputError when they do not belong together.
[[nodiscard]] MapGraph read_map_graph(const std::filesystem::path& folder);

/// Writes a complete map folder with the poses of `graph`, which is that of `map` with other poses: map.ply
/// is that of map.folder re-placed, run.json its report with `optimize` added under that name and
/// judged anew (map_health.h), and is returned; scans.csv, counters.csv and trajectory_without_loops.tum are
/// copied where map.folder has them. All of it or nothing (StagedFolder); what an earlier map left of these
/// in `out`, and its covariances.csv, goes away. `write_more`, unless empty, writes further files to the
/// folder that it is given, which take their place with the others. `out` is not map.folder: UsageError.
/// InputError, OutputError.
nlohmann::json write_map_graph(const std::filesystem::path& out, const MapGraph& map,
                               const ConstraintGraph& graph, const nlohmann::json& optimize,
                               const std::function<void(const std::filesystem::path&)>& write_more = {});

/// graph.g2o and trajectory.tum (stamps are the vertices' ids) of a graph without scans; all or nothing.
void write_graph_folder(const std::filesystem::path& out, const ConstraintGraph& graph);

}  // namespace alces::offline
