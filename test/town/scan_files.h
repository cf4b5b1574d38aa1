// A drive as files that every reader of scans knows: binary PCD, and trajectories in TUM's form.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "alces/point.h"
#include "alces/pose.h"

namespace alces::sim {

/// Whether all of it is on the disk.
[[nodiscard]] bool write_pcd(const std::filesystem::path& path, const std::vector<Point>& points);

/// stamp x y z qx qy qz qw, with the line's end.
[[nodiscard]] std::string tum_line(double stamp, const Pose& pose);

}  // namespace alces::sim
