#include "alces_onboard/page/live_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>

namespace alces::onboard {
namespace {

template <typename Payload>
auto words_of(const Payload& payload) {
  std::array<std::uint32_t, ALCES_PAGE_WORDS(Payload)> words;
  std::memcpy(words.data(), &payload, sizeof payload);
  return words;
}

template <typename Payload>
void write(std::uint32_t* section, const Payload& payload) {
  const auto words = words_of(payload);
  alces_page_write(section, words.data(), words.size());
}

template <typename Payload>
void write_entry(std::uint32_t* entry, const Payload& payload) {
  const auto words = words_of(payload);
  alces_page_store(entry, words.data(), words.size());
}

alces_page_rigid rigid(const Pose& pose) {
  const Eigen::Vector3d& at = pose.translation_m;
  const Eigen::Quaterniond& turned = pose.rotation;
  return {{at.x(), at.y(), at.z()}, {turned.x(), turned.y(), turned.z(), turned.w()}};
}

void publish(alces_page_transform& transform, const Pose& pose, std::int64_t stamp_ns, std::int64_t now_ns,
             const Matrix6d& covariance) {
  ++transform.sequence;
  transform.stamp_ns = stamp_ns;
  transform.published_ns = now_ns;
  transform.parent_from_child = rigid(pose);
  std::copy_n(covariance.data(), covariance.size(), transform.covariance);  // symmetric: either order
}

void copy(const char* text, std::span<char> room) {
  const std::size_t length = std::min(std::strlen(text), room.size() - 1);
  std::ranges::fill(room, '\0');
  std::copy_n(text, length, room.begin());
}

Matrix6d covariance_of(const Mapper::PoseUncertainty& spread) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(spread.translation_m2 / 3);
  covariance.diagonal().tail<3>().setConstant(spread.rotation_rad2 / 3);
  return covariance;
}

}  // namespace

void LivePage::publish_node(const OdometryState& state) {
  nodes_seen_ = state.nodes;
  alces_page_node node{};
  node.sequence = ++odometry_.nodes;
  node.stamp_ns = state.node_stamp_ns;
  node.odom_from_body = rigid(state.node);
  node.is_connected = state.is_connected ? 1 : 0;
  odometry_.node_stamp_ns = state.node_stamp_ns;
  write_entry(page_.nodes[(node.sequence - 1) % ALCES_PAGE_NODES], node);
}

void LivePage::publish_odometry(const Odometry* odometry, const OdometryErrors& errors, std::int64_t now_ns) {
  odometry_.alive_ns = now_ns;
  if (odometry != nullptr) {
    const OdometryState state = odometry->state_at(now_ns);
    if (state.nodes != nodes_seen_) publish_node(state);
    odometry_.is_valid = state.is_valid ? 1 : 0;
    if (state.nodes != 0) {
      publish(odometry_.odom_from_body, state.odometry_from_body, state.stamp_ns, now_ns,
              odometry->uncertainty().covariance());
      std::copy_n(state.velocity.data(), state.velocity.size(), odometry_.velocity);
      odometry_.growth = {std::hypot(errors.way, errors.slip), errors.turn,
                          odometry->uncertainty().bias_rad_s(), errors.noise_rad_per_sqrt_s, errors.tilt_rad};
    }
  }
  write(page_.odometry, odometry_);
}

void LivePage::publish_status(const StatusReport& report, std::int64_t now_ns) {
  alces_page_status status{};
  status.updated_ns = now_ns;
  status.scans = report.scans;
  status.scans_mapped = report.scans_mapped;
  status.scans_dropped = report.scans_dropped;
  status.loops_closed = report.loops_closed;
  status.loops_refused = report.loops_refused;
  status.latency_median_ns = report.latency_median_ns;
  status.latency_worst_ns = report.latency_worst_ns;
  status.mapper_hung_ns = report.mapper_hung_ns;
  status.scans_per_s = report.scans_per_s;
  status.verdict = static_cast<std::uint32_t>(report.health.verdict);
  status.is_scanning = report.is_scanning ? 1 : 0;
  status.is_mapping = report.is_mapping ? 1 : 0;
  status.is_map_full = report.is_map_full ? 1 : 0;
  status.is_archive_stalled = report.is_archive_stalled ? 1 : 0;
  status.is_recording = report.is_recording ? 1 : 0;
  status.is_recording_stalled = report.is_recording_stalled ? 1 : 0;
  status.parts = report.health.parts;
  copy(report.phase, status.phase);
  copy(report.reason, status.reason);
  if (report.health.verdict != MapVerdict::good) copy(to_string(report.health.doubt), status.doubt);
  write(page_.status, status);
}

void LivePage::publish_loop(const LoopReport& loop, std::int64_t stamp_ns, std::int64_t now_ns) {
  alces_page_event event{};
  event.sequence = map_.events + 1;
  event.stamp_ns = stamp_ns;
  event.published_ns = now_ns;
  event.distance_m = loop.distance_m;
  event.correction_m = loop.correction_m;
  event.correction_rad = loop.correction_rad;
  event.is_closed = loop.verdict == LoopVerdict::closed ? 1 : 0;
  event.first_scan = loop.first;
  event.last_scan = loop.last;
  copy(to_string(loop.verdict), event.verdict);
  write_entry(page_.events[map_.events % ALCES_PAGE_EVENTS], event);
  ++map_.events;
  write(page_.map, map_);
}

void LivePage::publish_pose(const MapPose& pose, std::int64_t now_ns) {
  const Matrix6d covariance = covariance_of(pose.spread);
  publish(map_.map_from_body, pose.map_from_body, pose.stamp_ns, now_ns, covariance);
  if (pose.has_odometry) {
    map_.odom_from_body = rigid(pose.odometry_from_body);
    publish(map_.map_from_odom, pose.map_from_body * pose.odometry_from_body.inverse(), pose.stamp_ns, now_ns,
            covariance);
  }
  write(page_.map, map_);
}

}  // namespace alces::onboard
