// Profiles, the head's angle and the vehicle's motion, put together to 3D scans with the motion taken out.
//
// A ray goes through these frames, each at the ray's own time:
//   laser   its scan plane is x-y, rays turn about z (profile.h)
//   head    head_from_laser: where the laser sits on the head, fixed; the head turns about its z axis
//   body    body_from_head: the head at angle 0, fixed
//   begin   the body at the scan's first profile, by odometry: in this frame points are gathered
//   scan    the body at the scan's reference time, the middle, known when the scan is over: one pass over
//           the points brings them there (9 multiplications a point; the price of not asking for a second
//           buffer)
//
// A profile waits until the angle and the motion at its begin and its end are known (at most
// maximum_wait_ns), and settle_ns in any case, so that two lasers' profiles go in by their time and not by
// their arrival. The angle is asked for at the begin and the end of a profile and is linear in between, as is
// the motion (screw-like: translation linear, rotation by slerp). Head and vehicle turn so little within a
// profile that the transform is worked out at a few knots and is linear, coefficient by coefficient, between
// them: off by at most
//   range * (turn between knots)^2 / 8   <= interpolation_error_m at maximum_range_m
// as long as 16 pieces a profile are enough: with the values below, up to 0.1 rad of turn in a profile.
//
// A scan is a piece of the head's turn between fixed angles: boundary_rad + k * turn_rad. It is incomplete
// when it did not begin and end there (start-up, stop, reversal, an angle that was lost), when fewer than
// minimum_profiles are in it, or a profile of it was dropped. Incomplete scans are handed on too, marked.
// While the head stands, profiles are counted and left out.
//
// Without odometry (null, or stale) a scan is made as if the vehicle stood; has_odometry is then false.
//
// Memory: one block from the caller, memory_required(capacity) bytes; waiting profiles take 4 bytes a ray,
// points 12. Time: about 3 us a profile of 181 rays on a desk PC, all in; O(waiting profiles) more when they
// come out of order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "alces/arena.h"
#include "alces_drivers/assembler/placed_profile.h"
#include "alces_drivers/assembler/scan.h"
#include "alces_drivers/encoder/head_angle.h"
#include "alces_drivers/gps/gps_position.h"
#include "alces_drivers/notice_rate_limiter.h"
#include "alces_drivers/odometry/motion.h"
#include "alces_drivers/scanner/profile.h"
#include "alces_drivers/stamp.h"

namespace alces {

/// Rays that see the vehicle itself (or must be left out for another reason): all conditions together. Angles
/// are those of the laser's plane and of the head; an interval may run through +-pi, and one of 2 pi or more
/// is all.
struct RayMask {
  double ray_from_rad = 0;
  double ray_to_rad = 0;
  double head_from_rad = 0;
  double head_to_rad = 7;
  double maximum_range_m = 1e9;  ///< only what is nearer
};

struct LaserMounting {
  static constexpr std::uint32_t maximum_masks = 8;

  Pose head_from_laser;
  double minimum_range_m = 0.1;
  double maximum_range_m = 40;
  std::array<RayMask, maximum_masks> masks{};
  std::uint32_t mask_count = 0;
};

/// What is fixed when memory is handed over.
struct ScanAssemblerCapacity {
  std::uint32_t rays_per_profile = 181;  ///< at most Profile::maximum_rays
  std::uint32_t waiting_profiles = 64;   ///< profiles a second * lasers * the longest wait
  std::uint32_t points_per_scan = 65536;
};

struct ScanAssemblerConfig {
  static constexpr std::uint32_t maximum_lasers = 2;

  ScanAssemblerCapacity capacity;
  std::uint32_t laser_count = 1;
  std::array<LaserMounting, maximum_lasers> lasers{};
  Pose body_from_head;

  double turn_rad = 3.14159265358979323846;  ///< of the head in a scan: half a turn, or a full one
  double boundary_rad = 0;                   ///< a head's angle at which scans begin
  bool deskew = true;                        ///< false: points as if the vehicle stood during a scan
  /// Points in this box are the vehicle's own: body frame at the ray's time. Empty (the default): none are.
  std::array<double, 3> own_box_from_m{0, 0, 0};
  std::array<double, 3> own_box_to_m{0, 0, 0};

