// The map folder of a run: docs/map-folder.md.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "alces_offline/map_run.h"

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

/// Makes the folder and finds out whether files can be written into it, before long work is done for it;
/// OutputError.
void prepare_map_folder(const std::filesystem::path& folder);

/// Removes the scanNNN.frames of `folder` that stand for no pose of the trajectory: 3DTK's show, and everyone
/// who reads a folder of .frames, would take those of a longer map before for scans of this.
void remove_other_frames(const std::filesystem::path& folder, const Trajectory& trajectory);

/// Writes trajectory.tum, trajectory_without_loops.tum, scans.csv, counters.csv (of a replay), graph.g2o,
/// frames/, map.ply, scans.alces and, last, run.json, each whole or not at all; .frames
/// of an earlier map that this one does not have are removed, and its run.json before anything is written: a
/// folder with a run.json is of one map. Returns what stands in run.json. OutputError; InputError when an
/// archived scan cannot be read back.
nlohmann::json write_map_folder(const std::filesystem::path& folder, MapRun& run,
                                const ProgramFacts& program);

}  // namespace alces::offline
