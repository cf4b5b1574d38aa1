#include "alces_drivers/assembler/scan_assembler.h"

#include <algorithm>
#include <cmath>
#include <new>

namespace alces {
namespace {

constexpr std::int64_t future_ns = 10 * ns_per_s;  ///< past the last tick: a wrong stamp
constexpr double longest_profile_ns = 1e9;
constexpr double largest_angle_rad = 1e9;
/// The head may go back so far without having turned round: an index pulse corrected its angle.
constexpr double back_rad = 0.05;

}  // namespace

const char* to_string(AssemblerStatus status) {
  switch (status) {
    case AssemblerStatus::ok:
      return "ok";
    case AssemblerStatus::block_too_small:
      return "the block is smaller than memory_required()";
    case AssemblerStatus::block_misaligned:
      return "the block does not start on a 64-byte boundary";
    case AssemblerStatus::bad_config:
      return "a configuration value is out of its range";
  }
  return "unknown";
}

ScanAssembler::ScanAssembler(Arena& arena, const ScanAssemblerConfig& config, const HeadAngle& head,
                             const Motion* motion, ScanSink& sink, NoticePort& notices)
    : config_(config),
      memory_(arena, config.capacity),
      head_(&head),
      motion_(motion),
      sink_(&sink),
      notices_(notices, "assembler") {
  for (std::uint32_t slot = 0; slot < memory_.order.size(); ++slot) memory_.order[slot] = slot;
  const Eigen::Map<const Eigen::Vector3d> from_m(config_.own_box_from_m.data());
  const Eigen::Map<const Eigen::Vector3d> to_m(config_.own_box_to_m.data());
  has_own_box_ = (from_m.array() < to_m.array()).all();
  // The laser's way to the body's origin and from there to the farthest corner.
  double lever_m = 0;
  for (const LaserMounting& laser : config_.lasers) {
    lever_m = std::max(lever_m, laser.head_from_laser.translation_m.norm());
  }
  own_box_reach_m_ = lever_m + config_.body_from_head.translation_m.norm() +
                     from_m.cwiseAbs().cwiseMax(to_m.cwiseAbs()).norm();
}

ScanAssembler* ScanAssembler::create(std::span<std::byte> block, const ScanAssemblerConfig& config,
                                     const HeadAngle& head, const Motion* motion, ScanSink& sink,
                                     NoticePort& notices, AssemblerStatus& status) {
  status = AssemblerStatus::bad_config;
  if (validate(config) != nullptr) return nullptr;
  status = AssemblerStatus::block_misaligned;
  if (reinterpret_cast<std::uintptr_t>(block.data()) % Arena::alignment != 0) return nullptr;
  status = AssemblerStatus::block_too_small;
  if (block.size() < memory_required(config.capacity)) return nullptr;
  Arena arena(block);
  // The assembler itself lies at the front of its block; memory_required() counts it the same way.
  void* const place = arena.allocate<std::byte>(sizeof(ScanAssembler)).data();
  auto* const assembler = new (place) ScanAssembler(arena, config, head, motion, sink, notices);
  if (arena.overflowed()) return nullptr;
  status = AssemblerStatus::ok;
  return assembler;
}

void ScanAssembler::on_profile(const Profile& profile) {
  ++counters_.profiles;
  if (profile.laser >= config_.laser_count) {
    ++counters_.profiles_of_unknown_laser;
    return;
  }
  const double duration_ns = profile.count == 0 ? 0 : profile.ray_interval_ns * (profile.count - 1);
  const bool is_fan_good = profile.count > 0 && profile.count <= Profile::maximum_rays &&
                           std::abs(profile.first_angle_rad) < 100 && std::abs(profile.angle_step_rad) < 10;
  const bool is_time_good =
      duration_ns >= 0 && duration_ns <= longest_profile_ns && profile.first_ray_stamp_ns >= 0 &&
      profile.first_ray_stamp_ns <= latest_stamp_ns &&
      (ticked_ns_ == no_stamp_ns || profile.first_ray_stamp_ns - ticked_ns_ <= future_ns);
  if (!is_fan_good || !is_time_good) {
    ++counters_.profiles_absurd;
    return;
  }
  const std::int64_t end_ns = profile.first_ray_stamp_ns + static_cast<std::int64_t>(duration_ns);
  now_ns_ = std::max(now_ns_, end_ns);
  store(profile, end_ns);
  process(false);
}

void ScanAssembler::store(const Profile& profile, std::int64_t end_ns) {
  if (waiting_count_ == memory_.waiting.size()) {
    drop(counters_.profiles_without_room, NoticeKind::room, end_ns,
         "no room for waiting profiles: the oldest is given up");
    remove_oldest();
  }
  const std::uint32_t slot = memory_.order[waiting_count_];
  std::uint32_t place = waiting_count_;
  for (; place > 0 && memory_.waiting[memory_.order[place - 1]].begin_ns > profile.first_ray_stamp_ns;
       --place) {
    memory_.order[place] = memory_.order[place - 1];
  }
  memory_.order[place] = slot;
  ++waiting_count_;
  const std::uint32_t count = std::min(profile.count, config_.capacity.rays_per_profile);
  memory_.waiting[slot] = {
      profile.first_ray_stamp_ns, end_ns,       profile.first_angle_rad, profile.angle_step_rad, count,
      profile.count - count,      profile.laser};
  if (count < profile.count) {  // the last ray that there is room for
    memory_.waiting[slot].end_ns =
        profile.first_ray_stamp_ns + static_cast<std::int64_t>(profile.ray_interval_ns * (count - 1));
    notices_.raise(NoticeKind::rays, Severity::error, end_ns,
                   "profiles have more rays than rays_per_profile: the rest is left out; rays of a profile",
                   profile.count);
  }
  const std::span<float> ranges_m =
      memory_.ranges_m.subspan(std::size_t{slot} * config_.capacity.rays_per_profile, count);
  std::copy_n(profile.range_m.begin(), count, ranges_m.begin());
}

void ScanAssembler::remove_oldest() {
  const std::uint32_t slot = memory_.order[0];
  std::ranges::copy(memory_.order.subspan(1, waiting_count_ - 1), memory_.order.begin());
  --waiting_count_;
  memory_.order[waiting_count_] = slot;
}

void ScanAssembler::on_tick(std::int64_t now_ns) {
  if (now_ns < 0 || now_ns > latest_stamp_ns) return;
  if (ticked_ns_ != no_stamp_ns && now_ns < ticked_ns_ - clock_step_ns) {  // time ran backward
    finish();
    now_ns_ = now_ns;
  }
  ticked_ns_ = now_ns;
  now_ns_ = std::max(now_ns_, now_ns);
  process(false);
}

void ScanAssembler::finish() {
  process(true);
  close_scan(false);
  has_course_ = false;
}

void ScanAssembler::process(bool is_end) {
  while (waiting_count_ > 0 && is_settled(memory_.waiting[memory_.order[0]], is_end)) remove_oldest();
}

// The oldest profile is put in or dropped; false: it goes on waiting.
bool ScanAssembler::is_settled(const Waiting& profile, bool is_end) {
  if (!is_end && now_ns_ - profile.end_ns < config_.settle_ns) return false;
  const bool is_due = is_end || now_ns_ - profile.end_ns > config_.maximum_wait_ns;
  Course course;
  course.begin_angle = head_->angle_at(profile.begin_ns);
  course.end_angle = head_->angle_at(profile.end_ns);
  const auto either_is = [&course](AngleStatus status) {
    return course.begin_angle.status == status || course.end_angle.status == status;
  };
  if (either_is(AngleStatus::lost) || either_is(AngleStatus::too_old)) {
    const char* const said = was_angle_known_ ? "the head's angle is lost: profiles are dropped" : nullptr;
    drop(counters_.profiles_angle_lost, NoticeKind::lost, profile.end_ns, said);
    return true;
  }
  if (either_is(AngleStatus::not_yet)) {
    if (!is_due) return false;
    drop(counters_.profiles_angle_late, NoticeKind::late, profile.end_ns,
         "the head's angle does not become known in time: profiles are dropped");
    return true;
  }
  was_angle_known_ = true;
  if (!ask_motion(profile, is_due, course)) return false;
  const double angle_rad = course.middle_angle_rad();
  if (!(std::abs(angle_rad) < largest_angle_rad) ||
      !(std::abs(course.begin_angle.angle_rad - angle_rad) < 1)) {
    drop(counters_.profiles_absurd, NoticeKind::lost, profile.end_ns,
         "the head's angle is absurd: profiles are dropped");
    return true;
  }
  if (!is_head_moving(angle_rad, profile.end_ns)) {
    ++counters_.profiles_head_standing;
  } else if (!find_scan(profile, angle_rad)) {
    ++counters_.profiles_late;
  } else {
    const std::size_t slot = memory_.order[0];
    put_in(profile, memory_.ranges_m.subspan(slot * config_.capacity.rays_per_profile, profile.count),
           course);
  }
  return true;
}

void ScanAssembler::drop(std::uint64_t& counter, NoticeKind kind, std::int64_t stamp_ns, const char* text) {
  ++counter;
  open_.is_broken = true;
  ++open_.dropped;
  if (text != nullptr)
    notices_.raise(kind, Severity::warning, stamp_ns, text, static_cast<std::int64_t>(counter));
}

bool ScanAssembler::ask_motion(const Waiting& profile, bool is_due, Course& course) {
  if (motion_ == nullptr) return true;
  const MotionAnswer begin = motion_->pose_at(profile.begin_ns);
  const MotionAnswer end = motion_->pose_at(profile.end_ns);
  const bool waits = begin.status == MotionStatus::not_yet || end.status == MotionStatus::not_yet;
  if (waits && !is_due) return false;
  course.has_motion = begin.status == MotionStatus::ok && end.status == MotionStatus::ok &&
                      is_valid(begin.odometry_from_body) && is_valid(end.odometry_from_body);
  course.odometry_from_begin_body = begin.odometry_from_body;
  course.odometry_from_end_body = end.odometry_from_body;
  return true;
}

void ScanAssembler::begin_course(double angle_rad, std::int64_t stamp_ns) {
  has_course_ = true;
  course_ = 0;
  extreme_angle_rad_ = moved_angle_rad_ = angle_rad;
  moved_ns_ = stamp_ns;
}

// Follows the head; closes the open scan when it stops or turns round. False: it stands.
bool ScanAssembler::is_head_moving(double angle_rad, std::int64_t stamp_ns) {
  if (!has_course_) {
    begin_course(angle_rad, stamp_ns);
    is_standing_ = true;  // until it is seen to move
    return false;
  }
  if (std::abs(angle_rad - moved_angle_rad_) >= config_.stop_angle_rad) {
    if (is_standing_) {
      const double from_rad = moved_angle_rad_;
      begin_course(from_rad, stamp_ns);
      is_standing_ = false;
    }
    moved_angle_rad_ = angle_rad;
    moved_ns_ = stamp_ns;
  } else if (!is_standing_ && stamp_ns - moved_ns_ > config_.stop_after_ns) {
    is_standing_ = true;
    ++counters_.head_stops;
    notices_.raise(NoticeKind::standing, Severity::warning, stamp_ns,
                   "the head stands: no scans until it turns again");
    close_scan(false);
  }
  if (is_standing_) return false;
  const double ahead_rad = angle_rad - extreme_angle_rad_;
  if (course_ == 0) {
    course_ = ahead_rad < 0 ? std::int8_t{-1} : std::int8_t{1};
    extreme_angle_rad_ = angle_rad;
  } else if (ahead_rad * course_ >= 0) {
    extreme_angle_rad_ = angle_rad;
  } else if (std::abs(ahead_rad) > std::max(back_rad, config_.stop_angle_rad)) {
    ++counters_.head_reversals;
    notices_.raise(NoticeKind::reversed, Severity::warning, stamp_ns,
                   "the head turned round: a scan ends early");
    close_scan(false);
    course_ = static_cast<std::int8_t>(-course_);
    extreme_angle_rad_ = angle_rad;
  }
  return true;
}

double ScanAssembler::boundary_of(std::int64_t piece, int end) const {
  const bool is_upper = (course_ >= 0) == (end == 1);
  return config_.boundary_rad + config_.turn_rad * static_cast<double>(piece + (is_upper ? 1 : 0));
}

// Closes and opens scans, so that the open one is the profile's. False: its scan is over.
bool ScanAssembler::find_scan(const Waiting& profile, double angle_rad) {
  const auto piece =
      static_cast<std::int64_t>(std::floor((angle_rad - config_.boundary_rad) / config_.turn_rad));
  if (open_.profiles > 0) {
    const std::int64_t pieces_ahead = (piece - open_.piece) * course_;
    if (pieces_ahead == 0) return true;
    if (pieces_ahead < 0) {
      // Just short of the boundary that the head has passed: an index pulse set its angle back a little.
      return std::abs(angle_rad - boundary_of(open_.piece, 0)) <= back_rad;
    }
    counters_.scans_skipped += static_cast<std::uint64_t>(pieces_ahead - 1);
    close_scan(true);
  }
  const std::uint32_t dropped = open_.dropped;
  open_ = {};
  open_.piece = piece;
  open_.begin_ns = profile.begin_ns;
  open_.first_angle_rad = angle_rad;
  open_.dropped = dropped;
  open_.is_broken =
      dropped > 0 || std::abs(angle_rad - boundary_of(piece, 0)) > config_.boundary_tolerance_rad;
  return true;
}

void ScanAssembler::put_in(const Waiting& profile, std::span<float> ranges_m, const Course& course) {
  Pose frame_from_begin;
  Pose frame_from_end;
  if (course.has_motion) {
    if (!open_.has_frame) open_.odometry_from_frame = course.odometry_from_begin_body;
    open_.has_frame = true;
    open_.last_odometry = course.odometry_from_end_body;
  } else if (motion_ != nullptr) {
    ++counters_.profiles_without_motion;
    notices_.raise(NoticeKind::motion, Severity::warning, profile.end_ns,
                   "no odometry: scans are made as if the vehicle stood");
  }
  if (config_.deskew && open_.has_frame) {
    const Pose frame_from_odometry = open_.odometry_from_frame.inverse();
    const bool is_known = course.has_motion;
    frame_from_begin =
        frame_from_odometry * (is_known ? course.odometry_from_begin_body : open_.last_odometry);
    frame_from_end = frame_from_odometry * (is_known ? course.odometry_from_end_body : open_.last_odometry);
  }
  ++counters_.profiles_used;
  ++open_.profiles;
  open_.end_ns = std::max(open_.end_ns, profile.end_ns);
  open_.begin_ns = std::min(open_.begin_ns, profile.begin_ns);
  open_.last_angle_rad = course.middle_angle_rad();
  open_.sigma_rad = std::max({open_.sigma_rad, course.begin_angle.sigma_rad, course.end_angle.sigma_rad});
  counters_.rays += profile.count + profile.excess;
  counters_.rays_without_room += profile.excess;
  mask_rays(profile, course.middle_angle_rad(), ranges_m);
  if (observer_ != nullptr) {
    observer_->on_placed_profile({profile.laser, profile.begin_ns, profile.end_ns, profile.first_angle_rad,
                                  profile.angle_step_rad, ranges_m, course.begin_angle.angle_rad,
                                  course.end_angle.angle_rad, course.has_motion,
                                  course.odometry_from_begin_body, course.odometry_from_end_body});
  }
  const std::uint32_t points_before = open_.points;
  const std::uint64_t without_room_before = counters_.rays_without_room;
  project(profile, ranges_m, course, frame_from_begin, frame_from_end);
  if (counters_.rays_without_room > without_room_before) {
    notices_.raise(NoticeKind::points, Severity::error, profile.end_ns,
                   "a scan has more points than points_per_scan: the rest is left out; points that there is "
                   "room for",
                   static_cast<std::int64_t>(memory_.points.size()));
  }
  counters_.points += open_.points - points_before;
}

void ScanAssembler::close_scan(bool is_whole) {
  if (open_.profiles == 0) return;
  const bool is_end_reached =
      std::abs(open_.last_angle_rad - boundary_of(open_.piece, 1)) <= config_.boundary_tolerance_rad;
  Scan scan;
  scan.is_incomplete =
      !is_whole || open_.is_broken || !is_end_reached || open_.profiles < config_.minimum_profiles;
  scan.number = next_number_++;
  scan.begin_stamp_ns = open_.begin_ns;
  scan.end_stamp_ns = open_.end_ns;
  scan.reference_stamp_ns = open_.begin_ns + (open_.end_ns - open_.begin_ns) / 2;
  scan.profiles = open_.profiles;
  scan.profiles_missing = std::max(
      open_.dropped, config_.expected_profiles - std::min(open_.profiles, config_.expected_profiles));
  scan.rays_without_range = open_.rays_without_range;
  scan.head_turn_rad = std::abs(open_.last_angle_rad - open_.first_angle_rad);
  scan.angle_sigma_rad = open_.sigma_rad;
  if (open_.has_frame) {
    const MotionAnswer answer = motion_->pose_at(scan.reference_stamp_ns);
    scan.has_odometry = answer.status == MotionStatus::ok && is_valid(answer.odometry_from_body);
    scan.odometry_from_body = scan.has_odometry
                                  ? answer.odometry_from_body
                                  : interpolate(open_.odometry_from_frame, open_.last_odometry, 0.5);
    if (config_.deskew) move_points(scan.odometry_from_body.inverse() * open_.odometry_from_frame);
  }
  if (gps_ != nullptr) {
    const auto position_m = gps_->position_at(scan.reference_stamp_ns, config_.gps_maximum_age_ns);
    scan.has_gps = position_m.has_value();
    if (position_m) scan.gps_position_m = *position_m;
  }
  scan.points = memory_.points.first(open_.points);
  ++counters_.scans;
  counters_.profiles_missing += scan.profiles_missing;
  if (!scan.has_odometry) ++counters_.scans_without_odometry;
  if (scan.is_incomplete) {
    ++counters_.scans_incomplete;
    notices_.raise(NoticeKind::incomplete, Severity::info, scan.end_stamp_ns,
                   "a scan is incomplete; profiles in it", scan.profiles);
  }
  open_ = {};
  sink_->on_scan(scan);
}

}  // namespace alces
