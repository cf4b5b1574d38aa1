// A short drive with everything in it that a recording can hold: for the unit tests, and for the readers that
// others wrote. The same on every run.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "alces_drivers/scanner/event.h"
#include "alces_drivers/stamp.h"
#include "alces_platform/recording/recording_writer.h"

namespace alces::sample {

inline constexpr std::int64_t begin_ns = 1608 * ns_per_s + 12'345'678;
inline constexpr const char* configuration = "[laser_a]\nmake = \"LMS 291\"\n";
inline constexpr std::int64_t utc_offset_ns = 1'700'000'000'123'456'789;

/// Holds an event's bytes as well.
struct OwnedEvent {
  Event event;
  std::vector<std::uint8_t> bytes;
};

inline OwnedEvent event_at(std::uint32_t i) {
  OwnedEvent owned;
  Event& event = owned.event;
  event.stamp_ns = begin_ns + std::int64_t{i} * 1'234'567;
  switch (i % 13) {
    case 0:
      if (i / 13 % 10 == 9) event.kind = EventKind::stop;
      if (i / 13 % 10 == 8) {
        event.kind = EventKind::sync_sent;
        event.channel = static_cast<std::uint8_t>(i / 130 % 2);
      }
      if (i / 13 % 10 == 7) {
        event.kind = EventKind::order;
        event.order = static_cast<MotorOrder>(i / 130 % 3);
        event.is_up = i / 130 % 2 == 1;
      }
      break;
    case 1:
    case 2:
      event.kind = i % 13 == 1 ? EventKind::can_frame : EventKind::can_sent;
      event.channel = static_cast<std::uint8_t>(i / 13 % 2);
      event.frame.id = 0x181 + i % 3;
      event.frame.size = static_cast<std::uint8_t>(i % 9);
      for (std::uint8_t b = 0; b < event.frame.size; ++b)
        event.frame.data[b] = static_cast<std::uint8_t>(i + b);
      event.stamp_ns -= 700'000;  // the kernel's stamp lies before the hand-over
      break;
    case 3:
      event.kind = EventKind::can_frame;
      event.frame.is_extended = true;
      event.frame.id = 0x1234'5678;
      event.frame.is_remote = true;
      event.frame.size = 4;
      break;
    case 4:
      event.kind = EventKind::can_frame;
      event.frame.is_error = true;
      event.frame.id = 0x204;
      event.frame.size = 8;
      event.frame.data[1] = 0x10;
      break;
    case 5:
      event.kind = EventKind::can_frame;
      event.frame.id = 0x7ff;
      event.frame.is_fd = true;
      event.frame.is_bit_rate_switched = true;
      event.frame.is_error_state_indicated = i % 2 == 0;
      event.frame.size = i % 2 == 0 ? 64 : 12;
      for (std::uint8_t b = 0; b < event.frame.size; ++b)
        event.frame.data[b] = static_cast<std::uint8_t>(3 * b);
      break;
    case 6:
    case 7:
      event.kind = EventKind::edge;
      event.edge.line = static_cast<std::uint8_t>(i % 3);
      event.edge.is_rising = i % 2 == 0;
      event.edge.sequence = 1 + i / 13;
      break;
    case 8:
      event.kind = EventKind::edges_lost;
      event.edge.line = 1;
      event.lost_count = i;
      break;
    case 9:
    case 10:
    case 11:
      event.kind = i % 13 == 10 ? EventKind::bytes_sent : EventKind::bytes;
      event.channel = static_cast<std::uint8_t>(i % 3);
      for (std::uint32_t b = 0; b < 5 + i % 100; ++b)
        owned.bytes.push_back(static_cast<std::uint8_t>(i * 7 + b));
      event.bytes = owned.bytes;
      break;
    default:
      event.kind = i % 2 == 0 ? EventKind::can_link : EventKind::byte_link;
      event.channel = static_cast<std::uint8_t>(i % 2);
      event.is_up = i % 4 < 2;
      break;
  }
  return owned;
}

inline bool same(const Event& a, const Event& b) {
  return a.stamp_ns == b.stamp_ns && a.kind == b.kind && a.channel == b.channel && a.is_up == b.is_up &&
         a.order == b.order && a.lost_count == b.lost_count && a.edge == b.edge && a.frame == b.frame &&
         std::vector<std::uint8_t>(a.bytes.begin(), a.bytes.end()) ==
             std::vector<std::uint8_t>(b.bytes.begin(), b.bytes.end());
}

inline Pose pose_at(std::uint32_t i) {
  Pose pose;
  pose.translation_m = {0.5 * i, -0.25 * i, 0.125};
  pose.rotation = Eigen::AngleAxisd(0.01 * i, Eigen::Vector3d::UnitZ());
  return pose;
}

/// The results of scan `number`, among the events. No heap here: it may be forbidden.
inline void write_results(RecordingWriter& writer, std::uint32_t number) {
  const std::int64_t stamp_ns = begin_ns + std::int64_t{number} * 20'000'000;
  ScanRecord scan;
  scan.number = number;
  scan.reference_stamp_ns = stamp_ns;
  scan.begin_stamp_ns = stamp_ns - 1000;
  scan.end_stamp_ns = stamp_ns + 1001;
  scan.was_mapped = number % 4 != 3;
  scan.verdict = scan.was_mapped ? "mapped" : "dropped: the mapper was busy";
  scan.map_index = number - number / 4;
  scan.is_incomplete = number % 5 == 0;
  scan.profiles = 90;
  scan.profiles_missing = 2;
  scan.rays_without_range = 17;
  scan.points = 181 * 90;
  scan.points_reduced = 10;
  scan.head_turn_rad = 3.25;
  scan.angle_sigma_rad = 0.001;
  scan.has_odometry = true;
  scan.odometry_from_body = pose_at(number);
  scan.has_gps = number % 2 == 0;
  scan.gps_position_m = {1, 2, 3};
  writer.write_scan_info(scan);

  std::array<Point, 10> points{};
  for (std::uint32_t i = 0; i < points.size(); ++i)
    points[i] = {static_cast<float>(i), static_cast<float>(number), -1.5F};
  writer.write_cloud({stamp_ns, points});
  writer.write_pose({stamp_ns, pose_at(number)});
  GraphEdgeRecord edge;
  edge.stamp_ns = stamp_ns;
  edge.from = number;
  edge.to = number + 1;
  edge.closes_loop = number == 7;
  edge.from_from_to = pose_at(1);
  edge.x_m2 = 0.01;
  edge.y_m2 = 0.02;
  edge.z_m2 = 0.03;
  edge.rotation_rad2 = 0.04;
  writer.write_edge(edge);
  if (number % 4 == 2) {
    LoopRecord loop;
    loop.stamp_ns = stamp_ns;
    loop.first = 1;
    loop.last = number;
    loop.is_closed = true;
    loop.verdict = "closed";
    loop.distance_m = 3.5;
    loop.overlap = 0.75;
    loop.rms_m = 0.03;
    loop.mahalanobis2 = 4;
    loop.correction_m = 1.25;
    loop.correction_rad = 0.1;
    loop.iterations = 11;
    writer.write_loop(loop);
    std::array<Pose, 4> poses{};
    std::array<std::int64_t, 4> stamps_ns{};
    for (std::uint32_t i = 0; i < 4; ++i) {
      poses[i] = pose_at(i);
      stamps_ns[i] = begin_ns + i;
    }
    writer.write_path({stamp_ns, stamps_ns, poses});
    writer.write_notice({stamp_ns, Severity::warning, "motor", "an emergency message came", 0x6320, true});
    writer.write_counters(stamp_ns, "recording", writer.file_counters());
  }
}

/// `count` events, the results of a scan after every 20th.
inline void record(RecordingWriter& writer, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) {
    writer.on_event(event_at(i).event);
    if (i % 20 == 19) write_results(writer, i / 20);
  }
}

}  // namespace alces::sample
