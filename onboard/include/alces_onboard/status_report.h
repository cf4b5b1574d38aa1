// How the vehicle is, once a second: what the status line, systemd and a person on the vehicle see.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "alces/mapper.h"
#include "alces/pose.h"
#include "alces_drivers/stamp.h"

namespace alces::onboard {

/// A CAN bus as its user sees it.
struct BusHealth {
  const char* name = "";   ///< "can0"; empty: there is none
  const char* state = "";  ///< "error-active", "bus-off"
  std::uint64_t frames = 0;
  std::uint64_t errors = 0;  ///< error frames, receive overflows, frames that could not be sent
};

struct StatusReport {
  const char* phase = "";
  bool is_scanning = false;
  const char* reason = "";  ///< what the phase waits for, or what is wrong; may be empty
  double scans_per_s = 0;
  std::uint64_t scans = 0;  ///< assembled
  std::uint64_t scans_dropped = 0;
  std::uint64_t scans_incomplete = 0;

  bool is_mapping = false;
  bool is_map_full = false;
  std::uint32_t scans_mapped = 0;
  std::uint32_t scan_capacity = 0;
  bool has_pose = false;
  Pose map_from_body;               ///< of the newest scan in the map, when it was matched
  std::int64_t pose_age_ns = 0;     ///< since the time that the pose is of
  std::int64_t mapper_hung_ns = 0;  ///< the mapper has not come back from a scan for so long; 0: it comes
  bool is_archive_stalled = false;  ///< cannot be written
  MapHealth health;                 ///< of a map that has a pose
  std::uint32_t loops_closed = 0;
  std::uint32_t loops_refused = 0;
  std::int64_t latency_median_ns = 0;  ///< from a scan's last ray to its pose, loop and all; 0: none yet
  std::int64_t latency_worst_ns = 0;
  bool has_loop = false;
  LoopReport last_loop;
  std::size_t waiting_scans = 0;
  std::size_t scan_slots = 0;
  std::uint64_t pool_used_bytes = 0;
  std::uint64_t pool_bytes = 0;
  std::uint64_t archive_bytes = 0;

  BusHealth bus;
  double frames_per_s = 0;

  bool is_recording = false;
  bool is_recording_stalled = false;
  std::uint64_t recording_bytes = 0;
};

/// One line, without its end, e.g.
///   scanning: 0.83 scans/s, 412 of 10000 mapped | at 12.3 -4.5 0.1 m, 87 deg | 5 loops, last 17-402 moved
///   0.34 m | map good | poses 0.31 s late, worst 0.62 | queue 1/4, 0 dropped | pool 12.3 of 33.1 MB |
///   can0 1240 frames/s, 0 errors | recorded 153.2 MB
/// A pose that is older than three seconds has its age behind it: "at 12.3 -4.5 0.1 m, 87 deg, 12 s AGO".
/// What does not fit `room` is cut. No heap, no locale.
[[nodiscard]] std::string_view format(const StatusReport& report, std::span<char> room);

}  // namespace alces::onboard
