#include "alces_drivers/assembler/scan_assembler.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <new>
#include <numbers>

#include "alces_drivers/encoder/encoder.h"
#include "alces_drivers/odometry/odometry.h"
#include "alces_platform/sim/random.h"
#include "drivers/notice_log.h"

using namespace alces;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double speed_rad_s = 2.618;
constexpr std::int64_t begin_ns = 20 * ns_per_s;
constexpr std::int64_t profile_ns = 13'333'333;  // 75 a second
constexpr double ray_interval_ns = 37'037;       // 180 degrees in half a turn of the mirror

double since_s(std::int64_t stamp_ns) {
  return seconds(stamp_ns - begin_ns);
}

/// The head's angle as a function of time, known a little later.
struct FunctionHead final : HeadAngle {
  std::function<double(double)> angle_rad = [](double t_s) { return 0.3 + speed_rad_s * t_s; };
  std::int64_t known_until_ns = INT64_MAX;
  std::int64_t lost_from_ns = INT64_MAX;
  std::int64_t lost_to_ns = INT64_MAX;
  [[nodiscard]] AngleAnswer angle_at(std::int64_t stamp_ns) const override {
    if (stamp_ns > known_until_ns) return {AngleStatus::not_yet, 0, 0};
    if (stamp_ns >= lost_from_ns && stamp_ns < lost_to_ns) return {AngleStatus::lost, 0, 0};
    return {AngleStatus::ok, angle_rad(since_s(stamp_ns)), 1e-4};
  }
};

/// A vehicle that drives curves and ramps, in closed form.
struct FunctionMotion final : Motion {
  std::function<Pose(double)> pose = [](double t_s) {
    Pose odometry_from_body;
    odometry_from_body.rotation = Eigen::AngleAxisd(0.4 * t_s, Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(0.05 * std::sin(t_s), Eigen::Vector3d::UnitY());
    odometry_from_body.translation_m = {1.6 * std::sin(t_s), 1.6 * (1 - std::cos(t_s)),
                                        0.1 * std::sin(0.7 * t_s)};
    return odometry_from_body;
  };
  std::int64_t stale_from_ns = INT64_MAX;
  [[nodiscard]] MotionAnswer pose_at(std::int64_t stamp_ns) const override {
    if (stamp_ns >= stale_from_ns) return {MotionStatus::stale, {}, false};
    return {MotionStatus::ok, pose(since_s(stamp_ns)), false};
  }
};

Pose still(double /*t_s*/) {
  return {};
}

struct KeptScan {
  Scan scan;  ///< points is empty
  std::vector<Point> points;
};

struct Keeper final : ScanSink {
  void on_scan(const Scan& scan) override {
    scans.push_back({scan, {scan.points.begin(), scan.points.end()}});
    scans.back().scan.points = {};
  }
  std::vector<KeptScan> scans;
};

/// A room with its walls at +-12 m, +-9 m and its floor and ceiling at -2 and 6 m.
const Eigen::Vector3d room_low_m(-12, -9, -2);
const Eigen::Vector3d room_high_m(12, 9, 6);

double distance_to_wall_m(const Eigen::Vector3d& point_m) {
  return std::min((point_m - room_low_m).cwiseAbs().minCoeff(),
                  (point_m - room_high_m).cwiseAbs().minCoeff());
}

double range_in_room_m(const Eigen::Vector3d& from_m, const Eigen::Vector3d& direction) {
  double range_m = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) continue;
    const double wall_m = direction[axis] > 0 ? room_high_m[axis] : room_low_m[axis];
    range_m = std::min(range_m, (wall_m - from_m[axis]) / direction[axis]);
  }
  return range_m;
}

/// The scan plane upright, rays from straight down to straight up, a little off the head's axis.
Pose mounting(double yaw_rad) {
  Pose head_from_laser;
  head_from_laser.rotation = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(pi / 2, Eigen::Vector3d::UnitX());
  head_from_laser.translation_m = head_from_laser.rotation * Eigen::Vector3d(0.08, 0.05, 0.01);
  return head_from_laser;
}

struct World {
  FunctionHead head;
  FunctionMotion motion;
  Keeper keeper;
  NoticeLog log;
  ScanAssemblerConfig config;
  std::vector<std::byte> memory;
  ScanAssembler* assembler = nullptr;
  bool has_motion = true;

