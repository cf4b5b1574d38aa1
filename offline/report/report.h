// A map folder as one HTML file that needs nothing else: what `alces report` writes. docs/report.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace alces::offline {

struct ReportSettings {
  std::string title;  ///< empty: the map folder's name
  /// All points at the fine step, however large the file becomes.
  bool full = false;
  /// Of the file, not `full`. What the rest leaves belongs to the points.
  std::size_t limit_bytes = 25'000'000;
  /// Held in memory at a time, not `full`: of a larger map an even choice of so many is read.
  std::uint64_t most_points = 12'000'000;
  double step_m = 0.005;       ///< the points are rounded to; half of it is the error
  double full_step_m = 0.001;  ///< the same with `full`
  /// A folder of tables (.csv) and pictures (.png, .svg) to show as the comparison of methods.
  std::optional<std::filesystem::path> comparison;
};

struct ReportSummary {
  std::uint64_t points = 0;        ///< in map.ply
  std::uint64_t points_shown = 0;  ///< in the file
  std::uint64_t not_finite = 0;    ///< left out
  std::uint64_t far_off = 0;       ///< left out: more than 2 km from the trajectory, no laser sees so far
  std::size_t loops_closed = 0;
  std::size_t loops_refused = 0;
  std::uint64_t file_bytes = 0;
};

/// Reads trajectory.tum, map.ply and run.json, which must be there, and trajectory_without_loops.tum,
/// scans.csv and counters.csv, without which there is less to see. Throws InputError for files that are not
/// what they should be; CapacityError when the limit leaves no room for points; OutputError; Error when the
/// program was built without the page (page_problem()). `progress(stage)` may be empty.
///
/// Time: 1 s a million points of the map, most of it deflating. Memory: about 50 bytes a point; without
/// `full` no more than `most_points` are held at a time, an even choice of a larger map's.
ReportSummary write_report(const std::filesystem::path& map_folder, const std::filesystem::path& html,
                           const ReportSettings& settings = {},
                           const std::function<void(const char*)>& progress = {});

/// Why this program cannot write reports: it was built without the page. Empty: it can.
[[nodiscard]] std::string page_problem();

}  // namespace alces::offline
