// A map that is compared with its own odometry looks good whatever it is worth.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "alces/pose.h"
#include "evaluation.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"

namespace alces::offline {

/// Why the truth says nothing about the map at `map_or_trajectory`: it is the trajectory itself, or what the
/// map took as odometry, by file, content or poses (to 1 mm and 0.05 deg; run.json has some of them). None:
/// nothing is known against it. `association` pairs the map's poses with those of `truth`.
[[nodiscard]] std::optional<std::string> why_circular(const std::filesystem::path& map_or_trajectory,
                                                      const std::filesystem::path& truth_path,
                                                      const Trajectory& truth,
                                                      const Association& association);
/// The same of scans that are to be mapped. One pose of the truth a scan, or none.
[[nodiscard]] std::optional<std::string> why_circular(const ScanSource& scans,
                                                      const std::filesystem::path& truth_path,
                                                      std::span<const std::optional<Pose>> truth_from_body);

}  // namespace alces::offline