  World() {
    config.lasers[0].head_from_laser = mounting(0.2);
    config.lasers[1].head_from_laser = mounting(0.2 + pi);
    config.body_from_head.translation_m = {0.3, -0.1, 0.9};
    config.body_from_head.rotation = Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitY());
  }

  ScanAssembler& make() {
    const std::size_t bytes = ScanAssembler::memory_required(config.capacity);
    memory.assign(bytes + Arena::alignment, std::byte{0xA5});
    void* place = memory.data();
    std::size_t room = memory.size();
    REQUIRE(std::align(Arena::alignment, bytes, place, room) != nullptr);
    AssemblerStatus status = AssemblerStatus::bad_config;
    assembler = ScanAssembler::create({static_cast<std::byte*>(place), bytes}, config, head,
                                      has_motion ? &motion : nullptr, keeper, log, status);
    REQUIRE(status == AssemblerStatus::ok);
    REQUIRE(assembler != nullptr);
    return *assembler;
  }

  /// What the laser measures in the room in the sweep that begins then.
  [[nodiscard]] Profile measure(std::int64_t first_ns, std::uint8_t laser = 0) const {
    Profile profile;
    profile.first_ray_stamp_ns = first_ns;
    profile.ray_interval_ns = ray_interval_ns;
    profile.first_angle_rad = -pi / 2;
    profile.angle_step_rad = pi / 180;
    profile.laser = laser;
    profile.count = 181;
    for (std::uint32_t ray = 0; ray < profile.count; ++ray) {
      const double t_s = since_s(first_ns) + ray * ray_interval_ns * 1e-9;
      Pose turned;
      turned.rotation = Eigen::AngleAxisd(head.angle_rad(t_s), Eigen::Vector3d::UnitZ());
      const Pose room_from_laser =
          motion.pose(t_s) * config.body_from_head * turned * config.lasers[laser].head_from_laser;
      const double angle_rad = profile.first_angle_rad + profile.angle_step_rad * ray;
      const Eigen::Vector3d direction =
          room_from_laser.rotation * Eigen::Vector3d(std::cos(angle_rad), std::sin(angle_rad), 0);
      profile.range_m[ray] = static_cast<float>(range_in_room_m(room_from_laser.translation_m, direction));
    }
    return profile;
  }

  /// Profiles of all lasers from one time to another, and ticks.
  void run(double from_s, double to_s) {
    const auto stamp = [](double t_s) { return begin_ns + static_cast<std::int64_t>(t_s * 1e9); };
    for (std::int64_t t = stamp(from_s); t < stamp(to_s); t += profile_ns) {
      for (std::uint8_t laser = 0; laser < config.laser_count; ++laser) {
        assembler->on_profile(measure(t + laser * 5 * ns_per_ms, laser));
      }
      assembler->on_tick(t + profile_ns);
    }
  }

  /// The farthest that a scan's points are from the walls.
  [[nodiscard]] double worst_m(const KeptScan& kept) const {
    double worst = 0;
    const Pose room_from_body = motion.pose(since_s(kept.scan.reference_stamp_ns));
    for (const Point& point : kept.points) {
      worst =
          std::max(worst, distance_to_wall_m(room_from_body * Eigen::Vector3d(static_cast<double>(point.x),
                                                                              static_cast<double>(point.y),
                                                                              static_cast<double>(point.z))));
    }
    return worst;
  }
};

std::uint64_t rays_accounted_for(const ScanAssemblerCounters& counters) {
  return counters.points + counters.rays_without_range + counters.rays_not_finite + counters.rays_too_near +
         counters.rays_too_far + counters.rays_masked + counters.rays_without_room;
}

constexpr std::size_t planned_bytes = ScanAssembler::memory_required(ScanAssemblerCapacity{});
static_assert(planned_bytes > 65536 * sizeof(Point));

}  // namespace

TEST_CASE("deskewed points lie on the walls of the room, however the vehicle moves") {
  World world;
  world.make();
  world.run(0, 8);
  REQUIRE(world.keeper.scans.size() >= 6);
  for (const KeptScan& kept : world.keeper.scans) {
    CAPTURE(kept.scan.number);
    CHECK(world.worst_m(kept) < 1e-3);
    CHECK(kept.scan.has_odometry);
    const Pose truth = world.motion.pose(since_s(kept.scan.reference_stamp_ns));
    CHECK((kept.scan.odometry_from_body.translation_m - truth.translation_m).norm() < 1e-9);
    if (kept.scan.number == 0) continue;
    CHECK_FALSE(kept.scan.is_incomplete);
    CHECK(kept.scan.profiles >= 89);
    CHECK(kept.scan.profiles <= 91);
    CHECK(kept.points.size() == kept.scan.profiles * 181);
    CHECK(kept.scan.head_turn_rad == Approx(pi).margin(0.08));
    CHECK(kept.scan.angle_sigma_rad == 1e-4);
  }
  CHECK(world.keeper.scans[0].scan.is_incomplete);  // the head was not at a boundary when it began
  CHECK(world.assembler->counters().scans_incomplete == 1);
  CHECK(rays_accounted_for(world.assembler->counters()) == world.assembler->counters().rays);
}

