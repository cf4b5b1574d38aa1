#include "standing_turns.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "alces_drivers/stamp.h"

namespace alces::offline {
namespace {

constexpr double full_turn_rad = 2 * std::numbers::pi;
/// A laser that sends at all sends at 5 Hz and more.
constexpr std::int64_t silence_ns = 300 * ns_per_ms;

}  // namespace

StandingTurns::StandingTurns(const StandingTurnsSettings& settings) : settings_(settings) {
  last_ns_.fill(no_stamp_ns);
}

// Whether a laser has been silent, or has not yet begun.
bool StandingTurns::is_gap(const PlacedProfile& profile) {
  bool has_gap = false;
  for (std::uint32_t laser = 0; laser < mounting_.laser_count; ++laser) {
    const bool is_heard = last_ns_[laser] != no_stamp_ns && profile.end_ns - last_ns_[laser] <= silence_ns;
    has_gap = has_gap || !is_heard;
  }
  return has_gap;
}

void StandingTurns::begin(const PlacedProfile& profile) {
  is_open_ = true;
  open_.clear();
  first_head_angle_rad_ = profile.begin_head_angle_rad;
  odometry_from_first_ = profile.odometry_from_begin_body;
}

void StandingTurns::on_placed_profile(const PlacedProfile& profile) {
  if (profile.laser >= mounting_.laser_count || profile.ranges_m.empty()) return;
  ++profiles_;
  ++profiles_of_[profile.laser];
  const bool knows_motion = profile.has_motion || settings_.is_vouched_for;
  if (!knows_motion) ++without_motion_;
  const bool had_gap = is_gap(profile);
  last_ns_[profile.laser] = std::max(last_ns_[profile.laser], profile.end_ns);
  if (had_gap || !has_stretch_) stretch_begin_rad_ = profile.begin_head_angle_rad;
  has_stretch_ = true;
  longest_turn_rad_ = std::max(longest_turn_rad_, std::abs(profile.end_head_angle_rad - stretch_begin_rad_));

  if (had_gap || !knows_motion) {
    close();
    return;
  }
  if (is_open_ && !settings_.is_vouched_for) {
    const Pose moved = odometry_from_first_.inverse() * profile.odometry_from_end_body;
    const bool has_moved =
        moved.translation_m.norm() > settings_.most_translation_m ||
        angle_between_rad(moved.rotation, Eigen::Quaterniond::Identity()) > settings_.most_rotation_rad;
    if (has_moved) close();
  }
  if (!is_open_) begin(profile);
  last_head_angle_rad_ = profile.end_head_angle_rad;
  const double turned_rad = std::abs(last_head_angle_rad_ - first_head_angle_rad_);
  longest_standing_turn_rad_ = std::max(longest_standing_turn_rad_, turned_rad);
  if (turned_rad > full_turn_rad * static_cast<double>(settings_.most_turns)) return;

  const LaserMounting& laser = mounting_.lasers[profile.laser];
  const double last = profile.ranges_m.size() > 1 ? static_cast<double>(profile.ranges_m.size() - 1) : 1;
  for (std::size_t ray = 0; ray < profile.ranges_m.size(); ++ray) {
    const float range_m = profile.ranges_m[ray];
    const bool is_wanted = range_m > 0 && range_m >= static_cast<float>(laser.minimum_range_m) &&
                           range_m <= static_cast<float>(laser.maximum_range_m);
    if (!is_wanted) continue;  // no echo, the vehicle itself, or NaN
    const double fraction = static_cast<double>(ray) / last;
    open_.push_back(
        {profile.begin_head_angle_rad +
             fraction * (profile.end_head_angle_rad - profile.begin_head_angle_rad),
         static_cast<float>(profile.first_angle_rad + profile.angle_step_rad * static_cast<double>(ray)),
         range_m, profile.laser, 0});
  }
}

void StandingTurns::close() {
  if (!is_open_) return;
  is_open_ = false;
  const double turned_rad = std::abs(last_head_angle_rad_ - first_head_angle_rad_);
  // A profile more or less at the seam does not matter.
  const auto turns =
      std::min(settings_.most_turns, static_cast<std::size_t>(std::floor(turned_rad / full_turn_rad + 0.01)));
  if (turns == 0) return;
  const double wanted_rad = full_turn_rad * static_cast<double>(turns);
  const auto stand = static_cast<std::uint32_t>(turns_.size());
  for (StandingRay& ray : open_) {
    if (std::abs(ray.head_angle_rad - first_head_angle_rad_) > wanted_rad) continue;
    ray.stand = stand;
    rays_.push_back(ray);
  }
  turns_.push_back(turns);
  open_.clear();
}

}  // namespace alces::offline
