// What `map` and `replay` share: a run of the mapper with a progress bar, and the map folder written at its
// end.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "map_run.h"
#include "offline/io/map_folder/map_folder.h"
#include "offline/io/scans/scan_source.h"

namespace alces::offline {

/// As the program was called.
[[nodiscard]] std::vector<std::string> command_line();

/// To stderr where `report`, a run.json, calls its map bad; the exit status stays.
void warn_of_bad_map(const nlohmann::json& report);

/// Maps all of `scans` until the end or Ctrl-C, with an archive in `out` if none is asked for, writes what is
/// mapped to `out`, and prints a summary or, with `json`, run.json. What stopped the run is thrown once the
/// map is written. `describe`, if given, adds what is known of a drive once the scans are through.
void map_and_write(ScanSource& scans, const MapRequest& request, const std::filesystem::path& out,
                   ProgramFacts program, bool json, const std::function<void(ProgramFacts&)>& describe = {});

}  // namespace alces::offline