TEST_CASE("without deskewing the walls are bent by decimetres") {
  World world;
  world.config.deskew = false;
  world.make();
  world.run(0, 5);
  REQUIRE(world.keeper.scans.size() >= 3);
  CHECK(world.worst_m(world.keeper.scans[1]) > 0.3);

  World standing;
  standing.motion.pose = still;
  standing.config.deskew = false;
  standing.make();
  standing.run(0, 5);
  CHECK(standing.worst_m(standing.keeper.scans[1]) < 1e-3);
}

TEST_CASE("the stated bound on the interpolation between knots holds, and is what limits") {
  for (const double error_m : {1e-4, 1e-3, 1e-2, 1e-1}) {
    World world;
    world.motion.pose = still;
    world.head.angle_rad = [](double t_s) { return 7.0 * t_s; };
    world.config.interpolation_error_m = error_m;
    world.config.lasers[0].maximum_range_m = 15;
    world.make();
    world.run(0, 2);
    double worst = 0;
    for (const KeptScan& kept : world.keeper.scans) worst = std::max(worst, world.worst_m(kept));
    CAPTURE(error_m, worst);
    CHECK(worst < error_m + 1e-5);
    if (error_m == 1e-3) CHECK(worst > 1e-4);
  }
}

TEST_CASE("two lasers' profiles merge in one scan, by their time and not by their arrival") {
  World world;
  world.config.laser_count = 2;
  world.config.turn_rad = pi / 2;
  world.config.expected_profiles = 90;
  world.config.minimum_profiles = 80;
  world.make();
  std::vector<Profile> late;
  for (std::int64_t t = begin_ns; t < begin_ns + 5 * ns_per_s; t += profile_ns) {
    world.assembler->on_profile(world.measure(t, 0));
    world.assembler->on_profile(world.measure(t - profile_ns, 1));  // b is a sweep behind
    world.assembler->on_tick(t + profile_ns);
  }
  REQUIRE(world.keeper.scans.size() >= 6);
  for (std::size_t i = 1; i < world.keeper.scans.size(); ++i) {
    const KeptScan& kept = world.keeper.scans[i];
    CHECK(world.worst_m(kept) < 1e-3);
    CHECK_FALSE(kept.scan.is_incomplete);
    CHECK(kept.scan.profiles >= 88);
    CHECK(kept.scan.profiles <= 92);
    CHECK(kept.scan.profiles_missing <= 2);
  }
  CHECK(world.assembler->counters().profiles_late == 0);
}

TEST_CASE("a full turn makes a scan, in either direction") {
  const double direction = GENERATE(1.0, -1.0);
  World world;
  world.head.angle_rad = [direction](double t_s) { return direction * speed_rad_s * t_s; };
  world.config.turn_rad = 2 * pi;
  world.config.boundary_rad = 0.5;
  world.make();
  world.run(0, 9);
  REQUIRE(world.keeper.scans.size() >= 3);
  for (std::size_t i = 1; i < world.keeper.scans.size(); ++i) {
    const KeptScan& kept = world.keeper.scans[i];
    CHECK_FALSE(kept.scan.is_incomplete);
    CHECK(kept.scan.profiles >= 179);
    CHECK(world.worst_m(kept) < 1e-3);
    const double begin_rad = world.head.angle_rad(since_s(kept.scan.begin_stamp_ns));
    CHECK(std::abs(std::remainder(begin_rad - 0.5, 2 * pi)) < 0.05);
  }
  CHECK(world.assembler->counters().head_reversals == 0);
}

TEST_CASE("profiles wait for their angle, and go in when it is known") {
  World world;
  world.make();
  world.head.known_until_ns = begin_ns;
  world.run(0, 0.5);
  CHECK(world.assembler->waiting_profiles() == 38);
  CHECK(world.assembler->counters().profiles_used == 0);
  world.head.known_until_ns = INT64_MAX;
  world.assembler->on_tick(begin_ns + 600 * ns_per_ms);
  CHECK(world.assembler->waiting_profiles() == 0);
  CHECK(world.assembler->counters().profiles_used + world.assembler->counters().profiles_head_standing == 38);
}

