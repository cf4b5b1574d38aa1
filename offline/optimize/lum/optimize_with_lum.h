// A map and its scans in, relaxed poses out: `alces optimize --with lum`.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"
#include "process_group.h"
#include "relaxation.h"
#include "scan_cache.h"

namespace alces::offline {

struct LumRequest {
  LumSettings settings;
  std::filesystem::path scratch_folder;             ///< for scans, when not all may be loaded at once
  std::optional<std::filesystem::path> checkpoint;  ///< written after each iteration, its folder is made
  bool resume = false;                              ///< from that checkpoint
  ProcessGroup* group = nullptr;                    ///< nullptr: this process alone
};

struct LumCallbacks {
  /// Within an iteration; from any thread, one call at a time.
  std::function<void(std::uint32_t iteration, std::size_t links_done, std::size_t links_total)> progress = {};
  /// After each iteration. `left_s`: by how the change shrinks; none while it does not.
  std::function<void(const LumIteration&, std::optional<double> left_s)> iterated = {};
  std::function<bool()> stop_requested = {};
};

struct LumResult {
  bool is_worker = false;  ///< this rank has helped; the result is rank 0's
  bool was_stopped = false;
  bool is_converged = false;
  std::uint32_t iterations = 0;       ///< with those before a resume
  std::vector<LumIteration> history;  ///< of this run
  std::vector<double> seconds;        ///< beside history
  std::vector<Pose> map_from_scan;
  std::vector<LinkOutcome> outcomes;
  std::vector<Matrix6d> covariances;  ///< when asked for
  ConstraintGraph link_graph;
  ScanCache::Counters cache;  ///< of this rank
};

/// Scan of the source that each pose belongs to: by number, or by time where the trajectory has times.
/// InputError naming the first pose without a scan.
[[nodiscard]] std::vector<std::size_t> scans_of_trajectory(const Trajectory& trajectory,
                                                           const ScanSource& scans);

/// Where the scans of a map folder lie, by its run.json (source.paths): InputError when it does not say, or
/// when they are gone.
[[nodiscard]] std::vector<std::filesystem::path> source_of_map(const std::filesystem::path& map_folder,
                                                               const nlohmann::json& run_report);

/// Relaxes `trajectory`. InputError, OutputError (checkpoint, scratch file), CapacityError. No scans, or one:
/// done at once.
[[nodiscard]] LumResult optimize_with_lum(const Trajectory& trajectory, ScanSource& scans,
                                          const LumRequest& request, const LumCallbacks& callbacks = {});

/// For a rank whose scans cannot even be opened, so that rank 0 says why instead of waiting for it.
void refuse_to_help(ProcessGroup& group, const std::string& problem);

/// For run.json: iterations, links, those distrusted by name, the cache.
[[nodiscard]] nlohmann::json lum_report(const LumResult& result, const LumSettings& settings,
                                        const Trajectory& trajectory);

/// scan, stamp, and the upper triangle of each pose's 6x6 covariance, row by row: x y z (m) and rotation
/// vector (rad), axes of the map, about the scan's place. OutputError.
void write_covariances(const std::filesystem::path& csv, const Trajectory& trajectory,
                       const std::vector<Matrix6d>& covariances);

}  // namespace alces::offline
