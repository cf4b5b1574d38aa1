// Rays to points: the scan assembler's inner loops.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "alces/portable_math.h"
#include "alces_drivers/assembler/scan_assembler.h"

namespace alces {
namespace {

constexpr double full_turn_rad = 2 * std::numbers::pi;
/// In a waiting profile: left out by a mask.
constexpr float masked_range_m = -3e38F;

/// Whether the angle lies in the interval, modulo full turns.
bool is_within(double angle_rad, double from_rad, double to_rad) {
  if (to_rad - from_rad >= full_turn_rad) return true;
  const double past_rad =
      angle_rad - from_rad - full_turn_rad * std::floor((angle_rad - from_rad) / full_turn_rad);
  return past_rad <= to_rad - from_rad;
}

}  // namespace

void ScanAssembler::Knot::set(const Pose& pose) {
  const Eigen::Matrix3d axes = pose.rotation.toRotationMatrix();
  x_axis = axes.col(0);
  y_axis = axes.col(1);
  origin_m = pose.translation_m;
}

void ScanAssembler::mask_rays(const Waiting& profile, double head_angle_rad, std::span<float> ranges_m) {
  const LaserMounting& laser = config_.lasers[profile.laser];
  for (std::uint32_t m = 0; m < laser.mask_count; ++m) {
    const RayMask& mask = laser.masks[m];
    if (!is_within(head_angle_rad, mask.head_from_rad, mask.head_to_rad)) continue;
    const auto most_m = static_cast<float>(std::min(mask.maximum_range_m, 1e9));
    for (std::uint32_t ray = 0; ray < profile.count; ++ray) {
      const bool is_candidate = ranges_m[ray] > 0 && ranges_m[ray] < most_m;
      if (!is_candidate) continue;
      const double angle_rad = profile.first_angle_rad + profile.angle_step_rad * ray;
      if (is_within(angle_rad, mask.ray_from_rad, mask.ray_to_rad)) ranges_m[ray] = masked_range_m;
    }
  }
}

std::span<const ScanAssembler::Direction> ScanAssembler::directions_of(const Waiting& profile) {
  DirectionKey& key = direction_keys_[profile.laser];
  const std::span<Direction> directions = memory_.directions.subspan(
      std::size_t{profile.laser} * config_.capacity.rays_per_profile, config_.capacity.rays_per_profile);
  const bool is_same = key.count >= profile.count && key.first_angle_rad == profile.first_angle_rad &&
                       key.angle_step_rad == profile.angle_step_rad;
  if (!is_same) {
    key = {profile.first_angle_rad, profile.angle_step_rad, profile.count};
    for (std::uint32_t ray = 0; ray < profile.count; ++ray) {
      const double angle_rad = profile.first_angle_rad + profile.angle_step_rad * ray;
      const auto [sine, cosine] = portable::sine_cosine(angle_rad);
      directions[ray] = {static_cast<float>(cosine), static_cast<float>(sine)};
    }
  }
  return directions.first(profile.count);
}

void ScanAssembler::project(const Waiting& profile, std::span<const float> ranges_m, const Course& course,
                            const Pose& frame_from_begin, const Pose& frame_from_end) {
  const LaserMounting& laser = config_.lasers[profile.laser];
  const double head_turn_rad = course.end_angle.angle_rad - course.begin_angle.angle_rad;
  const double body_turn_rad = angle_between_rad(frame_from_begin.rotation, frame_from_end.rotation);
  const double turn_between_knots_rad = std::sqrt(8 * config_.interpolation_error_m / laser.maximum_range_m);
  const double pieces_wanted = std::ceil((std::abs(head_turn_rad) + body_turn_rad) / turn_between_knots_rad);
  const auto pieces = static_cast<std::uint32_t>(
      std::clamp(pieces_wanted, 1.0, static_cast<double>(std::min(maximum_knots - 1, profile.count))));

  // Knots lie on rays: piece p runs from ray first(p) to ray first(p + 1).
  const std::uint32_t last_ray = profile.count - 1;
  const auto knot_ray = [&](std::uint32_t knot) { return last_ray * knot / pieces; };
  std::array<Knot, 2> frame;
  std::array<Knot, 2> body;
  const auto set_knot = [&](std::uint32_t knot) {
    const double fraction = last_ray == 0 ? 0.0 : static_cast<double>(knot_ray(knot)) / last_ray;
    const double angle_rad = course.begin_angle.angle_rad + fraction * head_turn_rad;
    Pose turned;
    turned.rotation = exp_so3({0, 0, angle_rad});
    const Pose body_from_laser = config_.body_from_head * (turned * laser.head_from_laser);
    body[1].set(body_from_laser);
    frame[1].set(interpolate(frame_from_begin, frame_from_end, fraction) * body_from_laser);
  };
  set_knot(0);
  for (std::uint32_t piece = 0; piece < pieces; ++piece) {
    frame[0] = frame[1];
    body[0] = body[1];
    set_knot(piece + 1);
    // The last piece has its end ray too.
    const std::uint32_t end = knot_ray(piece + 1) + (piece + 1 == pieces ? 1 : 0);
    project_piece(profile, ranges_m.first(end), knot_ray(piece), knot_ray(piece + 1), frame.data(),
                  body.data());
  }
}

void ScanAssembler::project_piece(const Waiting& profile, std::span<const float> ranges_m,
                                  std::uint32_t first_ray, std::uint32_t last_ray, const Knot* frame,
                                  const Knot* body) {
  const LaserMounting& laser = config_.lasers[profile.laser];
  const std::span<const Direction> directions = directions_of(profile);
  const double step = last_ray == first_ray ? 0.0 : 1.0 / (last_ray - first_ray);
  const Knot change{frame[1].x_axis - frame[0].x_axis, frame[1].y_axis - frame[0].y_axis,
                    frame[1].origin_m - frame[0].origin_m};
  const auto nearest_m = static_cast<float>(laser.minimum_range_m);
  const auto farthest_m = static_cast<float>(laser.maximum_range_m);
  std::uint32_t count = open_.points;
  for (std::size_t ray = first_ray; ray < ranges_m.size(); ++ray) {
    const float range = ranges_m[ray];
    const bool is_measured = range > 0 && range >= nearest_m && range <= farthest_m;
    if (!is_measured) {
      count_without_point(range, nearest_m);
      continue;
    }
    const auto range_m = static_cast<double>(range);
    const double fraction = static_cast<double>(ray - first_ray) * step;
    const double x_m = range_m * static_cast<double>(directions[ray].x);
    const double y_m = range_m * static_cast<double>(directions[ray].y);
    if (has_own_box_ && range_m <= own_box_reach_m_) {
      const Eigen::Vector3d begin_m = body[0].origin_m + x_m * body[0].x_axis + y_m * body[0].y_axis;
      const Eigen::Vector3d end_m = body[1].origin_m + x_m * body[1].x_axis + y_m * body[1].y_axis;
      if (is_own(begin_m + fraction * (end_m - begin_m))) {
        ++counters_.rays_masked;
        continue;
      }
    }
    if (count == memory_.points.size()) {
      ++counters_.rays_without_room;
      continue;
    }
    const Eigen::Vector3d base_m = frame[0].origin_m + x_m * frame[0].x_axis + y_m * frame[0].y_axis;
    const Eigen::Vector3d change_m = change.origin_m + x_m * change.x_axis + y_m * change.y_axis;
    const Eigen::Vector3d point_m = base_m + fraction * change_m;
    memory_.points[count++] = {static_cast<float>(point_m.x()), static_cast<float>(point_m.y()),
                               static_cast<float>(point_m.z())};
  }
  open_.points = count;
}

void ScanAssembler::count_without_point(float range_m, float nearest_m) {
  if (range_m == 0) {
    ++counters_.rays_without_range;
    ++open_.rays_without_range;
  } else if (range_m == masked_range_m) {
    ++counters_.rays_masked;
  } else if (!std::isfinite(range_m)) {
    ++counters_.rays_not_finite;
  } else {
    ++(range_m < nearest_m || range_m < 0 ? counters_.rays_too_near : counters_.rays_too_far);
  }
}

bool ScanAssembler::is_own(const Eigen::Vector3d& point_body_m) const {
  const Eigen::Map<const Eigen::Vector3d> from_m(config_.own_box_from_m.data());
  const Eigen::Map<const Eigen::Vector3d> to_m(config_.own_box_to_m.data());
  return (point_body_m.array() >= from_m.array()).all() && (point_body_m.array() <= to_m.array()).all();
}

void ScanAssembler::move_points(const Pose& reference_from_frame) {
  const Eigen::Matrix3d rotation = reference_from_frame.rotation.toRotationMatrix();
  for (Point& point : memory_.points.first(open_.points)) {
    const Eigen::Vector3d there_m(static_cast<double>(point.x), static_cast<double>(point.y),
                                  static_cast<double>(point.z));
    const Eigen::Vector3d here_m = rotation * there_m + reference_from_frame.translation_m;
    point = {static_cast<float>(here_m.x()), static_cast<float>(here_m.y()), static_cast<float>(here_m.z())};
  }
}

}  // namespace alces