  std::uint32_t expected_profiles =
      0;                               ///< of a whole scan, of all lasers; 0: missing ones are not looked for
  std::uint32_t minimum_profiles = 0;  ///< with fewer the scan is incomplete
  double boundary_tolerance_rad = 0.1;  ///< the first and last profile may be so far from the boundary
  std::int64_t settle_ns = 40 * ns_per_ms;
  std::int64_t maximum_wait_ns = ns_per_s;
  double stop_angle_rad = 0.02;               ///< a head that turns less ...
  std::int64_t stop_after_ns = ns_per_s / 2;  ///< ... in this time stands
  double interpolation_error_m = 2e-4;
  std::int64_t gps_maximum_age_ns = 2 * ns_per_s;
};

/// Null, or one clause that names the value that cannot be.
[[nodiscard]] const char* validate(const ScanAssemblerConfig& config);

struct ScanAssemblerCounters {
  std::uint64_t profiles = 0;
  std::uint64_t profiles_used = 0;
  std::uint64_t profiles_of_unknown_laser = 0;
  std::uint64_t profiles_absurd = 0;        ///< stamps or angles that cannot be
  std::uint64_t profiles_without_room = 0;  ///< the waiting room was full: the oldest was given up
  std::uint64_t profiles_angle_late = 0;    ///< the angle did not become known in time
  std::uint64_t profiles_angle_lost = 0;    ///< the head's angle was lost, not known yet, or is too old
  std::uint64_t profiles_late = 0;          ///< came when their scan was over
  std::uint64_t profiles_head_standing = 0;
  std::uint64_t profiles_without_motion = 0;  ///< used as if the vehicle stood
  std::uint64_t profiles_missing = 0;         ///< of the scans that were over, against expected_profiles
  std::uint64_t rays = 0;                     ///< of used profiles; each is a point or one of the following
  std::uint64_t rays_without_range = 0;
  std::uint64_t rays_not_finite = 0;
  std::uint64_t rays_too_near = 0;
  std::uint64_t rays_too_far = 0;
  std::uint64_t rays_masked = 0;
  std::uint64_t rays_without_room = 0;  ///< beyond points_per_scan, or beyond rays_per_profile
  std::uint64_t points = 0;
  std::uint64_t scans = 0;
  std::uint64_t scans_incomplete = 0;
  std::uint64_t scans_without_odometry = 0;
  std::uint64_t scans_skipped = 0;  ///< pieces of the head's turn without a single profile
  std::uint64_t head_stops = 0;
  std::uint64_t head_reversals = 0;

  template <class Visitor>
  void visit(Visitor&& visit) const {
    visit("profiles", profiles);
    visit("profiles_used", profiles_used);
    visit("profiles_of_unknown_laser", profiles_of_unknown_laser);
    visit("profiles_absurd", profiles_absurd);
    visit("profiles_without_room", profiles_without_room);
    visit("profiles_angle_late", profiles_angle_late);
    visit("profiles_angle_lost", profiles_angle_lost);
    visit("profiles_late", profiles_late);
    visit("profiles_head_standing", profiles_head_standing);
    visit("profiles_without_motion", profiles_without_motion);
    visit("profiles_missing", profiles_missing);
    visit("rays", rays);
    visit("rays_without_range", rays_without_range);
    visit("rays_not_finite", rays_not_finite);
    visit("rays_too_near", rays_too_near);
    visit("rays_too_far", rays_too_far);
    visit("rays_masked", rays_masked);
    visit("rays_without_room", rays_without_room);
    visit("points", points);
    visit("scans", scans);
    visit("scans_incomplete", scans_incomplete);
    visit("scans_without_odometry", scans_without_odometry);
    visit("scans_skipped", scans_skipped);
    visit("head_stops", head_stops);
    visit("head_reversals", head_reversals);
  }
};

enum class AssemblerStatus : std::uint8_t { ok, block_too_small, block_misaligned, bad_config };
[[nodiscard]] const char* to_string(AssemblerStatus status);

class ScanAssembler final : public ProfileSink {
 public:
  /// Bytes that create() needs; constexpr, so that it can size a static array.
  [[nodiscard]] static constexpr std::size_t memory_required(const ScanAssemblerCapacity& capacity);

