#include "offline/evaluate/evaluation.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "offline/io/files/error.h"
#include "support/test_data.h"
#include "temporary_folder.h"

namespace alces::offline {
namespace {

Pose pose(double x, double y, double z, double yaw_rad = 0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())), {x, y, z}};
}

/// A helix: turns and climbs, so that no direction is left open.
std::vector<Pose> helix(std::size_t count) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle_rad = 0.2 * static_cast<double>(i);
    poses.push_back(pose(10 * std::cos(angle_rad), 10 * std::sin(angle_rad), angle_rad, angle_rad));
  }
  return poses;
}

Trajectory trajectory(const std::vector<double>& stamps_s, bool has_time) {
  Trajectory result;
  result.stamps_s = stamps_s;
  result.poses.resize(stamps_s.size());
  result.has_time = has_time;
  return result;
}

/// A floor and two walls as a scanner at the origin would see them, moved along their normals by `offset_m`.
std::vector<Point> corner(float offset_m) {
  std::vector<Point> points;
  for (float a = -6; a <= 6; a += 0.1F) {
    for (float b = -1; b <= 3; b += 0.1F) {
      points.push_back({a, b + 3, -1 + offset_m});
      points.push_back({7 + offset_m, a, b});
      points.push_back({a, 8 + offset_m, b});
    }
  }
  return points;
}

class ScansInMemory final : public ScanSource {
 public:
  explicit ScansInMemory(std::vector<std::vector<Point>> scans) : scans_(std::move(scans)) {}
  [[nodiscard]] std::size_t size() const override { return scans_.size(); }
  bool read(std::size_t index, ScanPoints& scan) override {
    scan.points = scans_[index];
    return true;
  }
  [[nodiscard]] std::string name(std::size_t) const override { return ""; }
  [[nodiscard]] std::size_t number(std::size_t index) const override { return index; }
  [[nodiscard]] std::optional<Pose> odometry(std::size_t) const override { return std::nullopt; }
  [[nodiscard]] std::optional<double> stamp_s(std::size_t) const override { return std::nullopt; }
  [[nodiscard]] std::string description() const override { return ""; }
  [[nodiscard]] std::vector<std::string> warnings() const override { return {}; }

 private:
  std::vector<std::vector<Point>> scans_;
};

TEST_CASE("statistics of four known values") {
  const std::vector<double> values{4, 1, 3, 2};
  const Statistics result = statistics(values);
  CHECK(result.count == 4);
  CHECK(result.mean == Approx(2.5));
  CHECK(result.standard_deviation == Approx(std::sqrt(1.25)));
  CHECK(result.median == Approx(2.5));
  CHECK(result.rmse == Approx(std::sqrt(7.5)));
  CHECK(result.max == 4);
  CHECK(statistics({}).count == 0);
}

TEST_CASE("an offset of (3, 4, 12) m is 13 m of error, 5 m of it in x and y") {
  const std::vector<Pose> truth = helix(20);
  std::vector<Pose> estimate = truth;
  for (Pose& p : estimate) p.translation_m += Eigen::Vector3d(3, 4, 12);
  const AbsoluteError error = absolute_error(estimate, truth);
  CHECK(error.translation_m.mean == Approx(13));
  CHECK(error.translation_m.standard_deviation == Approx(0).margin(1e-9));
  CHECK(error.translation_xy_m.mean == Approx(5));
  CHECK(error.rotation_deg.max == Approx(0).margin(1e-6));
}

TEST_CASE("the paper's rotation error is half the angle of rotation, whatever the sign of the quaternion") {
  const std::vector<Pose> truth{pose(0, 0, 0)};
  std::vector<Pose> estimate{pose(0, 0, 0, 30 * std::numbers::pi / 180)};
  estimate[0].rotation.coeffs() *= -1;
  const AbsoluteError error = absolute_error(estimate, truth);
  CHECK(error.quaternion_angle_deg.mean == Approx(15));
  CHECK(error.rotation_deg.mean == Approx(30));
  const double arccos_deg =
      std::acos(std::abs(estimate[0].rotation.dot(truth[0].rotation))) * 180 / std::numbers::pi;
  CHECK(error.quaternion_angle_deg.mean == Approx(arccos_deg));
}

TEST_CASE("a trajectory in another frame is brought back by se3 and by first, and not by none") {
  const std::vector<Pose> truth = helix(40);
  const Pose other_from_truth{
      Eigen::Quaterniond(Eigen::AngleAxisd(2.5, Eigen::Vector3d(1, -2, 0.5).normalized())), {100, -20, 7}};
  std::vector<Pose> estimate;
  for (const Pose& p : truth) estimate.push_back(other_from_truth * p);
  for (const Alignment alignment : {Alignment::first, Alignment::se3}) {
    const Pose fit = truth_from_map(estimate, truth, alignment);
    CHECK(same_pose(fit, other_from_truth.inverse(), 1e-9));
  }
  CHECK(same_pose(truth_from_map(estimate, truth, Alignment::none), Pose{}, 1e-12));
  CHECK(relative_error(estimate, truth, 3).translation_m.max == Approx(0).margin(1e-9));
}

