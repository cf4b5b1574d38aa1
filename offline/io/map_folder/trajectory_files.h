// Which files beside the scans hold poses; shared by scan sources and trajectory readers.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "alces/pose.h"

namespace alces::offline {

/// The folder's first of odometry.tum, trajectory.tum, alidarPose.csv, poses.txt, or its only *.tum.
[[nodiscard]] std::optional<std::filesystem::path> find_trajectory(const std::filesystem::path& folder);

/// camera_from_scanner of the "Tr:" line of a KITTI calib.txt.
[[nodiscard]] Pose read_kitti_calibration(const std::filesystem::path& calib);

/// One number a line (KITTI's times.txt).
[[nodiscard]] std::vector<double> read_times(const std::filesystem::path& file);

}  // namespace alces::offline