  /// Lays an assembler out in `block` (64-byte aligned), which must outlive it, as must all that is referred
  /// to. `motion` null: no odometry. Null, and `status` says why; validate(config) says what is wrong with
  /// bad_config.
  [[nodiscard]] static ScanAssembler* create(std::span<std::byte> block, const ScanAssemblerConfig& config,
                                             const HeadAngle& head, const Motion* motion, ScanSink& sink,
                                             NoticePort& notices, AssemblerStatus& status);

  /// Takes a copy and puts in what is ready; may call the sink.
  void on_profile(const Profile& profile) override;
  /// Time passes; may call the sink. At least every 20 ms.
  void on_tick(std::int64_t now_ns);
  /// The stream ends: what waits is put in or dropped, the open scan is handed on as incomplete.
  void finish();

  /// Who is asked for the GPS position at a scan's reference time, with gps_maximum_age_ns; null: nobody. It
  /// outlives the assembler.
  void ask_for_positions(const GpsPosition* gps) { gps_ = gps; }

  /// Tells `observer` of every profile that goes into a scan, before the scan is handed on; null: nobody. The
  /// observer outlives the assembler.
  void observe_profiles(PlacedProfileSink* observer) { observer_ = observer; }

  [[nodiscard]] const ScanAssemblerCounters& counters() const { return counters_; }
  [[nodiscard]] std::uint32_t waiting_profiles() const { return waiting_count_; }

 private:
  enum class NoticeKind : std::uint8_t {
    room,
    rays,
    points,
    late,
    lost,
    standing,
    reversed,
    incomplete,
    motion,
    count
  };
  static constexpr std::uint32_t maximum_knots = 17;

  /// A profile that waits; its ranges lie in the slot of the same number.
  struct Waiting {
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;
    double first_angle_rad = 0;
    double angle_step_rad = 0;
    std::uint32_t count = 0;
    std::uint32_t excess = 0;  ///< rays for which there was no room
    std::uint8_t laser = 0;
  };
  struct Direction {
    float x = 0;
    float y = 0;
  };
  struct Memory {
    constexpr Memory(Arena& arena, const ScanAssemblerCapacity& capacity)
        : waiting(arena.allocate<Waiting>(capacity.waiting_profiles)),
          order(arena.allocate<std::uint32_t>(capacity.waiting_profiles)),
          ranges_m(arena.allocate<float>(std::size_t{capacity.waiting_profiles} * capacity.rays_per_profile)),
          directions(arena.allocate<Direction>(std::size_t{capacity.rays_per_profile} *
                                               ScanAssemblerConfig::maximum_lasers)),
          points(arena.allocate<Point>(capacity.points_per_scan)) {}
    std::span<Waiting> waiting;
    std::span<std::uint32_t> order;  ///< slots by time, the first waiting_count_ in use, the rest free
    std::span<float> ranges_m;
    std::span<Direction> directions;  ///< of the rays, a part for each laser
    std::span<Point> points;
  };
  /// For which rays `directions` holds.
  struct DirectionKey {
    double first_angle_rad = 0;
    double angle_step_rad = 0;
    std::uint32_t count = 0;
  };
  /// What a ray needs of the transform from the laser's frame, at one time.
  struct Knot {
    Eigen::Vector3d x_axis = Eigen::Vector3d::UnitX();
    Eigen::Vector3d y_axis = Eigen::Vector3d::UnitY();
    Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
    void set(const Pose& pose);
  };
  /// Head and vehicle at the first and the last ray of a profile.
  struct Course {
    AngleAnswer begin_angle;
    AngleAnswer end_angle;
    Pose odometry_from_begin_body;
    Pose odometry_from_end_body;
    bool has_motion = false;
    [[nodiscard]] double middle_angle_rad() const {
      return 0.5 * (begin_angle.angle_rad + end_angle.angle_rad);
    }
  };
  struct OpenScan {
    bool is_broken = false;  ///< not begun at its boundary, or a profile was dropped
    bool has_frame = false;  ///< odometry_from_frame is known
    std::int64_t piece = 0;  ///< which piece of the head's turn
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;
    double first_angle_rad = 0;
    double last_angle_rad = 0;
    double sigma_rad = 0;
    std::uint32_t profiles = 0;
    std::uint32_t dropped = 0;
    std::uint32_t points = 0;
    std::uint32_t rays_without_range = 0;
    Pose odometry_from_frame;  ///< the body when motion was first known in this scan
    Pose last_odometry;        ///< goes on where motion is not known
  };