TEST_CASE("profiles whose angle does not come in time are dropped, and their scan is marked") {
  World world;
  world.config.maximum_wait_ns = 300 * ns_per_ms;
  world.config.expected_profiles = 90;
  world.make();
  world.run(0, 2);
  const std::size_t before = world.keeper.scans.size();
  world.head.known_until_ns = begin_ns + 2 * ns_per_s;
  world.run(2, 2.4);
  world.head.known_until_ns = INT64_MAX;
  world.run(2.4, 6);
  const ScanAssemblerCounters& counters = world.assembler->counters();
  CHECK(counters.profiles_angle_late > 3);
  CHECK(counters.profiles_angle_late < 15);
  CHECK(world.log.has("in time"));
  CHECK(counters.scans_incomplete == 2);  // the first, and this one
  CHECK(world.keeper.scans[before].scan.is_incomplete);
  CHECK(world.keeper.scans[before].scan.profiles_missing >= counters.profiles_angle_late);
  CHECK_FALSE(world.keeper.scans.back().scan.is_incomplete);
}

TEST_CASE("profiles of a lost angle are dropped at once") {
  World world;
  world.make();
  world.head.lost_from_ns = begin_ns + 2 * ns_per_s;
  world.head.lost_to_ns = begin_ns + 3 * ns_per_s;
  world.run(0, 7);
  CHECK(world.assembler->counters().profiles_angle_lost >= 75);
  CHECK(world.assembler->counters().profiles_angle_lost <= 77);
  CHECK(world.log.has("lost"));
  for (const KeptScan& kept : world.keeper.scans) {
    const double from_s = since_s(kept.scan.begin_stamp_ns);
    const double to_s = since_s(kept.scan.end_stamp_ns);
    if (kept.scan.number > 0 && (to_s < 1.9 || from_s > 3.1)) CHECK_FALSE(kept.scan.is_incomplete);
    if (from_s < 2 && to_s > 3) CHECK(kept.scan.is_incomplete);
    CHECK(world.worst_m(kept) < 1e-3);
  }
}

TEST_CASE("a scan is incomplete though only its very first profile was dropped") {
  const bool is_lost = GENERATE(false, true);
  World world;
  world.head.angle_rad = [](double t_s) { return speed_rad_s * t_s; };
  world.config.boundary_tolerance_rad = 0.3;
  if (is_lost) {
    world.head.lost_from_ns = begin_ns;
    world.head.lost_to_ns = begin_ns + profile_ns;
  }
  world.make();
  world.run(0, 3);
  REQUIRE(world.keeper.scans.size() == 2);
  CHECK(world.keeper.scans[0].scan.is_incomplete == is_lost);
  CHECK_FALSE(world.keeper.scans[1].scan.is_incomplete);
}

TEST_CASE("when there is no room the oldest profile is given up") {
  World world;
  world.config.capacity.waiting_profiles = 16;
  world.config.maximum_wait_ns = 10 * ns_per_s;
  world.make();
  world.head.known_until_ns = begin_ns;
  world.run(0, 1);
  CHECK(world.assembler->waiting_profiles() == 16);
  CHECK(world.assembler->counters().profiles_without_room == 60);
  CHECK(world.log.has("no room"));
}

TEST_CASE("points beyond the capacity are counted, and told at the first") {
  World world;
  world.config.capacity.points_per_scan = 1000;
  world.make();
  world.run(0, 4);
  for (const KeptScan& kept : world.keeper.scans) CHECK(kept.points.size() <= 1000);
  CHECK(world.assembler->counters().rays_without_room > 10000);
  const auto told = std::ranges::find_if(world.log.notices, [](const Notice& notice) {
    return std::string(notice.text).find("more points than points_per_scan") != std::string::npos;
  });
  REQUIRE(told != world.log.notices.end());
  CHECK(told->value == 1000);
  CHECK(told->severity == Severity::error);
  CHECK(told->stamp_ns < begin_ns + ns_per_s);
  CHECK(rays_accounted_for(world.assembler->counters()) == world.assembler->counters().rays);
}

TEST_CASE("a head that stops ends its scan, and scans begin again when it turns") {
  World world;
  world.head.angle_rad = [](double t_s) { return speed_rad_s * (t_s < 3 ? t_s : t_s < 6 ? 3 : t_s - 3); };
  world.make();
  world.run(0, 10);
  const ScanAssemblerCounters& counters = world.assembler->counters();
  CHECK(counters.head_stops == 1);
  CHECK(counters.profiles_head_standing > 180);
  CHECK(world.log.has("the head stands"));
  CHECK(counters.scans_incomplete ==
        2);  // ended by the stop, and begun after it (the first began at a boundary)
  for (const KeptScan& kept : world.keeper.scans) CHECK(world.worst_m(kept) < 1e-3);
}

