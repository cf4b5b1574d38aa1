// The map folder of a run: docs/map-folder.md.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "offline/io/files/staged_folder.h"
#include "offline/map/map_run.h"

namespace alces::offline {

/// What the run itself does not know of the program around it.
struct ProgramFacts {
  std::string version;
  std::vector<std::string> command_line;
  std::string front_end;  ///< "default" or "paper"
  nlohmann::json drive;   ///< of a replay: counters and notices of the devices; null otherwise
  /// Joins run.json's "source": paths (where the scans lie, absolute), replay (how a drive was replayed).
  nlohmann::json source = nlohmann::json::object();
  std::string drive_counters_csv = {};  ///< of a replay: how the counters grew; empty otherwise
};

/// Finds out whether the folder can be written, before long work is done for it; OutputError.
void prepare_map_folder(const std::filesystem::path& folder);

/// Writes trajectory.tum, trajectory_without_loops.tum, scans.csv, counters.csv (of a replay), graph.g2o,
/// frames/, map.ply, scans.alces and run.json, and puts them into their place together (StagedFolder): what
/// an earlier map left goes away, files of others stay. Returns what stands in run.json. OutputError;
/// InputError when an archived scan cannot be read back.
nlohmann::json write_map_folder(StagedFolder& stage, MapRun& run, const ProgramFacts& program);
/// The same, all in one.
nlohmann::json write_map_folder(const std::filesystem::path& folder, MapRun& run,
                                const ProgramFacts& program);

}  // namespace alces::offline
