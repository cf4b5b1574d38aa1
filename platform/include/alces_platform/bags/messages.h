// The messages of ROS that make a map, from a bag's bytes. Each function gives none where the bytes are not
// such a message: cut, counts that do not fit, an encapsulation that is not read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "alces/pose.h"
#include "alces_platform/bags/message_cursor.h"

namespace alces::bags {

/// sensor_msgs/PointField
struct PointField {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t type = 0;  ///< 1 to 8: int8, uint8, int16, uint16, int32, uint32, float32, float64
  std::uint32_t count = 1;
};

/// sensor_msgs/PointCloud2
struct PointCloud2 {
  Header header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::vector<PointField> fields;
  bool is_big_endian = false;
  std::uint32_t point_step = 0;
  std::uint32_t row_step = 0;
  std::span<const std::uint8_t> data;  ///< of the message's bytes

  [[nodiscard]] std::uint64_t points() const { return std::uint64_t{height} * width; }
  [[nodiscard]] const PointField* field(std::string_view name) const;
};
[[nodiscard]] std::optional<PointCloud2> read_point_cloud2(MessageCursor message);

/// A pose of a body at a time: of Odometry, PoseStamped, PoseWithCovarianceStamped, TransformStamped.
struct StampedPose {
  Header header;      ///< its frame: what the pose is in
  std::string child;  ///< the body's frame; empty: the message does not say it
  Pose pose;          ///< frame_from_child, not checked
};
/// nav_msgs/Odometry, geometry_msgs/PoseStamped, PoseWithCovarianceStamped, TransformStamped.
[[nodiscard]] std::optional<StampedPose> read_pose(std::string_view type, MessageCursor message);
[[nodiscard]] bool is_pose_type(std::string_view type);
/// tf2_msgs/TFMessage, tf/tfMessage
[[nodiscard]] std::optional<std::vector<StampedPose>> read_transforms(MessageCursor message);
[[nodiscard]] bool is_transforms_type(std::string_view type);
/// nav_msgs/Path; the poses have the header's frame where they name none.
[[nodiscard]] std::optional<std::vector<StampedPose>> read_path(MessageCursor message);

/// sensor_msgs/LaserScan
struct LaserScan {
  Header header;  ///< its stamp: of the first ray
  float angle_min_rad = 0;
  float angle_increment_rad = 0;
  float time_increment_s = 0;
  float range_min_m = 0;
  float range_max_m = 0;
  std::vector<float> ranges_m;
  std::vector<float> intensities;
};
[[nodiscard]] std::optional<LaserScan> read_laser_scan(MessageCursor message);

/// sensor_msgs/JointState
struct JointState {
  Header header;
  std::vector<std::string> names;
  std::vector<double> positions;  ///< rad or m
};
[[nodiscard]] std::optional<JointState> read_joint_state(MessageCursor message);

/// Of any message that begins with one; the caller knows that its type does.
[[nodiscard]] std::optional<Header> read_header(MessageCursor message);
/// Whether the definition's first field, or the type itself, says that messages begin with a header.
[[nodiscard]] bool begins_with_header(const Channel& channel);

}  // namespace alces::bags