TEST_CASE("a head that turns round ends its scan and begins the next in the other direction") {
  World world;
  world.head.angle_rad = [](double t_s) { return speed_rad_s * (t_s < 4 ? t_s : 8 - t_s); };
  world.make();
  world.run(0, 8);
  CHECK(world.assembler->counters().head_reversals == 1);
  CHECK(world.assembler->counters().scans_incomplete == 2);
  CHECK(world.keeper.scans.size() >= 5);
  for (const KeptScan& kept : world.keeper.scans) CHECK(world.worst_m(kept) < 1e-3);
}

TEST_CASE("an angle that an index pulse sets back a little neither ends a scan nor counts as turning round") {
  World world;
  world.motion.pose = still;
  const auto smooth = world.head.angle_rad;
  world.head.angle_rad = [smooth](double t_s) {
    return smooth(t_s) - (std::fmod(t_s, 1.0) < 0.5 ? 0.0 : 0.04);
  };
  world.make();
  world.run(0, 8);
  CHECK(world.assembler->counters().head_reversals == 0);
  CHECK(world.assembler->counters().profiles_late == 0);
  CHECK(world.assembler->counters().scans_incomplete == 1);
}

TEST_CASE("the vehicle's own points, masked rays and ranges out of bounds are left out and counted") {
  World world;
  world.motion.pose = still;
  world.config.own_box_from_m = {-0.6, -0.6, 0.0};
  world.config.own_box_to_m = {0.8, 0.6, 1.5};
  world.config.lasers[0].masks[0] = {.ray_from_rad = -pi / 2 - 0.01, .ray_to_rad = -pi / 2 + 0.101};
  world.config.lasers[0].masks[1] = {
      .ray_from_rad = 0.5, .ray_to_rad = 0.6, .head_from_rad = 3 * pi, .head_to_rad = 4 * pi};
  world.config.lasers[0].masks[2] = {.ray_from_rad = 0.2, .ray_to_rad = 0.3, .maximum_range_m = 0.01};
  world.config.lasers[0].mask_count = 3;
  world.config.lasers[0].maximum_range_m = 11;
  world.make();
  for (std::int64_t t = begin_ns; t < begin_ns + 6 * ns_per_s; t += profile_ns) {
    Profile profile = world.measure(t);
    profile.range_m[90] = 0.25F;  // a pole on the vehicle
    profile.range_m[80] = 0;
    profile.range_m[81] = std::numeric_limits<float>::quiet_NaN();
    profile.range_m[82] = std::numeric_limits<float>::infinity();
    profile.range_m[83] = 0.05F;
    profile.range_m[84] = -1;
    world.assembler->on_profile(profile);
  }
  world.assembler->finish();
  const ScanAssemblerCounters& counters = world.assembler->counters();
  const std::uint64_t profiles = counters.profiles_used;
  CHECK(counters.rays_without_range == profiles);
  CHECK(counters.rays_not_finite == 2 * profiles);
  CHECK(counters.rays_too_near == 2 * profiles);
  CHECK(counters.rays_too_far > profiles);
  // The pole; six rays below in every profile; five or six more in half of the profiles.
  const double masked = static_cast<double>(counters.rays_masked) / static_cast<double>(profiles);
  CHECK(masked > 1 + 6 + 2.4);
  CHECK(masked < 1 + 6 + 3.1);
  CHECK(rays_accounted_for(counters) == counters.rays);
  std::uint64_t without = 0;
  for (const KeptScan& kept : world.keeper.scans) {
    without += kept.scan.rays_without_range;
    for (const Point& point : kept.points) REQUIRE(is_finite(point));
    CHECK(world.worst_m(kept) < 1e-3);
  }
  CHECK(without == counters.rays_without_range);
}

TEST_CASE("without odometry a scan is made as if the vehicle stood") {
  World world;
  world.has_motion = false;
  world.motion.pose = still;
  world.make();
  world.run(0, 4);
  REQUIRE(world.keeper.scans.size() >= 2);
  CHECK_FALSE(world.keeper.scans[1].scan.has_odometry);
  CHECK(world.worst_m(world.keeper.scans[1]) < 1e-3);
  CHECK(world.assembler->counters().profiles_without_motion == 0);

  World stale;
  stale.motion.stale_from_ns = begin_ns + 3 * ns_per_s;
  stale.make();
  stale.run(0, 8);
  CHECK(stale.assembler->counters().profiles_without_motion > 300);
  CHECK(stale.keeper.scans[1].scan.has_odometry);
  CHECK_FALSE(stale.keeper.scans.back().scan.has_odometry);
  CHECK(stale.log.has("no odometry"));
}