TEST_CASE("se3 does not mirror, and takes positions on a line by the smallest rotation") {
  std::vector<Pose> truth;
  std::vector<Pose> line;
  for (int i = 0; i < 5; ++i) {
    truth.push_back(pose(i, 0, 0));
    line.push_back(pose(0, i, 0));
  }
  const Pose fit = truth_from_map(line, truth, Alignment::se3);
  CHECK(same_pose(fit, pose(0, 0, 0, -std::numbers::pi / 2), 1e-9));

  const std::vector<Pose> flat{pose(0, 0, 0), pose(2, 0, 0), pose(0, 1, 0)};
  const std::vector<Pose> mirrored{pose(0, 0, 0), pose(-2, 0, 0), pose(0, 1, 0)};
  CHECK(truth_from_map(flat, mirrored, Alignment::se3).rotation.toRotationMatrix().determinant() ==
        Approx(1));
  CHECK(same_pose(truth_from_map(std::span(flat).first(1), std::span(flat).first(1), Alignment::se3), Pose{},
                  1e-9));
}

TEST_CASE("relative errors: a step of 1 m measured as 1.1 m") {
  std::vector<Pose> truth;
  std::vector<Pose> estimate;
  for (int i = 0; i < 11; ++i) {
    truth.push_back(pose(i, 0, 0));
    estimate.push_back(pose(1.1 * i, 0, 0));
  }
  CHECK(relative_error(estimate, truth, 1).translation_m.mean == Approx(0.1));
  CHECK(relative_error(estimate, truth, 5).translation_m.mean == Approx(0.5));
  CHECK(relative_error(estimate, truth, 5).translation_m.count == 6);
  CHECK(relative_error(estimate, truth, 11).translation_m.count == 0);
}

TEST_CASE("poses associate by index without times, by the nearest stamp with them") {
  const Trajectory numbers = trajectory({0, 1, 2}, false);
  const Trajectory times = trajectory({10.0, 10.1, 10.2}, true);
  CHECK(associate(numbers, numbers, 0.02).by_index);
  CHECK(associate(numbers, times, 0.02).by_index);

  const Association by_time = associate(trajectory({10.11, 10.199, 12}, true), times, 0.02);
  CHECK_FALSE(by_time.by_index);
  REQUIRE(by_time.pairs.size() == 2);
  CHECK(by_time.pairs[0].truth == 1);
  CHECK(by_time.pairs[1].truth == 2);
  CHECK(by_time.largest_time_difference_s == Approx(0.01));

  // Both are near 10.1; it goes to the nearer.
  const Association contested = associate(trajectory({10.09, 10.101}, true), trajectory({10.1}, true), 0.02);
  REQUIRE(contested.pairs.size() == 1);
  CHECK(contested.pairs[0].estimate == 1);

  const Association by_number = associate(trajectory({0, 1, 2, 3}, false), trajectory({2, 3}, false), 0.02);
  REQUIRE(by_number.pairs.size() == 2);
  CHECK(by_number.pairs[0].estimate == 2);
}

TEST_CASE("poses that cannot be associated are an error") {
  const Trajectory three = trajectory({0, 1, 2}, false);
  CHECK_THROWS_AS(associate(three, trajectory({0, 1}, false), 0.02), InputError);
  CHECK_THROWS_AS(associate(three, trajectory({0.5, 1.5}, true), 0.02), InputError);
  CHECK_THROWS_AS(associate(trajectory({0.5}, true), trajectory({9.5, 10}, true), 0.02), InputError);
  CHECK_THROWS_AS(associate(three, Trajectory{}, 0.02), InputError);
  CHECK_THROWS_WITH(associate(three, trajectory({0, 1}, false), 0.02),
                    Catch::Contains("3 poses, the truth 2"));
}

TEST_CASE("surfaces 3 cm apart have a consistency of 3 cm") {
  ScansInMemory scans({corner(0), corner(0.03F), corner(0)});
  const std::vector<Pose> poses(3);
  const std::vector<PairGroup> groups{{"apart", {{0, 1}, {1, 0}}}, {"equal", {{0, 2}}}};
  const auto results = measure_consistency(scans, poses, groups);
  REQUIRE(results.size() == 2);
  REQUIRE(results[0].median_m);
  CHECK(*results[0].median_m == Approx(0.03).margin(1e-4));
  CHECK(results[0].pairs[0].correspondences > 1000);
  REQUIRE(results[1].median_m);
  CHECK(*results[1].median_m == Approx(0).margin(1e-5));
}

