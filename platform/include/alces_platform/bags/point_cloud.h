// Points of a cloud of any layout: float or double coordinates or integers, rows with gaps, either byte
// order; with the times and intensities of its points under the names and in the types that drivers use.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "alces/point.h"
#include "alces_platform/bags/messages.h"

namespace alces::bags {

/// sensor_msgs/PointCloud2, sensor_msgs/LaserScan, CustomMsg of Livox's drivers.
[[nodiscard]] bool is_cloud_type(const std::string& type);
/// sensor_msgs/LaserScan: in one plane, a scan only together with others.
[[nodiscard]] bool is_profile_type(const std::string& type);

/// A message of one of these types as a cloud; `room` keeps its data where the message has it in another
/// form, and outlives it. Livox's is read by the definition that the bag has of it. A profile's points are in
/// the laser's plane, with a `time` each; rays out of the laser's range are NaN. None: it does not decode.
[[nodiscard]] std::optional<PointCloud2> read_cloud(const Channel& channel,
                                                    std::span<const std::uint8_t> data,
                                                    std::vector<std::uint8_t>& room);

/// What is wrong with the layout, a clause ("has no field x"); empty: its points can be read.
[[nodiscard]] std::string layout_problem(const PointCloud2& cloud);

/// Replaces `points`, in the cloud's order, NaN and Inf included. The cloud has no layout_problem().
void read_points(const PointCloud2& cloud, std::vector<Point>& points);

/// The values of a scalar field, one a point. The cloud has no layout_problem().
void read_values(const PointCloud2& cloud, const PointField& field, std::vector<double>& values);

/// "float32" of 7.
[[nodiscard]] const char* type_name(std::uint8_t type);

}  // namespace alces::bags