TEST_CASE("a scan has the GPS position at its reference time") {
  struct FunctionGps final : GpsPosition {
    [[nodiscard]] std::optional<Eigen::Vector3d> position_at(std::int64_t stamp_ns,
                                                             std::int64_t maximum_age_ns) const override {
      asked_age_ns = maximum_age_ns;
      if (since_s(stamp_ns) > 5) return std::nullopt;
      return Eigen::Vector3d(10 * since_s(stamp_ns), 2, 0);
    }
    mutable std::int64_t asked_age_ns = 0;
  };
  const FunctionGps gps;
  World world;
  world.config.gps_maximum_age_ns = 3 * ns_per_s;
  world.make();
  world.run(0, 3);
  CHECK_FALSE(world.keeper.scans.back().scan.has_gps);  // nobody is asked
  world.keeper.scans.clear();
  world.assembler->ask_for_positions(&gps);
  world.run(3, 8);
  world.assembler->finish();
  CHECK(gps.asked_age_ns == 3 * ns_per_s);
  for (const KeptScan& kept : world.keeper.scans) {
    const double t_s = since_s(kept.scan.reference_stamp_ns);
    CAPTURE(t_s);
    REQUIRE(kept.scan.has_gps == (t_s <= 5));
    if (kept.scan.has_gps) CHECK((kept.scan.gps_position_m - Eigen::Vector3d(10 * t_s, 2, 0)).norm() < 1e-9);
  }
}

TEST_CASE("profiles that cannot be are refused") {
  World world;
  world.make();
  world.assembler->on_tick(begin_ns);
  const Profile good = world.measure(begin_ns);
  const auto refused = [&](auto change) {
    Profile profile = good;
    change(profile);
    const std::uint64_t before = world.assembler->counters().profiles_absurd;
    world.assembler->on_profile(profile);
    return world.assembler->counters().profiles_absurd == before + 1;
  };
  CHECK(refused([](Profile& p) { p.count = 0; }));
  CHECK(refused([](Profile& p) { p.count = 5000; }));
  CHECK(refused([](Profile& p) { p.first_angle_rad = std::nan(""); }));
  CHECK(refused([](Profile& p) { p.angle_step_rad = std::numeric_limits<double>::infinity(); }));
  CHECK(refused([](Profile& p) { p.ray_interval_ns = -5; }));
  CHECK(refused([](Profile& p) { p.ray_interval_ns = std::nan(""); }));
  CHECK(refused([](Profile& p) { p.ray_interval_ns = 1e12; }));
  CHECK(refused([](Profile& p) { p.first_ray_stamp_ns = INT64_MIN; }));
  CHECK(refused([](Profile& p) { p.first_ray_stamp_ns = INT64_MAX; }));
  CHECK(refused([](Profile& p) { p.first_ray_stamp_ns += 3600 * ns_per_s; }));
  Profile foreign = good;
  foreign.laser = 1;
  world.assembler->on_profile(foreign);
  CHECK(world.assembler->counters().profiles_of_unknown_laser == 1);
}

TEST_CASE("rays for which no room was planned are counted, and told at the first") {
  World world;
  world.config.capacity.rays_per_profile = 100;
  world.make();
  world.run(0, 3);
  world.assembler->finish();
  const ScanAssemblerCounters& counters = world.assembler->counters();
  CHECK(counters.rays_without_room == counters.profiles_used * 81);
  REQUIRE(!world.log.notices.empty());
  CHECK(std::string(world.log.notices[0].text).find("more rays than rays_per_profile") != std::string::npos);
  CHECK(world.log.notices[0].value == 181);
  CHECK(world.log.notices[0].stamp_ns < begin_ns + 20 * ns_per_ms);
  CHECK(rays_accounted_for(counters) == counters.rays);
  for (const KeptScan& kept : world.keeper.scans) CHECK(world.worst_m(kept) < 1e-3);
}

TEST_CASE("the same profiles give the same bits") {
  World one;
  World two;
  for (World* world : {&one, &two}) {
    world->config.laser_count = 2;
    world->make();
    world->run(0, 4);
    world->assembler->finish();
  }
  REQUIRE(one.keeper.scans.size() == two.keeper.scans.size());
  for (std::size_t i = 0; i < one.keeper.scans.size(); ++i) {
    const std::vector<Point>& a = one.keeper.scans[i].points;
    const std::vector<Point>& b = two.keeper.scans[i].points;
    REQUIRE(a.size() == b.size());
    REQUIRE(std::memcmp(a.data(), b.data(), a.size() * sizeof(Point)) == 0);
  }
}