TEST_CASE("a wrong pose shows in the consistency, and the right one takes it away") {
  const Pose map_from_b = pose(0.4, -0.3, 0.1, 0.05);
  std::vector<Point> b;
  for (const Point& point : corner(0)) {
    const Eigen::Vector3f p =
        (map_from_b.inverse() * Eigen::Vector3f(point.x, point.y, point.z).cast<double>()).cast<float>();
    b.push_back({p.x(), p.y(), p.z()});
  }
  ScansInMemory scans({corner(0), b});
  const std::vector<PairGroup> groups{{"pair", {{0, 1}}}};
  const auto wrong = measure_consistency(scans, std::vector<Pose>{Pose{}, Pose{}}, groups);
  const auto right = measure_consistency(scans, std::vector<Pose>{Pose{}, map_from_b}, groups);
  CHECK(*wrong[0].median_m > 0.05);
  CHECK(*right[0].median_m < 1e-4);
}

TEST_CASE("scans without overlap are counted, not averaged") {
  ScansInMemory scans({corner(0), corner(0), {}});
  const std::vector<Pose> poses{Pose{}, pose(100, 0, 0), Pose{}};
  const std::vector<PairGroup> groups{{"none", {{0, 1}, {0, 2}, {2, 0}}}};
  const auto results = measure_consistency(scans, poses, groups);
  CHECK(results[0].without_overlap == 3);
  CHECK_FALSE(results[0].median_m);
  CHECK_THROWS_AS(measure_consistency(scans, std::span(poses).first(2), groups), InputError);
  const std::vector<PairGroup> beyond{{"beyond", {{0, 3}}}};
  CHECK_THROWS_AS(measure_consistency(scans, poses, beyond), InputError);
}

TEST_CASE("only points between 1.5 and 20 m count, and noise has no normals") {
  std::vector<Point> points;
  for (float x = -1; x <= 1; x += 0.05F) {
    for (float y = -1; y <= 1; y += 0.05F) {
      points.push_back({x, y, 1});       // too near but for the rim
      points.push_back({x, y + 25, 1});  // too far
    }
  }
  for (const Point& rim : points) REQUIRE(is_finite(rim));
  std::vector<Point> near;
  for (const Point& point : points) {
    if (std::hypot(point.x, point.y, point.z) < 1.5F || point.y > 20) near.push_back(point);
  }
  CHECK(SurfaceModel(near, {}).size() == 0);
  near.push_back({std::nanf(""), 5, 5});
  CHECK(SurfaceModel(near, {}).size() == 0);

  std::vector<Point> cube;
  for (int i = 0; i < 1000; ++i) {  // a lattice: no neighbourhood is a plane
    cube.push_back({5 + 0.1F * static_cast<float>(i % 10), 0.1F * static_cast<float>(i / 10 % 10),
                    0.1F * static_cast<float>(i / 100)});
  }
  CHECK(SurfaceModel(cube, {}).size() < 100);
}

// The figure is compared between versions and with other programs: its constants are part of it.

/// Ten points about (5, 0, 0) whose covariance has the eigenvalues 4, 1 and `ratio`.
std::vector<Point> ten_points(float ratio) {
  std::vector<Point> points(10, {5, 0, 0});
  for (std::size_t i = 0; i < 8; ++i)
    points[i] = {(i & 1) != 0 ? 5.2F : 4.8F, (i & 2) != 0 ? 0.1F : -0.1F,
                 0.1F * std::sqrt(ratio) * ((i & 4) != 0 ? 1.0F : -1.0F)};
  return points;
}

TEST_CASE("a normal is of ten points, the smallest eigenvalue less than 2 % of the middle one") {
  CHECK(SurfaceModel(ten_points(0.019F), {}).size() == 10);
  CHECK(SurfaceModel(ten_points(0.021F), {}).size() == 0);
  const std::vector<Point> ten = ten_points(0.0F);
  CHECK(SurfaceModel(std::span(ten).first(9), {}).size() == 0);
  // Of eleven, a point off the plane spoils all that do not have it for the farthest: it and those at y = 0
  // to 3.
  std::vector<Point> strip;
  for (int i = 0; i < 10; ++i) strip.push_back({5, static_cast<float>(i), i % 2 == 0 ? 0.5F : -0.5F});
  strip.push_back({3, -1, 0});
  CHECK(SurfaceModel(strip, {}).size() == 6);
}

/// What is left of points on a line along y at (`x_m`, 0, 0), offered to a wall of normals there.
std::size_t correspondences(double wall_x_m, double scan_x_m, std::size_t points) {
  std::vector<Point> wall;
  for (float y = -1; y <= 1; y += 0.1F) {
    for (float z = -0.5F; z <= 0.5F; z += 0.1F) wall.push_back({static_cast<float>(wall_x_m), y, z});
  }
  std::vector<Point> scan(points, {static_cast<float>(scan_x_m), 0, 0});
  return SurfaceModel(wall, {}).residuals_m(scan, Pose{}).size();
}

