#include "alces_platform/bags/messages.h"

#include <algorithm>
#include <array>
#include <utility>

#include "alces_platform/bags/point_cloud.h"

namespace alces::bags {
namespace {

constexpr std::size_t least_string_bytes = 4;

std::vector<float> floats(MessageCursor& message) {
  std::vector<float> values(message.count(sizeof(float)));
  for (float& value : values) value = message.number<float>();
  return values;
}

StampedPose transform(MessageCursor& message) {
  StampedPose read;
  read.header = message.header();
  read.child = message.frame();
  read.pose = message.pose();  // Transform has the same fields in the same order
  return read;
}

}  // namespace

const PointField* PointCloud2::field(std::string_view name) const {
  const auto found =
      std::find_if(fields.begin(), fields.end(), [&](const PointField& each) { return each.name == name; });
  return found == fields.end() ? nullptr : &*found;
}

std::optional<PointCloud2> read_point_cloud2(MessageCursor message) {
  PointCloud2 cloud;
  cloud.header = message.header();
  cloud.height = message.number<std::uint32_t>();
  cloud.width = message.number<std::uint32_t>();
  constexpr std::size_t least_field_bytes = least_string_bytes + 4 + 1 + 4;
  constexpr std::uint32_t most_fields = 1024;
  const std::uint32_t count = message.count(least_field_bytes);
  if (count > most_fields) return std::nullopt;
  for (std::uint32_t i = 0; i < count; ++i) {
    PointField field;
    field.name = message.string();
    field.offset = message.number<std::uint32_t>();
    field.type = message.number<std::uint8_t>();
    field.count = message.number<std::uint32_t>();
    cloud.fields.push_back(std::move(field));
  }
  cloud.is_big_endian = message.boolean();
  cloud.point_step = message.number<std::uint32_t>();
  cloud.row_step = message.number<std::uint32_t>();
  cloud.data = message.byte_sequence();
  if (message.failed()) return std::nullopt;
  return cloud;
}

bool is_pose_type(std::string_view type) {
  constexpr std::array<std::string_view, 4> types = {"nav_msgs/Odometry", "geometry_msgs/PoseStamped",
                                                     "geometry_msgs/PoseWithCovarianceStamped",
                                                     "geometry_msgs/TransformStamped"};
  return std::find(types.begin(), types.end(), type) != types.end();
}

std::optional<StampedPose> read_pose(std::string_view type, MessageCursor message) {
  StampedPose read;
  if (type == "geometry_msgs/TransformStamped") {
    read = transform(message);
  } else {
    read.header = message.header();
    if (type == "nav_msgs/Odometry") read.child = message.frame();
    read.pose = message.pose();
  }
  if (message.failed()) return std::nullopt;
  return read;
}

bool is_transforms_type(std::string_view type) {
  return type == "tf2_msgs/TFMessage" || type == "tf/tfMessage";
}

std::optional<std::vector<StampedPose>> read_transforms(MessageCursor message) {
  constexpr std::size_t least_bytes = 8 + 2 * least_string_bytes + 7 * sizeof(double);
  std::vector<StampedPose> transforms(message.count(least_bytes));
  for (StampedPose& each : transforms) each = transform(message);
  if (message.failed()) return std::nullopt;
  return transforms;
}

std::optional<std::vector<StampedPose>> read_path(MessageCursor message) {
  const Header header = message.header();
  constexpr std::size_t least_bytes = 8 + least_string_bytes + 7 * sizeof(double);
  std::vector<StampedPose> path(message.count(least_bytes));
  for (StampedPose& each : path) {
    each.header = message.header();
    if (each.header.frame.empty()) each.header.frame = header.frame;
    each.pose = message.pose();
  }
  if (message.failed()) return std::nullopt;
  return path;
}

std::optional<LaserScan> read_laser_scan(MessageCursor message) {
  LaserScan scan;
  scan.header = message.header();
  scan.angle_min_rad = message.number<float>();
  static_cast<void>(message.number<float>());  // angle_max follows from the count
  scan.angle_increment_rad = message.number<float>();
  scan.time_increment_s = message.number<float>();
  static_cast<void>(message.number<float>());  // scan_time
  scan.range_min_m = message.number<float>();
  scan.range_max_m = message.number<float>();
  scan.ranges_m = floats(message);
  scan.intensities = floats(message);
  if (message.failed()) return std::nullopt;
  return scan;
}

std::optional<JointState> read_joint_state(MessageCursor message) {
  JointState joints;
  joints.header = message.header();
  const std::uint32_t names = message.count(least_string_bytes);
  for (std::uint32_t i = 0; i < names && !message.failed(); ++i) joints.names.emplace_back(message.string());
  joints.positions.resize(message.count(sizeof(double)));
  for (double& position : joints.positions) position = message.number<double>();
  if (message.failed()) return std::nullopt;
  return joints;
}

std::optional<Header> read_header(MessageCursor message) {
  Header header = message.header();
  if (message.failed()) return std::nullopt;
  return header;
}

bool begins_with_header(const Channel& channel) {
  if (is_pose_type(channel.type) || is_cloud_type(channel.type)) return true;
  constexpr std::array<std::string_view, 4> types = {"sensor_msgs/JointState", "sensor_msgs/Imu",
                                                     "sensor_msgs/NavSatFix", "nav_msgs/Path"};
  if (std::find(types.begin(), types.end(), channel.type) != types.end()) return true;
  // the first line that is neither empty, nor a remark, nor a constant
  std::string_view rest = channel.definition;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    line = line.substr(0, line.find('#'));
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos || line.find('=') != std::string_view::npos) continue;
    line.remove_prefix(begin);
    return line.starts_with("Header ") || line.starts_with("std_msgs/Header ") ||
           line.starts_with("std_msgs/msg/Header ");
  }
  return false;
}

}  // namespace alces::bags