  ScanAssembler(Arena& arena, const ScanAssemblerConfig& config, const HeadAngle& head, const Motion* motion,
                ScanSink& sink, NoticePort& notices);

  // scan_assembler.cpp: waiting, scans
  void store(const Profile& profile, std::int64_t end_ns);
  void remove_oldest();
  void process(bool is_end);
  [[nodiscard]] bool is_settled(const Waiting& profile, bool is_end);
  void drop(std::uint64_t& counter, NoticeKind kind, std::int64_t stamp_ns, const char* text);
  [[nodiscard]] bool ask_motion(const Waiting& profile, bool is_due, Course& course);
  [[nodiscard]] bool is_head_moving(double angle_rad, std::int64_t stamp_ns);
  void begin_course(double angle_rad, std::int64_t stamp_ns);
  [[nodiscard]] bool find_scan(const Waiting& profile, double angle_rad);
  void put_in(const Waiting& profile, std::span<float> ranges_m, const Course& course);
  void close_scan(bool is_whole);
  /// The begin (0) or end (1) of a piece, in the direction that the head turns.
  [[nodiscard]] double boundary_of(std::int64_t piece, int end) const;

  // scan_projection.cpp: rays to points
  void mask_rays(const Waiting& profile, double head_angle_rad, std::span<float> ranges_m);
  void project(const Waiting& profile, std::span<const float> ranges_m, const Course& course,
               const Pose& frame_from_begin, const Pose& frame_from_end);
  void project_piece(const Waiting& profile, std::span<const float> ranges_m, std::uint32_t first_ray,
                     std::uint32_t last_ray, const Knot* frame, const Knot* body);
  [[nodiscard]] std::span<const Direction> directions_of(const Waiting& profile);
  void count_without_point(float range_m, float nearest_m);
  [[nodiscard]] bool is_own(const Eigen::Vector3d& point_body_m) const;
  void move_points(const Pose& reference_from_frame);

  ScanAssemblerConfig config_;
  Memory memory_;
  const HeadAngle* head_;
  const Motion* motion_;
  ScanSink* sink_;
  const GpsPosition* gps_ = nullptr;
  PlacedProfileSink* observer_ = nullptr;
  NoticeRateLimiter<NoticeKind> notices_;
  ScanAssemblerCounters counters_;

  std::uint32_t waiting_count_ = 0;
  std::array<DirectionKey, ScanAssemblerConfig::maximum_lasers> direction_keys_{};
  std::int64_t now_ns_ = no_stamp_ns;
  std::int64_t ticked_ns_ = no_stamp_ns;
  bool has_own_box_ = false;
  double own_box_reach_m_ = 0;  ///< no own point is farther from the laser than this

  OpenScan open_;
  std::uint32_t next_number_ = 0;

  // The head's course.
  bool has_course_ = false;
  bool was_angle_known_ = false;  ///< before it is, profiles without an angle are nothing to warn of
  bool is_standing_ = false;
  std::int8_t course_ = 0;        ///< +1, -1, 0: not yet known
  double extreme_angle_rad_ = 0;  ///< the farthest along the course
  double moved_angle_rad_ = 0;    ///< where it last had moved by stop_angle_rad
  std::int64_t moved_ns_ = 0;
};

constexpr std::size_t ScanAssembler::memory_required(const ScanAssemblerCapacity& capacity) {
  Arena arena;
  arena.allocate<std::byte>(sizeof(ScanAssembler));
  const Memory memory(arena, capacity);
  return arena.overflowed() || !memory.points.empty() ? SIZE_MAX : arena.used_bytes();
}

}  // namespace alces
