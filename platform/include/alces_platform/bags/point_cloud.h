// Points of a PointCloud2 of any layout: float or double coordinates or integers, rows with gaps, either byte
// order; with the times and intensities of its points under the names and in the types that drivers use.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "alces/point.h"
#include "alces_platform/bags/messages.h"

namespace alces::bags {

/// What is wrong with the layout, a clause ("has no field x"); empty: its points can be read.
[[nodiscard]] std::string layout_problem(const PointCloud2& cloud);

/// Replaces `points`, in the cloud's order, NaN and Inf included. The cloud has no layout_problem().
void read_points(const PointCloud2& cloud, std::vector<Point>& points);

/// The values of a scalar field, one a point. The cloud has no layout_problem().
void read_values(const PointCloud2& cloud, const PointField& field, std::vector<double>& values);

/// "float32" of 7.
[[nodiscard]] const char* type_name(std::uint8_t type);

}  // namespace alces::bags
