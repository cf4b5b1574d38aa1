#include "alces_onboard/status_report.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <numbers>

namespace alces::onboard {
namespace {

class Line {
 public:
  explicit Line(std::span<char> room) : room_(room) {}

  __attribute__((format(printf, 2, 3))) void add(const char* format, ...) {
    if (room_.size() <= size_ + 1) return;
    std::va_list arguments;
    va_start(arguments, format);
    const int count = std::vsnprintf(room_.data() + size_, room_.size() - size_, format, arguments);
    va_end(arguments);
    if (count > 0) size_ = std::min(size_ + static_cast<std::size_t>(count), room_.size() - 1);
  }
  [[nodiscard]] std::string_view text() const { return {room_.data(), size_}; }

 private:
  std::span<char> room_;
  std::size_t size_ = 0;
};

/// From here on a pose is not shown as if it were of now.
constexpr std::int64_t old_pose_ns = 3 * ns_per_s;

double megabytes(std::uint64_t bytes) {
  return static_cast<double>(bytes) * 1e-6;
}

double heading_deg(const Pose& map_from_body) {
  const Eigen::Vector3d forward = map_from_body.rotation * Eigen::Vector3d::UnitX();
  return std::atan2(forward.y(), forward.x()) * 180 / std::numbers::pi;
}

}  // namespace

std::string_view format(const StatusReport& report, std::span<char> room) {
  if (room.empty()) return {};
  Line line(room);
  line.add("%s", report.phase);
  if (report.reason[0] != '\0') line.add(" (%s)", report.reason);
  line.add(": %.2f scans/s", report.scans_per_s);
  if (report.is_mapping) {
    line.add(", %u of %u mapped", report.scans_mapped, report.scan_capacity);
    if (report.is_map_full) line.add(", MAP FULL");
    if (report.has_pose) {
      const Eigen::Vector3d& at = report.map_from_body.translation_m;
      line.add(" | at %.1f %.1f %.1f m, %.0f deg", at.x(), at.y(), at.z(), heading_deg(report.map_from_body));
      if (report.pose_age_ns >= old_pose_ns) line.add(", %.0f s AGO", seconds(report.pose_age_ns));
    }
    if (report.mapper_hung_ns > 0) line.add(" | MAPPER HANGS for %.0f s", seconds(report.mapper_hung_ns));
    if (report.is_archive_stalled) line.add(" | ARCHIVE STALLED");
    line.add(" | %u loops", report.loops_closed);
    if (report.has_loop) {
      const LoopReport& loop = report.last_loop;
      if (loop.verdict == LoopVerdict::closed) {
        line.add(", last %u-%u moved %.2f m", loop.first, loop.last, loop.correction_m);
      } else {
        line.add(", last %u-%u refused", loop.first, loop.last);
      }
    }
    if (report.has_pose) {
      const MapHealth& health = report.health;
      line.add(" | %s %s", health.verdict == MapVerdict::bad ? "MAP" : "map",
               health.verdict == MapVerdict::bad ? "BAD" : to_string(health.verdict));
      if (health.verdict != MapVerdict::good) line.add(": %s", to_string(health.doubt));
      if (health.parts > 1) line.add(", %u parts", health.parts);
      if (health.on_odometry > 0) line.add(", %u steps on odometry", health.on_odometry);
    }
    if (report.latency_worst_ns > 0)
      line.add(" | poses %.2f s late, worst %.2f", seconds(report.latency_median_ns),
               seconds(report.latency_worst_ns));
    line.add(" | queue %zu/%zu, %llu dropped", report.waiting_scans, report.scan_slots,
             static_cast<unsigned long long>(report.scans_dropped));  // NOLINT(google-runtime-int): printf's
    line.add(" | pool %.1f of %.1f MB", megabytes(report.pool_used_bytes), megabytes(report.pool_bytes));
    if (report.archive_bytes > 0) line.add(", archive %.1f MB", megabytes(report.archive_bytes));
  } else {
    line.add(", not mapping");
  }
  if (report.bus.name[0] != '\0') {
    line.add(" | %s %s %.0f frames/s, %llu errors", report.bus.name, report.bus.state, report.frames_per_s,
             static_cast<unsigned long long>(report.bus.errors));  // NOLINT(google-runtime-int): printf's
  }
  if (report.is_recording_stalled) {
    line.add(" | RECORDING STALLED at %.1f MB", megabytes(report.recording_bytes));
  } else if (report.is_recording) {
    line.add(" | recorded %.1f MB", megabytes(report.recording_bytes));
  } else {
    line.add(" | not recording");
  }
  return line.text();
}

}  // namespace alces::onboard