TEST_CASE("a clock that steps back ends the scan and goes on") {
  World world;
  world.motion.pose = still;
  world.make();
  world.run(0, 4);
  const std::size_t before = world.keeper.scans.size();
  world.run(-15, -8);
  CHECK(world.keeper.scans.size() > before + 3);
  CHECK_FALSE(world.keeper.scans.back().scan.is_incomplete);
}

TEST_CASE("a block that is too small or misaligned, or a bad configuration, makes no assembler") {
  World world;
  world.make();
  const std::size_t bytes = ScanAssembler::memory_required(world.config.capacity);
  std::vector<std::byte> memory(bytes + 2 * Arena::alignment);
  void* place = memory.data();
  std::size_t room = memory.size();
  REQUIRE(std::align(Arena::alignment, bytes, place, room) != nullptr);
  auto* const block = static_cast<std::byte*>(place);
  AssemblerStatus status = AssemblerStatus::ok;
  const auto create = [&](std::span<std::byte> where) {
    return ScanAssembler::create(where, world.config, world.head, nullptr, world.keeper, world.log, status);
  };
  CHECK(create({block, bytes - 1}) == nullptr);
  CHECK(status == AssemblerStatus::block_too_small);
  CHECK(create({block + 1, bytes}) == nullptr);
  CHECK(status == AssemblerStatus::block_misaligned);
  CHECK(create({block, bytes}) != nullptr);
  world.config.lasers[0].maximum_range_m = 0;
  CHECK(create({block, bytes}) == nullptr);
  CHECK(status == AssemblerStatus::bad_config);
  CHECK(validate(world.config) != nullptr);
  CHECK(ScanAssembler::memory_required({.rays_per_profile = UINT32_MAX,
                                        .waiting_profiles = UINT32_MAX,
                                        .points_per_scan = UINT32_MAX}) == SIZE_MAX);
}

TEST_CASE("every counter of the assembler has a name") {
  ScanAssemblerCounters counters;
  std::size_t names = 0;
  counters.visit([&](const char*, std::uint64_t) { ++names; });
  CHECK(names * sizeof(std::uint64_t) == sizeof(counters));
}

