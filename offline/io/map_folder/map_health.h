// What a map is worth (alces/map_verdict.h), as it stands in run.json, and said in one line.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "alces/map_verdict.h"

namespace alces::offline {

/// `health` of run.json. `numbers`: of the scans of the map, as their files have them.
[[nodiscard]] nlohmann::json health_json(const MapHealth& health, const std::vector<std::size_t>& numbers);

/// "verdict: doubtful: too many steps ...; look at scans 12, 302, 310" from `verdict` and `health` of a
/// run.json; empty where it has none, as of a map that was made before there were verdicts.
[[nodiscard]] std::string verdict_line(const nlohmann::json& run);

/// Makes of the run.json of a map that of the map with new poses: puts `optimize` in, and judges anew. The
/// verdict is the drive's, and one step worse where more than a few of `loops` contradict the others
/// (optimize's `distrusted`). The drive's own goes on in `optimize`, so that nothing counts twice.
void add_optimization(nlohmann::json& run, const nlohmann::json& optimize, std::size_t loops);

}  // namespace alces::offline
