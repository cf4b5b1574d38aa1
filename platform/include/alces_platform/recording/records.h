// What a recording keeps besides events: the results of the mapping, in words of its own, so that neither
// writer nor reader knows the mapper. Texts and spans are the caller's; those that a reader hands out are
// valid until its next call.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include "alces/point.h"
#include "alces/pose.h"

namespace alces {

/// One assembled scan, and what became of it.
struct ScanRecord {
  std::uint32_t number = 0;  ///< as Scan::number
  std::int64_t reference_stamp_ns = 0;
  std::int64_t begin_stamp_ns = 0;
  std::int64_t end_stamp_ns = 0;
  bool was_mapped = false;
  std::string_view verdict;     ///< "mapped", or why not: "dropped: the mapper was busy"
  std::uint32_t map_index = 0;  ///< its place in the map, if it was mapped
  bool is_incomplete = false;
  std::uint32_t profiles = 0;
  std::uint32_t profiles_missing = 0;
  std::uint32_t rays_without_range = 0;
  std::uint32_t points = 0;
  std::uint32_t points_reduced = 0;
  double head_turn_rad = 0;
  double angle_sigma_rad = 0;
  bool has_odometry = false;
  Pose odometry_from_body;
  bool has_gps = false;
  Eigen::Vector3d gps_position_m = Eigen::Vector3d::Zero();
};

/// The reduced points of a mapped scan, body frame.
struct CloudRecord {
  std::int64_t stamp_ns = 0;
  std::span<const Point> points;
};

struct PoseRecord {
  std::int64_t stamp_ns = 0;
  Pose map_from_body;
};

/// The same pose as a transform from frame "body" to frame "map".
struct TransformRecord {
  std::int64_t stamp_ns = 0;
  Pose map_from_body;
};

/// The trajectory as it is after a loop was closed.
struct PathRecord {
  std::int64_t stamp_ns = 0;
  std::span<const std::int64_t> stamps_ns;  ///< one a pose, or none at all
  std::span<const Pose> map_from_body;
};

/// A loop that was offered, closed or refused.
struct LoopRecord {
  std::int64_t stamp_ns = 0;
  std::uint32_t first = 0;  ///< places in the map
  std::uint32_t last = 0;
  bool is_closed = false;
  std::string_view verdict;
  double distance_m = 0;
  double overlap = 0;
  double rms_m = 0;
  double mahalanobis2 = 0;
  double correction_m = 0;
  double correction_rad = 0;
  std::uint32_t iterations = 0;
};

struct GraphEdgeRecord {
  std::int64_t stamp_ns = 0;
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  bool closes_loop = false;
  Pose from_from_to;
  double x_m2 = 0;
  double y_m2 = 0;
  double z_m2 = 0;
  double rotation_rad2 = 0;
};

/// A line of diagnostics: a notice, or the counters of a part.
enum class DiagnosticLevel : std::uint8_t { ok = 0, warning = 1, error = 2, stale = 3 };

struct DiagnosticValue {
  std::string_view key;
  std::string_view value;
};

struct DiagnosticRecord {
  std::int64_t stamp_ns = 0;
  DiagnosticLevel level = DiagnosticLevel::ok;
  std::string_view name;     ///< the part: "motor", "recording"
  std::string_view message;  ///< for people
  std::span<const DiagnosticValue> values;
};

}  // namespace alces