// The whole chain: index edges, the drive's position and odometry frames, each as its wire brings it.
TEST_CASE("encoder, odometry and assembler together put points on the walls") {
  const bool waits = GENERATE(false, true);
  World world;
  const auto twist = [](double t_s) { return Eigen::Vector2d(1.6, 0.3 * std::sin(t_s)); };
  // Closed form is not needed: small steps, as a table.
  std::vector<Pose> table;
  Pose pose;
  for (int i = 0; i < 140000; ++i) {
    table.push_back(pose);
    Vector6d step;
    const Eigen::Vector2d now = twist((i + 0.5) * 1e-4);
    step << now.x() * 1e-4, 0, 0, 0, 0, now.y() * 1e-4;
    pose = pose * exp_se3(step);
  }
  const Pose middle = table[60000];
  world.motion.pose = [&table, middle](double t_s) {
    const double i = std::clamp(t_s * 1e4, 0.0, 139998.0);
    const auto below = static_cast<std::size_t>(i);
    Pose room_from_body =
        middle.inverse() * interpolate(table[below], table[below + 1], i - static_cast<double>(below));
    return room_from_body;
  };
  world.head.angle_rad = [](double t_s) { return speed_rad_s * t_s + 0.02 * std::sin(2 * t_s); };

  EncoderConfig encoder_config;
  encoder_config.drive_counts_per_turn = 264000;
  encoder_config.wait_for_index = waits;
  if (waits) encoder_config.maximum_wait_ns = 4 * ns_per_s;
  REQUIRE(validate(encoder_config) == nullptr);
  auto encoder = std::make_unique<Encoder>(encoder_config, world.log);
  OdometryConfig odometry_config;
  odometry_config.kind = OdometryKind::vehicle;
  odometry_config.speed_m_s = {
      0x200, false, {.start_bit = 0, .length = 16, .type = RawType::signed_integer, .factor = 1e-3}};
  odometry_config.yaw_rate_rad_s = {0x201,
                                    false,
                                    {.start_bit = 7,
                                     .length = 32,
                                     .order = ByteOrder::motorola,
                                     .type = RawType::signed_integer,
                                     .factor = 1e-6}};
  REQUIRE(validate(odometry_config) == nullptr);
  auto odometry = std::make_unique<Odometry>(odometry_config, world.log);

  world.config.capacity.waiting_profiles = waits ? 400 : 64;
  world.config.maximum_wait_ns = 5 * ns_per_s;
  std::vector<std::byte> memory(ScanAssembler::memory_required(world.config.capacity) + Arena::alignment);
  void* place = memory.data();
  std::size_t room = memory.size();
  REQUIRE(std::align(Arena::alignment, ScanAssembler::memory_required(world.config.capacity), place, room) !=
          nullptr);
  AssemblerStatus status = AssemblerStatus::ok;
  ScanAssembler* const assembler =
      ScanAssembler::create({static_cast<std::byte*>(place), room}, world.config, *encoder, odometry.get(),
                            world.keeper, world.log, status);
  REQUIRE(assembler != nullptr);

  std::int64_t next_profile_ns = begin_ns;
  double last_turns = -1;
  for (int ms = 0; ms < 12000; ++ms) {
    const std::int64_t now_ns = begin_ns + ms * ns_per_ms;
    const double t_s = ms * 1e-3;
    const double turns = world.head.angle_rad(t_s) / (2 * pi);
    if (std::floor(turns) != std::floor(last_turns)) {  // the pulse was within the last millisecond
      const double share = (turns - std::floor(turns)) / (turns - last_turns);
      encoder->on_edge({0, true, 0}, now_ns - static_cast<std::int64_t>(share * 1e6));
    }
    last_turns = turns;
    if (ms % 10 == 0)
      encoder->on_drive_position(static_cast<std::int32_t>(std::lround(turns * 264000 * 1.001)), now_ns);
    if (ms % 20 == 7) {
      CanFrame frame{.id = 0x200, .size = 8};
      REQUIRE(insert(odometry_config.speed_m_s.signal, twist(t_s).x(), frame.data) == SignalStatus::ok);
      odometry->on_frame(frame, now_ns);
      frame.id = 0x201;
      REQUIRE(insert(odometry_config.yaw_rate_rad_s.signal, twist(t_s).y(), frame.data) == SignalStatus::ok);
      odometry->on_frame(frame, now_ns);
    }
    if (now_ns >= next_profile_ns + 10 * ns_per_ms) {
      assembler->on_profile(world.measure(next_profile_ns));
      next_profile_ns += profile_ns;
    }
    if (ms % 20 == 0) {
      encoder->on_tick(now_ns);
      odometry->on_tick(now_ns);
      assembler->on_tick(now_ns);
    }
  }
  REQUIRE(world.keeper.scans.size() >= 6);
  CHECK(assembler->counters().profiles_without_motion == 0);
  CHECK(assembler->counters().profiles_angle_late + assembler->counters().profiles_without_room == 0);
  const double allowed_m = waits ? 0.008 : 0.015;  // 0.5 mrad of creep or rounding at 14 m
  for (std::size_t i = 3; i < world.keeper.scans.size(); ++i) {
    const KeptScan& kept = world.keeper.scans[i];
    CAPTURE(waits, i);
    CHECK_FALSE(kept.scan.is_incomplete);
    // Odometry's frame is the body at its first node, 7 ms after the begin.
    const Pose room_from_odometry = world.motion.pose(0.007);
    double worst = 0;
    for (const Point& point : kept.points) {
      worst = std::max(worst, distance_to_wall_m(room_from_odometry * kept.scan.odometry_from_body *
                                                 Eigen::Vector3d(static_cast<double>(point.x),
                                                                 static_cast<double>(point.y),
                                                                 static_cast<double>(point.z))));
    }
    CHECK(worst < allowed_m);
  }
}

TEST_CASE("what a profile costs", "[.benchmark]") {
  World world;
  world.config.laser_count = 2;
  world.make();
  std::vector<Profile> profiles;
  for (int i = 0; i < 90; ++i)
    profiles.push_back(world.measure(begin_ns + i * profile_ns, static_cast<std::uint8_t>(i % 2)));
  const auto start = std::chrono::steady_clock::now();
  std::int64_t t = begin_ns;
  for (int round = 0; round < 500; ++round) {
    for (Profile& profile : profiles) {
      profile.first_ray_stamp_ns = t;
      world.assembler->on_profile(profile);
      world.keeper.scans.clear();
      t += profile_ns / 2;
    }
  }
  const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
  WARN(took.count() / (500 * 90) << " us a profile of 181 rays");
}
