// The head on the vehicle: tilt and height from the ground, yaw and place from a drive.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "offline/calibrate/drive_geometry.h"
#include "offline/calibrate/ground_plane.h"
#include "room_scan.h"

namespace alces::offline {
namespace {

/// Points of the ground and of four walls, as a tilted head sees them.
struct GroundView {
  explicit GroundView(const Mounting& head, double bumps_m = 0.01, unsigned seed = 1) {
    std::mt19937 random(seed);
    std::normal_distribution<double> bump(0, bumps_m);
    const Pose head_from_body = pose_of(head).inverse();
    const auto add = [&](double x, double y, double z) {
      ends_m.push_back(head_from_body * Eigen::Vector3d(x, y, z));
      rays.push_back({});
    };
    for (double x = -6; x <= 6; x += 0.3)
      for (double y = -6; y <= 6; y += 0.3) add(x, y, bump(random));
    for (double along = -6; along <= 6; along += 0.1)
      for (double z = 0; z < 3; z += 0.2) {
        add(4, along, z);
        add(along, -3.5, z);
      }
  }
  std::vector<StandingRay> rays;
  std::vector<Eigen::Vector3d> ends_m;
};

TEST_CASE("roll, pitch and height of the head come from the ground, also beside walls") {
  const Mounting truth{0.05, 0, 1.03, 0.8 * deg, -1.2 * deg, 2 * deg};
  const Mounting configured{0.05, 0, 1.0, 0, 0, 2 * deg};
  const GroundView view(truth);
  const GroundEstimate found = estimate_ground(view.rays, view.ends_m, configured);
  REQUIRE(found.is_found);
  CHECK(found.head[key_z] == Approx(1.03).margin(0.002));
  CHECK(found.head[key_roll] == Approx(0.8 * deg).margin(0.05 * deg));
  CHECK(found.head[key_pitch] == Approx(-1.2 * deg).margin(0.05 * deg));
  for (const MountingKey key : {key_x, key_y, key_yaw}) CHECK(found.head[key] == configured[key]);
  CHECK(found.rms_m == Approx(0.01).margin(0.003));
}

TEST_CASE("the ground may lie below the body's origin") {
  const Mounting truth{0, 0, 1.0, 0, 0, 0};
  GroundView view(truth);
  GroundSettings settings;
  settings.ground_z_m = -0.35;  // the origin is the axle
  Mounting configured = truth;
  configured[key_z] = 0.65;
  const GroundEstimate found = estimate_ground(view.rays, view.ends_m, configured, settings);
  REQUIRE(found.is_found);
  CHECK(found.head[key_z] == Approx(0.65).margin(0.002));
}

TEST_CASE("without ground where it is looked for nothing is changed") {
  const Mounting truth{0, 0, 1.0, 0, 0, 0};
  GroundView view(truth);
  Mounting configured = truth;
  configured[key_z] = 3;
  const GroundEstimate found = estimate_ground(view.rays, view.ends_m, configured);
  CHECK_FALSE(found.is_found);
  CHECK(found.head == configured);
  CHECK_FALSE(estimate_ground({}, {}, configured).is_found);
}

/// Steps of a vehicle whose head stands otherwise than configured.
std::vector<DriveStep> drive(const Mounting& truth, const Mounting& configured, double bend_rad,
                             double noise_m, double scale = 1) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, noise_m);
  // What matching gives are motions of the frame that would be the body if the configuration were right.
  const Pose wrong_from_true = pose_of(configured) * pose_of(truth).inverse();
  std::vector<DriveStep> steps;
  for (int i = 0; i < 150; ++i) {
    const double turn_rad = i % 3 == 0 ? bend_rad : i % 3 == 1 ? -bend_rad : 0;
    const double chord_m = 1.2;
    DriveStep step;
    step.odometry.translation_m = {chord_m * std::cos(turn_rad / 2), chord_m * std::sin(turn_rad / 2), 0};
    step.odometry.rotation = Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ());
    Pose real = step.odometry;
    real.translation_m *= scale;
    step.matched = wrong_from_true * real * wrong_from_true.inverse();
    step.matched.translation_m += Eigen::Vector3d(noise(random), noise(random), noise(random));
    steps.push_back(step);
  }
  steps[7].matched.translation_m.y() += 2;  // a match that went wrong
  return steps;
}

TEST_CASE("yaw, x and y of the head, and the wheels' scale, come from a drive with bends") {
  const Mounting truth{0.25, -0.1, 1, 0, 0, 1.5 * deg};
  const Mounting configured{0.2, -0.05, 1, 0, 0, 0};
  const DriveGeometry found = estimate_drive_geometry(drive(truth, configured, 0.4, 0.01, 1.012), configured);
  CHECK(found.has_yaw);
  CHECK(found.has_x);
  CHECK(found.has_y);
  CHECK(found.head[key_yaw] == Approx(1.5 * deg).margin(0.1 * deg));
  CHECK(found.head[key_x] == Approx(0.25).margin(0.01));
  CHECK(found.head[key_y] == Approx(-0.1).margin(0.01));
  CHECK(found.odometry_scale == Approx(1.012).margin(0.002));
}

TEST_CASE("straight ways alone give the yaw and no more") {
  const Mounting truth{0.25, -0.1, 1, 0, 0, 1.5 * deg};
  const Mounting configured{0.2, -0.05, 1, 0, 0, 0};
  const DriveGeometry found = estimate_drive_geometry(drive(truth, configured, 0, 0.01), configured);
  CHECK(found.has_yaw);
  CHECK_FALSE(found.has_x);
  CHECK_FALSE(found.has_y);
  CHECK(found.head[key_yaw] == Approx(1.5 * deg).margin(0.1 * deg));
  CHECK(found.head[key_x] == configured[key_x]);
}

TEST_CASE("a few steps, or steps on the spot, give nothing") {
  const Mounting configured{0.2, 0, 1, 0, 0, 0};
  auto steps = drive(configured, configured, 0.4, 0.01);
  CHECK_FALSE(estimate_drive_geometry(std::span(steps).first(9), configured).has_yaw);
  for (DriveStep& step : steps) step.odometry.translation_m.setZero();
  const DriveGeometry found = estimate_drive_geometry(steps, configured);
  CHECK(found.steps == 0);
  CHECK(found.head == configured);
}

}  // namespace
}  // namespace alces::offline
