// What a report needs of a map folder, read and checked.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cloud_octree.h"
#include "offline/io/map_folder/scan_table.h"
#include "offline/io/map_folder/trajectory.h"

namespace alces::offline {

/// counters.csv of a replay.
struct CounterHistory {
  std::vector<std::string> names;  ///< "part.counter"
  std::vector<double> time_s;
  std::vector<std::vector<double>> values;  ///< as names, then as time_s
};

struct ReportMap {
  Trajectory trajectory;
  std::optional<Trajectory> without_loops;
  std::optional<ScanTable> scans;
  std::optional<CounterHistory> counters;
  nlohmann::json run;  ///< run.json
  std::vector<CloudPoint> points;
  bool has_intensity = false;
  std::uint64_t points_in_file = 0;
  std::uint64_t not_finite = 0;
  std::uint64_t far_off = 0;
};

/// At most about `most_points` of the points, an even choice. InputError.
[[nodiscard]] ReportMap read_report_map(const std::filesystem::path& folder, std::uint64_t most_points);

}  // namespace alces::offline