TEST_CASE(
    "every third point within 1 m of a surface, and between 1.5 and 20 m from its scanner, has a residual") {
  CHECK(correspondences(5, 5, 1) == 1);
  CHECK(correspondences(5, 5, 3) == 1);
  CHECK(correspondences(5, 5, 4) == 2);
  CHECK(correspondences(5, 5, 300) == 100);
  CHECK(correspondences(5, 5.99, 3) == 1);
  CHECK(correspondences(5, 6.01, 3) == 0);
  CHECK(correspondences(2, 1.51, 3) == 1);
  CHECK(correspondences(2, 1.49, 3) == 0);
  CHECK(correspondences(19.5, 19.99, 3) == 1);
  CHECK(correspondences(19.5, 20.01, 3) == 0);
}

TEST_CASE("a pair overlaps from 50 residuals on") {
  const auto median_of = [](std::size_t residuals) {
    const std::vector<Point> wall = corner(0);
    ScansInMemory scans({wall, std::vector<Point>(3 * residuals, {7.01F, 0, 0})});
    return measure_consistency(scans, std::vector<Pose>(2), std::vector<PairGroup>{{"pair", {{0, 1}}}})[0]
        .median_m;
  };
  CHECK_FALSE(median_of(49));
  REQUIRE(median_of(50));
  CHECK(*median_of(50) == Approx(0.01).margin(1e-4));
}

TEST_CASE("neighbours are every tenth scan with its next and its fifth") {
  const auto groups = neighbour_pairs(469);
  REQUIRE(groups.size() == 2);
  CHECK(groups[0].pairs.front() == ScanPair{5, 6});
  CHECK(groups[0].pairs.back() == ScanPair{465, 466});
  CHECK(groups[1].pairs.back() == ScanPair{455, 460});
  CHECK(neighbour_pairs(0)[0].pairs.empty());
}

TEST_CASE("revisits are near in place and far in time, thinned evenly") {
  std::vector<Pose> poses;
  for (int i = 0; i < 100; ++i) poses.push_back(pose(i < 50 ? i : 99 - i, 0, 0));  // there and back
  const Revisits all = find_revisits(poses);
  for (const auto& [a, b] : all.pairs) {
    CHECK(b >= a + 30);
    CHECK((poses[a].translation_m - poses[b].translation_m).norm() <= 3);
  }
  CHECK(all.found == all.pairs.size());
  RevisitSettings few;
  few.max_pairs = 10;
  const Revisits thinned = find_revisits(poses, few);
  CHECK(thinned.found == all.found);
  CHECK(thinned.pairs.size() == 10);
}

TEST_CASE("lists of pairs are read, and wrong ones refused with the entry") {
  const TemporaryFolder folder;
  CHECK(read_pairs(folder.write("good.json", "[[0, 5], [3, 4]]"), 6) ==
        std::vector<ScanPair>{{0, 5}, {3, 4}});
  CHECK_THROWS_WITH(read_pairs(folder.write("far.json", "[[0, 5], [3, 6]]"), 6), Catch::Contains("entry 1"));
  for (const char* bad : {"", "{}", "[[0]]", "[[0, -1]]", "[[0, 1.5]]", "[0, 1]", "[]", "[[0, 1]"}) {
    CHECK_THROWS_AS(read_pairs(folder.write("bad.json", bad), 6), InputError);
  }
  CHECK_THROWS_AS(read_pairs(folder / "missing.json", 6), InputError);
}

TEST_CASE("ORB-SLAM on KITTI 00 has the errors that are known of it") {
  if (!test::has_test_data("trajectories")) return;
  const Trajectory truth = read_trajectory(test::test_data("trajectories/KITTI_00_gt.txt"));
  const Trajectory orb = read_trajectory(test::test_data("trajectories/KITTI_00_ORB.txt"));
  REQUIRE(associate(orb, truth, 0.02).pairs.size() == 4541);
  std::vector<Pose> aligned = orb.poses;
  const Pose fit = truth_from_map(orb.poses, truth.poses, Alignment::se3);
  for (Pose& p : aligned) p = fit * p;
  const AbsoluteError error = absolute_error(aligned, truth.poses);
  CHECK(error.translation_m.rmse == Approx(1.303).margin(0.01));  // 1.3 m in the ORB-SLAM2 paper, Table I
  CHECK(relative_error(orb.poses, truth.poses, 1).translation_m.rmse == Approx(0.0281).margin(0.001));
}

}  // namespace
}  // namespace alces::offline
