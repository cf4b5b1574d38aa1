// run.json: what was done and how. The keys are a promise to scripts, see docs/map-folder.md.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "map_folder.h"
#include "offline/map/map_run.h"

namespace alces::offline {

/// `write_s`: seconds a file of the map folder took.
[[nodiscard]] nlohmann::json run_report(const MapRun& run, const ProgramFacts& program,
                                        const std::map<std::string, double>& write_s);

/// The same for people: a few lines and one for every refused loop.
[[nodiscard]] std::string run_summary(const MapRun& run, const nlohmann::json& report);

}  // namespace alces::offline
