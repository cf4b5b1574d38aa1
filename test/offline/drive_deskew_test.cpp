// A simulated drive through the drivers, once as they deskew it, once as if the vehicle had stood: what
// alces::Deskew makes of the second, by each kind of motion, beside the first.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <span>
#include <vector>

#include "alces/deskew.h"
#include "offline/replay/drive_replay.h"
#include "run_alces.h"
#include "support/in_block.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;

namespace {

/// Points of all profiles in the order in which they are measured, as a standing vehicle has them, and the
/// odometry at the profiles' ends.
class TimedRays final : public PlacedProfileSink {
 public:
  explicit TimedRays(const ScanAssemblerConfig& mounting) : mounting_(mounting) {}

  void on_placed_profile(const PlacedProfile& profile) override {
    odometry[profile.begin_ns] = profile.odometry_from_begin_body;
    odometry[profile.end_ns] = profile.odometry_from_end_body;
    const Pose& head_from_laser = mounting_.lasers[profile.laser].head_from_laser;
    const double last = static_cast<double>(profile.ranges_m.size() - 1);
    for (std::size_t ray = 0; ray < profile.ranges_m.size(); ++ray) {
      const auto range_m = static_cast<double>(profile.ranges_m[ray]);
      if (!(range_m > 0)) continue;
      const double share = static_cast<double>(ray) / last;
      const double head_rad = (1 - share) * profile.begin_head_angle_rad + share * profile.end_head_angle_rad;
      const double ray_rad = profile.first_angle_rad + static_cast<double>(ray) * profile.angle_step_rad;
      const Pose turned{exp_so3({0, 0, head_rad}), Eigen::Vector3d::Zero()};
      const Eigen::Vector3d end(range_m * std::cos(ray_rad), range_m * std::sin(ray_rad), 0);
      in_body.push_back(mounting_.body_from_head * (turned * (head_from_laser * end)));
      time_ns.push_back(profile.begin_ns +
                        std::llround(share * static_cast<double>(profile.end_ns - profile.begin_ns)));
    }
  }

  std::vector<Eigen::Vector3d> in_body;
  std::vector<std::int64_t> time_ns;
  std::map<std::int64_t, Pose> odometry;

 private:
  ScanAssemblerConfig mounting_;
};

Eigen::Vector3d vector(const Point& p) {
  return Eigen::Vector3f(p.x, p.y, p.z).cast<double>();
}

double mean_m(const std::vector<Point>& a, const std::vector<Point>& b) {
  double sum_m = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum_m += (vector(a[i]) - vector(b[i])).norm();
  return sum_m / static_cast<double>(a.size());
}

/// Seconds from the stamp on; of points that the drivers have dropped (their own vehicle) none.
std::vector<float> times_of(const std::vector<Point>& points, const TimedRays& rays, std::int64_t stamp_ns,
                            std::size_t& next) {
  std::vector<float> time_s;
  for (const Point& point : points) {
    constexpr double same_m = 0.01;  // the drivers interpolate between knots
    while (next < rays.in_body.size() && (rays.in_body[next] - vector(point)).norm() > same_m) ++next;
    if (next == rays.in_body.size()) break;
    time_s.push_back(static_cast<float>(1e-9 * static_cast<double>(rays.time_ns[next++] - stamp_ns)));
  }
  return time_s;
}

double deskewed_m(const Deskew& deskew, std::vector<Point> points, const std::vector<float>& time_s,
                  const std::vector<Point>& expected) {
  REQUIRE(deskew.apply(points, time_s, 0) == DeskewStatus::ok);
  return mean_m(points, expected);
}

}  // namespace

TEST_CASE("scans of the simulated vehicle come out as its drivers deskew them, by each kind of motion") {
  const TemporaryFolder folder;
  REQUIRE(run_alces(folder, "simulate --scans 20 --seed 3 --speed 1.6 --out drive.mcap").status == 0);
  DriveReplay by_drivers(folder / "drive.mcap", {});
  TimedRays rays(by_drivers.settings().scanner.assembler);
  DriveReplayOptions standing;
  standing.deskew = false;
  standing.profiles = &rays;
  DriveReplay skewed(folder / "drive.mcap", standing);

  alces::test::InBlock<Deskew> deskew(DeskewConfig{.pose_capacity = 2048});
  ScanPoints expected;
  ScanPoints scan;
  std::size_t next = 0;
  double sum_skewed_m = 0;
  double sum_odometry_m = 0;
  double sum_velocity_m = 0;
  double sum_gyro_m = 0;
  std::size_t scans = 0;
  for (std::size_t i = 0; by_drivers.read(i, expected); ++i) {
    REQUIRE(skewed.read(i, scan));
    REQUIRE(scan.size() == expected.size());
    const double stamp_s = *skewed.stamp_s(i);
    const auto stamp_ns = static_cast<std::int64_t>(std::llround(1e9 * stamp_s));
    const std::vector<float> time_s = times_of(scan.points, rays, stamp_ns, next);
    REQUIRE(time_s.size() == scan.size());
    if (i < 2) continue;  // no step yet

    std::vector<std::pair<double, Pose>> course;  // from half a second before the scan to its end
    for (const auto& [ns, pose] : rays.odometry) {
      const double t = 1e-9 * static_cast<double>(ns - stamp_ns);
      if (t > -1.2) course.emplace_back(t, pose);
    }
    deskew->clear();
    for (const auto& [t, pose] : course) REQUIRE(deskew->add_pose(t, pose) == DeskewStatus::ok);
    const double odometry_m = deskewed_m(*deskew, scan.points, time_s, expected.points);

    const double step_s = stamp_s - *skewed.stamp_s(i - 1);
    const Pose step = skewed.odometry(i - 1)->inverse() * *skewed.odometry(i);
    REQUIRE(deskew->set_twist(log_se3(step) / step_s) == DeskewStatus::ok);
    const double velocity_m = deskewed_m(*deskew, scan.points, time_s, expected.points);

    std::vector<GyroSample> gyro;
    for (std::size_t k = 8; k < course.size(); k += 8) {
      const auto& [t, pose] = course[k];
      const auto& [before_s, before] = course[k - 8];
      gyro.push_back(
          {0.5 * (before_s + t), log_so3(before.rotation.conjugate() * pose.rotation) / (t - before_s)});
    }
    REQUIRE(deskew->set_gyro(gyro, step.translation_m / step_s) == DeskewStatus::ok);
    const double gyro_m = deskewed_m(*deskew, scan.points, time_s, expected.points);

    CAPTURE(i, odometry_m, velocity_m, gyro_m);
    CHECK(odometry_m < 0.005);
    sum_skewed_m += mean_m(scan.points, expected.points);
    sum_odometry_m += odometry_m;
    sum_velocity_m += velocity_m;
    sum_gyro_m += gyro_m;
    ++scans;
  }
  REQUIRE(scans > 10);
  const auto count = static_cast<double>(scans);
  const double skewed_m = sum_skewed_m / count;
  CHECK(skewed_m > 0.2);
  CHECK(sum_odometry_m / count < 0.02 * skewed_m);
  CHECK(sum_velocity_m / count < 0.3 * skewed_m);
  CHECK(sum_gyro_m / count < 0.3 * skewed_m);
}
