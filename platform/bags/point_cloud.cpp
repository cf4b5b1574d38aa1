#include "alces_platform/bags/point_cloud.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

namespace alces::bags {
namespace {

constexpr std::array<std::uint8_t, 9> type_bytes = {0, 1, 1, 2, 2, 4, 4, 4, 8};

template <typename Number>
double number_at(const std::uint8_t* at, bool is_swapped) {
  std::array<std::uint8_t, sizeof(Number)> bytes{};
  std::memcpy(bytes.data(), at, bytes.size());
  if (is_swapped) std::reverse(bytes.begin(), bytes.end());
  return static_cast<double>(std::bit_cast<Number>(bytes));
}

double value_at(const std::uint8_t* at, std::uint8_t type, bool is_swapped) {
  switch (type) {
    case 1:
      return number_at<std::int8_t>(at, is_swapped);
    case 2:
      return number_at<std::uint8_t>(at, is_swapped);
    case 3:
      return number_at<std::int16_t>(at, is_swapped);
    case 4:
      return number_at<std::uint16_t>(at, is_swapped);
    case 5:
      return number_at<std::int32_t>(at, is_swapped);
    case 6:
      return number_at<std::uint32_t>(at, is_swapped);
    case 7:
      return number_at<float>(at, is_swapped);
    default:
      return number_at<double>(at, is_swapped);
  }
}

/// 0 where drivers leave it out, as they may for a single row.
std::uint64_t row_bytes(const PointCloud2& cloud) {
  return cloud.row_step != 0 ? cloud.row_step : std::uint64_t{cloud.width} * cloud.point_step;
}

std::string field_problem(const PointCloud2& cloud, const PointField& field) {
  if (field.type < 1 || field.type > 8)
    return "has a field " + field.name.substr(0, 40) + " of unknown type " + std::to_string(field.type);
  if (std::uint64_t{field.offset} + type_bytes.at(field.type) > cloud.point_step)
    return "has a field " + field.name.substr(0, 40) + " that lies beyond its points";
  return {};
}

/// take(bytes of a point) for all points, row by row.
template <class Take>
void for_each_point(const PointCloud2& cloud, const Take& take) {
  for (std::uint32_t row = 0; row < cloud.height; ++row) {
    const std::uint8_t* at = cloud.data.data() + row * row_bytes(cloud);
    for (std::uint32_t column = 0; column < cloud.width; ++column, at += cloud.point_step) take(at);
  }
}

}  // namespace

const char* type_name(std::uint8_t type) {
  constexpr std::array<const char*, 9> names = {"?",     "int8",   "uint8",   "int16",  "uint16",
                                                "int32", "uint32", "float32", "float64"};
  return names.at(type < names.size() ? type : 0);
}

std::string layout_problem(const PointCloud2& cloud) {
  for (const char* name : {"x", "y", "z"}) {
    const PointField* field = cloud.field(name);
    if (field == nullptr) return std::string("has no field ") + name;
    if (std::string problem = field_problem(cloud, *field); !problem.empty()) return problem;
  }
  if (cloud.points() == 0) return {};
  if (cloud.height > 1 && row_bytes(cloud) < std::uint64_t{cloud.width} * cloud.point_step)
    return "has rows shorter than their points";
  // the last row may end with its last point
  const std::uint64_t rows_before = std::uint64_t{cloud.height} - 1;
  const std::uint64_t last_row_bytes = std::uint64_t{cloud.width} * cloud.point_step;
  const std::uint64_t available = cloud.data.size();
  if (last_row_bytes > available ||
      (rows_before > 0 && row_bytes(cloud) > (available - last_row_bytes) / rows_before))
    return "says that it has " + std::to_string(cloud.points()) +
           " points, and its data is too short for them";
  return {};
}

void read_points(const PointCloud2& cloud, std::vector<Point>& points) {
  points.clear();
  points.reserve(cloud.points());
  const PointField& x = *cloud.field("x");
  const PointField& y = *cloud.field("y");
  const PointField& z = *cloud.field("z");
  if (x.type == 7 && y.type == 7 && z.type == 7 && !cloud.is_big_endian) {  // nearly all clouds
    for_each_point(cloud, [&](const std::uint8_t* at) {
      Point point;
      std::memcpy(&point.x, at + x.offset, sizeof point.x);
      std::memcpy(&point.y, at + y.offset, sizeof point.y);
      std::memcpy(&point.z, at + z.offset, sizeof point.z);
      points.push_back(point);
    });
    return;
  }
  for_each_point(cloud, [&](const std::uint8_t* at) {
    const auto coordinate = [&](const PointField& field) {
      return static_cast<float>(value_at(at + field.offset, field.type, cloud.is_big_endian));
    };
    points.push_back({coordinate(x), coordinate(y), coordinate(z)});
  });
}

void read_values(const PointCloud2& cloud, const PointField& field, std::vector<double>& values) {
  values.clear();
  if (!field_problem(cloud, field).empty()) return;
  values.reserve(cloud.points());
  for_each_point(cloud, [&](const std::uint8_t* at) {
    values.push_back(value_at(at + field.offset, field.type, cloud.is_big_endian));
  });
}

}  // namespace alces::bags
