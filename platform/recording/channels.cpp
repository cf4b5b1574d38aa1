#include "alces_platform/recording/channels.h"

#include <algorithm>
#include <array>
#include <cstddef>

// A message that another one uses, in the form of ROS's concatenated definitions.
#define ALCES_USES(type, fields) \
  "================================================================================\nMSG: " type "\n" fields

#define ALCES_TIME ALCES_USES("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n")
#define ALCES_HEADER \
  ALCES_USES("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n") ALCES_TIME
#define ALCES_QUATERNION \
  ALCES_USES("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n")
#define ALCES_POSE                                                             \
  ALCES_USES("geometry_msgs/Pose", "Point position\nQuaternion orientation\n") \
  ALCES_USES("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n") ALCES_QUATERNION

namespace alces::recording {
namespace {

enum SchemaPlace : std::uint16_t {
  tick_schema,
  edge_schema,
  edges_lost_schema,
  link_schema,
  bytes_schema,
  scan_info_schema,
  cloud_schema,
  pose_schema,
  path_schema,
  loop_schema,
  graph_edge_schema,
  diagnostics_schema,
  stop_schema,
  transforms_schema,
  order_schema,
  sync_schema,
  can_frame_schema,
  can_fd_frame_schema,
  schema_count
};

constexpr std::array<mcap::Schema, schema_count> all_schemas = {{
    {"alces_msgs/msg/Tick",
     "# Time passed; a replay hands on its ticks between the same events.\n"
     "builtin_interfaces/Time stamp\n"  //
     ALCES_TIME},
    {"alces_msgs/msg/Edge",
     "# One edge on a GPIO line.\n"
     "builtin_interfaces/Time stamp\n"
     "uint8 channel\n"
     "uint8 line       # which of the configured lines, from 0\n"
     "bool is_rising\n"
     "uint32 sequence  # the kernel's count on this line, from 1; 0: not known\n"  //
     ALCES_TIME},
    {"alces_msgs/msg/EdgesLost",
     "# The kernel's buffer of edges overflowed.\n"
     "builtin_interfaces/Time stamp\n"
     "uint8 channel\n"
     "uint8 line\n"
     "uint32 lost_count  # 0: not known how many\n"  //
     ALCES_TIME},
    {"alces_msgs/msg/Link",
     "# A CAN bus, or a byte channel's line or connection, came up or went down.\n"
     "uint8 CAN=0\n"
     "uint8 BYTES=1\n"
     "builtin_interfaces/Time stamp\n"
     "uint8 medium\n"
     "uint8 channel  # CAN: the bus; BYTES: 0 laser a, 1 laser b, 2 GPS\n"
     "bool is_up\n"  //
     ALCES_TIME},
    {"alces_msgs/msg/Bytes",
     "# Bytes on a byte channel, as they came or went; stamp: of the last of them.\n"
     "builtin_interfaces/Time stamp\n"
     "uint8 channel  # 0 laser a, 1 laser b, 2 GPS\n"
     "bool is_sent\n"
     "uint8[] data\n"  //
     ALCES_TIME},
    {"alces_msgs/msg/ScanInfo",
     "# One assembled 3D scan, and what became of it.\n"
     "std_msgs/Header header  # stamp: the reference time\n"
     "uint32 number           # counted from 0 since the scanner started, incomplete ones included\n"
     "int64 begin_stamp_ns\n"
     "int64 end_stamp_ns\n"
     "bool was_mapped\n"
     "string verdict\n"
     "uint32 map_index        # where it is in the map, if it was mapped\n"
     "bool is_incomplete\n"
     "uint32 profiles\n"
     "uint32 profiles_missing\n"
     "uint32 rays_without_range\n"
     "uint32 points\n"
     "uint32 points_reduced\n"
     "float64 head_turn_rad\n"
     "float64 angle_sigma_rad\n"
     "bool has_odometry\n"
     "geometry_msgs/Pose odometry_from_body\n"
     "bool has_gps\n"
     "geometry_msgs/Point gps_position_m  # east, north, up of the first fix\n"  //
     ALCES_HEADER ALCES_POSE},
    {"sensor_msgs/msg/PointCloud2",
     "std_msgs/Header header\n"
     "uint32 height\n"
     "uint32 width\n"
     "PointField[] fields\n"
     "bool is_bigendian\n"
     "uint32 point_step\n"
     "uint32 row_step\n"
     "uint8[] data\n"
     "bool is_dense\n"  //
     ALCES_HEADER       //
         ALCES_USES(
             "sensor_msgs/PointField",
             "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n"
             "uint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n")},
    {"geometry_msgs/msg/PoseStamped",
     "std_msgs/Header header\n"
     "Pose pose\n"  //
     ALCES_HEADER ALCES_POSE},
    {"nav_msgs/msg/Path",
     "std_msgs/Header header\n"
     "geometry_msgs/PoseStamped[] poses\n"  //
     ALCES_HEADER                           //
         ALCES_USES("geometry_msgs/PoseStamped", "std_msgs/Header header\nPose pose\n") ALCES_POSE},
    {"alces_msgs/msg/Loop",
     "# A loop that was offered, closed or refused. first, last: scans by their place in the map.\n"
     "builtin_interfaces/Time stamp\n"
     "uint32 first\n"
     "uint32 last\n"
     "bool is_closed\n"
     "string verdict\n"
     "float64 distance_m\n"
     "float64 overlap\n"
     "float64 rms_m\n"
     "float64 mahalanobis2\n"
     "float64 correction_m\n"
     "float64 correction_rad\n"
     "uint32 iterations\n"  //
     ALCES_TIME},
    {"alces_msgs/msg/GraphEdge",
     "# An edge of the pose graph: the pose of to_scan seen from from_scan, and its variances,\n"
     "# those of translation along the axes of to_scan's body.\n"
     "builtin_interfaces/Time stamp\n"
     "uint32 from_scan\n"
     "uint32 to_scan\n"
     "bool closes_loop\n"
     "geometry_msgs/Pose from_from_to\n"
     "float64 variance_x_m2\n"
     "float64 variance_y_m2\n"
     "float64 variance_z_m2\n"
     "float64 variance_rotation_rad2\n"  //
     ALCES_TIME ALCES_POSE},
    {"diagnostic_msgs/msg/DiagnosticArray",
     "std_msgs/Header header\n"
     "DiagnosticStatus[] status\n"  //
     ALCES_HEADER                   //
         ALCES_USES(
             "diagnostic_msgs/DiagnosticStatus",
             "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\nstring message\n"
             "string hardware_id\nKeyValue[] values\n")
             ALCES_USES("diagnostic_msgs/KeyValue", "string key\nstring value\n")},
    {"alces_msgs/msg/Stop",
     "# The scanner was asked to stop; what devices do from here on is its end, no fault.\n"
     "builtin_interfaces/Time stamp\n"  //
     ALCES_TIME},
    {"tf2_msgs/msg/TFMessage",
     "geometry_msgs/TransformStamped[] transforms\n"  //
     ALCES_USES("geometry_msgs/TransformStamped",
                "std_msgs/Header header\nstring child_frame_id\nTransform transform\n")
         ALCES_USES("geometry_msgs/Transform", "Vector3 translation\nQuaternion rotation\n") ALCES_USES(
             "geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n") ALCES_QUATERNION ALCES_HEADER},
    {"alces_msgs/msg/MotorOrder",
     "# What a person, or the machine, said about the motor.\n"
     "uint8 PERMIT=0   # of the permit's socket\n"
     "uint8 RESET=1    # a motor that was given up begins anew\n"
     "uint8 RESUMED=2  # the machine was suspended\n"
     "builtin_interfaces/Time stamp\n"
     "uint8 order\n"
     "bool is_given  # of PERMIT\n"  //
     ALCES_TIME},
    {"alces_msgs/msg/SyncSent",
     "# A SYNC of ours left the CAN controller; stamp: of its echo.\n"
     "builtin_interfaces/Time stamp\n"
     "uint8 channel\n"  //
     ALCES_TIME},
    {"can_msgs/msg/Frame",
     "std_msgs/Header header\n"
     "uint32 id\n"
     "bool is_rtr\n"
     "bool is_extended\n"
     "bool is_error\n"
     "uint8 dlc\n"
     "uint8[8] data\n"  //
     ALCES_HEADER},
    {"alces_msgs/msg/CanFdFrame",
     "# A CAN frame that does not fit can_msgs/Frame: FD, up to 64 bytes.\n"
     "std_msgs/Header header\n"
     "uint32 id\n"
     "bool is_rtr\n"
     "bool is_extended\n"
     "bool is_error\n"
     "bool is_fd\n"
     "bool is_bit_rate_switched       # BRS\n"
     "bool is_error_state_indicated   # ESI\n"
     "uint8[] data\n"  //
     ALCES_HEADER},
}};

constexpr std::size_t fixed_channels = static_cast<std::size_t>(Topic::can_rx);

constexpr std::array<mcap::Channel, fixed_channels + topics_per_can_bus* maximum_can_buses> all_channels = {{
    {"/alces/tick", tick_schema},
    {"/alces/edges", edge_schema},
    {"/alces/edges_lost", edges_lost_schema},
    {"/alces/links", link_schema},
    {"/laser_a/rx", bytes_schema},
    {"/laser_a/tx", bytes_schema},
    {"/laser_b/rx", bytes_schema},
    {"/laser_b/tx", bytes_schema},
    {"/gps/rx", bytes_schema},
    {"/gps/tx", bytes_schema},
    {"/alces/scan_info", scan_info_schema},
    {"/alces/cloud", cloud_schema},
    {"/alces/pose", pose_schema},
    {"/alces/path", path_schema},
    {"/alces/loops", loop_schema},
    {"/alces/graph_edges", graph_edge_schema},
    {"/diagnostics", diagnostics_schema},
    {"/alces/stop", stop_schema},
    {"/tf", transforms_schema},
    {"/alces/orders", order_schema},
    {"/alces/syncs", sync_schema},
    {"/can0/rx", can_frame_schema},
    {"/can0/tx", can_frame_schema},
    {"/can0/rx_fd", can_fd_frame_schema},
    {"/can0/tx_fd", can_fd_frame_schema},
    {"/can1/rx", can_frame_schema},
    {"/can1/tx", can_frame_schema},
    {"/can1/rx_fd", can_fd_frame_schema},
    {"/can1/tx_fd", can_fd_frame_schema},
    {"/can2/rx", can_frame_schema},
    {"/can2/tx", can_frame_schema},
    {"/can2/rx_fd", can_fd_frame_schema},
    {"/can2/tx_fd", can_fd_frame_schema},
    {"/can3/rx", can_frame_schema},
    {"/can3/tx", can_frame_schema},
    {"/can3/rx_fd", can_fd_frame_schema},
    {"/can3/tx_fd", can_fd_frame_schema},
}};

}  // namespace

std::span<const mcap::Schema> schemas() {
  return all_schemas;
}

std::span<const mcap::Channel> channels(std::uint8_t can_bus_count) {
  const std::size_t buses = std::min(can_bus_count, maximum_can_buses);
  return std::span(all_channels).first(fixed_channels + topics_per_can_bus * buses);
}

}  // namespace alces::recording
