// What a recording holds: its topics, the ROS 2 message of each, and the messages' full definitions.
//
// | topic | message |
// |---|---|
// | /alces/tick | alces_msgs/msg/Tick |
// | /alces/edges, /alces/edges_lost | alces_msgs/msg/Edge, EdgesLost |
// | /alces/links | alces_msgs/msg/Link |
// | /laser_a/rx, /laser_a/tx, /laser_b/..., /gps/... | alces_msgs/msg/Bytes |
// | /can0/rx, /can0/tx, ... | can_msgs/msg/Frame |
// | /can0/rx_fd, /can0/tx_fd, ... | alces_msgs/msg/CanFdFrame: what does not fit can_msgs/msg/Frame |
// | /alces/scan_info | alces_msgs/msg/ScanInfo |
// | /alces/cloud | sensor_msgs/msg/PointCloud2 |
// | /alces/pose, /alces/path | geometry_msgs/msg/PoseStamped, nav_msgs/msg/Path |
// | /tf | tf2_msgs/msg/TFMessage: every pose once more, for programs that place clouds by transforms |
// | /alces/loops, /alces/graph_edges | alces_msgs/msg/Loop, GraphEdge |
// | /diagnostics | diagnostic_msgs/msg/DiagnosticArray |
// | /alces/stop | alces_msgs/msg/Stop |
// | /alces/orders, /alces/syncs | alces_msgs/msg/MotorOrder, SyncSent |
//
// All of them in event order: a message's log_time is when it was handed on and never decreases, its
// publish_time is the event's own stamp. Both are nanoseconds of CLOCK_MONOTONIC; the metadata record says
// what to add for UTC.
#pragma once

#include <cstdint>
#include <span>

#include "alces_platform/recording/mcap_writer.h"

namespace alces::recording {

inline constexpr std::uint8_t maximum_can_buses = 4;

enum class Topic : std::uint8_t {
  tick,
  edges,
  edges_lost,
  links,
  laser_a_rx,  ///< byte channel c: laser_a_rx + 2 c received, one more sent
  laser_a_tx,
  laser_b_rx,
  laser_b_tx,
  gps_rx,
  gps_tx,
  scan_info,
  cloud,
  pose,
  path,
  loops,
  graph_edges,
  diagnostics,
  stop,
  transforms,
  orders,
  syncs,
  can_rx,  ///< bus b: four more each
  can_tx,
  can_rx_fd,
  can_tx_fd,
};
inline constexpr std::uint8_t topics_per_can_bus = 4;

/// All schemas; the channels of a vehicle with so many CAN buses (at most maximum_can_buses), in the order of
/// Topic.
[[nodiscard]] std::span<const mcap::Schema> schemas();
[[nodiscard]] std::span<const mcap::Channel> channels(std::uint8_t can_bus_count);

/// The metadata record and the attachment that every recording has.
inline constexpr std::string_view metadata_name = "alces";
inline constexpr std::string_view configuration_name = "vehicle.toml";
inline constexpr std::string_view format_version = "1";
/// Keys of the metadata record.
inline constexpr std::string_view format_key = "format";
inline constexpr std::string_view clock_key = "clock";
inline constexpr std::string_view utc_offset_key =
    "utc_offset_ns";  ///< UTC = stamp + this, when recording began

}  // namespace alces::recording
