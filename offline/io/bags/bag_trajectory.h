// Trajectories in bags: BAG, or BAG:TOPIC where it has several.
#pragma once

#include <filesystem>
#include <optional>

#include "offline/io/map_folder/trajectory.h"

namespace alces::offline {

/// nav_msgs/Odometry, PoseStamped, PoseWithCovarianceStamped and TransformStamped, one pose a message; stamps
/// of their headers. None: `path` names no bag. InputError: it does, and there is no such trajectory, or
/// several and none is named.
[[nodiscard]] std::optional<Trajectory> read_bag_trajectory(const std::filesystem::path& path);

/// Whether this is BAG:TOPIC, and the bag is there.
[[nodiscard]] bool names_bag_topic(const std::filesystem::path& path);

}  // namespace alces::offline
