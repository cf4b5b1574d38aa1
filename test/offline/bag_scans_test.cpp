#include "offline/io/bags/bag_scans.h"

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <numbers>

#include "offline/io/bags/bag_trajectory.h"
#include "offline/io/files/error.h"
#include "refusal.h"
#include "support/ros1_bag.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using namespace alces::test;
using Catch::Contains;

namespace {

constexpr double begin_s = 1'600'000'000;
constexpr const char* cloud_type = "sensor_msgs/PointCloud2";
constexpr const char* odometry_type = "nav_msgs/Odometry";

Pose pose_at(double x_m, double yaw_rad = 0) {
  Pose pose;
  pose.translation_m = {x_m, 0, 0};
  pose.rotation = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ());
  return pose;
}

bool has(const std::vector<std::string>& sentences, const std::string& part) {
  return std::any_of(sentences.begin(), sentences.end(),
                     [&](const std::string& each) { return each.find(part) != std::string::npos; });
}

void check_near(const Point& point, float x, float y, float z) {
  CAPTURE(point.x, point.y, point.z);
  CHECK(std::abs(point.x - x) < 1e-5F);
  CHECK(std::abs(point.y - y) < 1e-5F);
  CHECK(std::abs(point.z - z) < 1e-5F);
}

/// Three scans 0.1 s apart of a lidar that is the body, and odometry that moves 1 m a scan.
Ros1BagWriter plain_bag(const std::filesystem::path& file) {
  Ros1BagWriter bag(file);
  for (int i = 0; i < 3; ++i) {
    const double stamp_s = begin_s + 0.1 * i;
    bag.add("/odom", odometry_type, stamp_s, ros1_odometry(stamp_s, "odom", "base", pose_at(i)));
    bag.add("/points", cloud_type, stamp_s + 0.05,
            ros1_cloud(stamp_s, "base", {{1, 2, 3}, {4, 5, static_cast<float>(i)}}));
  }
  return bag;
}

std::string refusal_of(const std::filesystem::path& file, const ScanSourceOptions& options = {}) {
  try {
    static_cast<void>(open_scans(file, options));
  } catch (const Error& error) {
    return error.what();
  }
  return "(opened)";
}

}  // namespace

TEST_CASE("a bag's scans have the points, stamps and poses that were put in, in any order of reading") {
  const TemporaryFolder folder;
  const auto file = folder / "drive.bag";
  plain_bag(file).write();
  const auto scans = open_scans(file);
  REQUIRE(scans->size() == 3);
  for (const std::size_t i : {0U, 1U, 2U, 1U, 2U, 0U}) {
    ScanPoints scan;
    REQUIRE(scans->read(i, scan));
    REQUIRE(scan.points.size() == 2);
    CHECK(scan.points[0].y == 2);
    CHECK(scan.points[1].z == static_cast<float>(i));
    CHECK(scan.time_s.empty());
    CHECK(scans->odometry(i)->translation_m.x() == static_cast<double>(i));
    CHECK(std::abs(*scans->stamp_s(i) - (begin_s + 0.1 * static_cast<double>(i))) < 1e-6);
  }
  CHECK(scans->description() == "3 scans of /points (ROS 1), odometry from /odom");
  CHECK(scans->warnings().empty());
  CHECK(scans->odometry_origin()->path.string() == file.string() + ":/odom");
}

TEST_CASE("points go through /tf_static into the body's frame, odometry is interpolated between its stamps") {
  const TemporaryFolder folder;
  Ros1BagWriter bag(folder / "drive.bag");
  Pose body_from_lidar = pose_at(0.5, std::numbers::pi / 2);
  body_from_lidar.translation_m.z() = 1;
  bag.add("/tf_static", "tf2_msgs/TFMessage", begin_s,
          ros1_transform(begin_s, "base_link", "lidar", body_from_lidar));
  bag.add("/odom", odometry_type, begin_s, ros1_odometry(begin_s, "odom", "base_link", pose_at(0)));
  bag.add("/odom", odometry_type, begin_s + 0.4,
          ros1_odometry(begin_s + 0.4, "odom", "base_link", pose_at(4, 0.2)));
  bag.add("/points", cloud_type, begin_s + 0.2, ros1_cloud(begin_s + 0.1, "lidar", {{2, 0, 0}, {0, 0, 0}}));
  bag.write();
  const auto scans = open_scans(folder / "drive.bag");
  ScanPoints scan;
  REQUIRE(scans->read(0, scan));
  check_near(scan.points.at(0), 0.5F, 2, 1);
  CHECK(std::isnan(scan.points.at(1).x));  // nothing came back
  REQUIRE(scans->odometry(0));
  CHECK(std::abs(scans->odometry(0)->translation_m.x() - 1) < 1e-6);
  CHECK(std::abs(angle_between_rad(scans->odometry(0)->rotation, Eigen::Quaterniond::Identity()) - 0.05) <
        1e-6);
}

TEST_CASE(
    "without odometry on a topic /tf leads from odom to the body, --tf and --frame choose other frames") {
  const TemporaryFolder folder;
  Ros1BagWriter bag(folder / "drive.bag");
  Pose up;
  up.translation_m = {0, 0, 2};
  bag.add("/tf_static", "tf2_msgs/TFMessage", begin_s, ros1_transform(begin_s, "base_link", "lidar", up));
  for (int i = 0; i < 3; ++i) {
    const double stamp_s = begin_s + 0.1 * i;
    bag.add("/tf", "tf2_msgs/TFMessage", stamp_s, ros1_transform(stamp_s, "odom", "base_link", pose_at(i)));
    bag.add("/tf", "tf2_msgs/TFMessage", stamp_s, ros1_transform(stamp_s, "map", "odom", pose_at(10)));
    bag.add("/points", cloud_type, stamp_s, ros1_cloud(stamp_s, "lidar", {{1, 0, 0}}));
  }
  bag.write();
  ScanPoints scan;
  const auto odom = open_scans(folder / "drive.bag");
  REQUIRE(odom->read(2, scan));
  check_near(scan.points.at(0), 1, 0, 2);
  CHECK(odom->odometry(2)->translation_m.x() == 2);
  CHECK_THAT(odom->description(), Contains("odometry from /tf (odom to base_link)"));

  const auto map = open_scans(folder / "drive.bag", {.bag = {.topics = {}, .frame = {}, .tf = "map"}});
  CHECK(map->odometry(2)->translation_m.x() == 12);

  const auto lidar = open_scans(folder / "drive.bag", {.bag = {.topics = {}, .frame = "lidar", .tf = {}}});
  REQUIRE(lidar->read(2, scan));
  check_near(scan.points.at(0), 1, 0, 0);
  CHECK(lidar->odometry(2)->translation_m.z() == 2);

  CHECK_THAT(refusal_of(folder / "drive.bag", {.bag = {.topics = {}, .frame = {}, .tf = "earth"}}),
             Contains("up to earth; there are base_link in odom"));
}

TEST_CASE("a turning scanner's points are placed where /tf has it at the scan's stamp") {
  const TemporaryFolder folder;
  Ros1BagWriter bag(folder / "drive.bag");
  for (int i = 0; i < 3; ++i) {
    const double stamp_s = begin_s + 0.1 * i;
    bag.add("/odom", odometry_type, stamp_s, ros1_odometry(stamp_s, "odom", "base_link", pose_at(i)));
    bag.add("/tf", "tf2_msgs/TFMessage", stamp_s,
            ros1_transform(stamp_s, "base_link", "head", pose_at(0, i * std::numbers::pi / 2)));
    bag.add("/points", cloud_type, stamp_s, ros1_cloud(stamp_s, "head", {{1, 0, 0}}));
  }
  bag.write();
  const auto scans = open_scans(folder / "drive.bag");
  ScanPoints scan;
  REQUIRE(scans->read(1, scan));
  check_near(scan.points.at(0), 0, 1, 0);
  REQUIRE(scans->read(2, scan));
  check_near(scan.points.at(0), -1, 0, 0);
  CHECK(scans->odometry(2)->translation_m.x() == 2);
}

TEST_CASE("points' times and intensities are found by field, type and range, and told") {
  const TemporaryFolder folder;
  struct Case {
    CloudField field;
    double unit;
    double from;
    const char* said;
  };
  const auto a_case =
      GENERATE(Case{{"t", 16, 6}, 1e-9, 0, "t (uint32) in ns by what a scan takes"},
               Case{{"time", 16, 7}, 1, 0, "time (float) in s by what a scan takes"},
               Case{{"offset_time", 16, 6}, 1e-6, 0, "offset_time (uint32) in us by what a scan takes"},
               Case{{"timestamp", 16, 8}, 1, begin_s, "timestamp (double) in s a date by its size"});
  Ros1BagWriter bag(folder / "drive.bag");
  for (int i = 0; i < 4; ++i) {
    const double stamp_s = begin_s + 0.1 * i;
    std::string data;
    for (int k = 0; k < 10; ++k) {
      const double time = (a_case.from > 0 ? stamp_s : 0) + 0.01 * k;
      Ros1Bytes point;
      point.number(1.0F).number(2.0F).number(3.0F).number(static_cast<float>(10 * k));
      if (a_case.field.type == 6) point.number(static_cast<std::uint32_t>(std::llround(time / a_case.unit)));
      if (a_case.field.type == 7) point.number(static_cast<float>(time));
      if (a_case.field.type == 8) point.number(time);
      if (a_case.field.type != 8) point.number(0.0F);
      data += point.bytes();
    }
    bag.add(
        "/points", cloud_type, stamp_s,
        ros1_cloud(stamp_s, "base",
                   {{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 7}, {"intensity", 12, 7}, a_case.field}, 24, data));
  }
  bag.write();
  const auto scans = open_scans(folder / "drive.bag");
  CHECK_THAT(scans->channels(), Contains(std::string("times from ") + a_case.said));
  ScanPoints scan;
  REQUIRE(scans->read(2, scan));
  REQUIRE(scan.time_s.size() == 10);
  for (std::size_t k = 0; k < 10; ++k)
    CHECK(std::abs(scan.time_s[k] - 0.01F * static_cast<float>(k)) < 1e-5F);
  REQUIRE(scan.intensity.size() == 10);
  CHECK(scan.intensity[9] == 90);
}

TEST_CASE("times that are of another clock, all equal, or in no unit that fits are told and not used") {
  const TemporaryFolder folder;
  const auto [first, step, said] =
      GENERATE(std::tuple{5000.0, 0.01, "are not used: some are more than 10 s from the clouds' stamps"},
               std::tuple{0.0, 0.0, "are not used: they are all the same"},
               std::tuple{0.0, 0.1, "are not used: they span 0.0009 s, and every scan takes longer"});
  Ros1BagWriter bag(folder / "drive.bag");
  for (int i = 0; i < 4; ++i) {
    const double stamp_s = begin_s + 0.1 * i;
    std::string data;
    for (int k = 0; k < 10; ++k)
      data +=
          Ros1Bytes().number(1.0F).number(2.0F).number(3.0F).number(0.0F).number(first + step * k).bytes();
    bag.add("/points", cloud_type, stamp_s,
            ros1_cloud(stamp_s, "base", {{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 7}, {"time", 16, 8}}, 24, data));
  }
  bag.write();
  const auto scans = open_scans(folder / "drive.bag");
  ScanPoints scan;
  REQUIRE(scans->read(0, scan));
  CHECK(scan.points.size() == 10);
  CHECK(scan.time_s.empty());
  CAPTURE(scans->warnings());
  CHECK(has(scans->warnings(), said));
}

TEST_CASE("of several lidars and odometries one is taken, and the others are named, --topic takes them") {
  const TemporaryFolder folder;
  const auto file = folder / "drive.bag";
  Ros1BagWriter bag = plain_bag(file);
  for (int i = 0; i < 2; ++i) {
    const double stamp_s = begin_s + 0.1 * i;
    bag.add("/rear/points", cloud_type, stamp_s, ros1_cloud(stamp_s, "base", {{7, 7, 7}}));
    bag.add("/wheels", odometry_type, stamp_s, ros1_odometry(stamp_s, "odom", "base", pose_at(100 + i)));
    bag.add("/ground_truth", odometry_type, stamp_s, ros1_odometry(stamp_s, "odom", "base", pose_at(0)));
  }
  bag.write();
  const auto scans = open_scans(file);
  CHECK(scans->size() == 3);
  CHECK(scans->odometry(1)->translation_m.x() == 1);
  CHECK(has(scans->warnings(), "scans are /points; not /rear/points: --topic takes another"));
  CHECK(has(scans->warnings(), "odometry is /odom, of the most messages; not /wheels"));

  const auto others =
      open_scans(file, {.bag = {.topics = {"/wheels", "rear/points"}, .frame = {}, .tf = {}}});
  CHECK(others->size() == 2);
  CHECK(others->odometry(1)->translation_m.x() == 101);

  CHECK_THAT(refusal_of(file, {.bag = {.topics = {"/front"}, .frame = {}, .tf = {}}}),
             Contains("has no topic /front; it has /odom, /points"));
  CHECK_THAT(refusal_of(file, {.bag = {.topics = {"/odom", "/wheels"}, .frame = {}, .tf = {}}}),
             Contains("/odom and /wheels are both odometry; name one of them"));
}

TEST_CASE("clouds in the odometry's own frame are taken back into the body's") {
  const TemporaryFolder folder;
  Ros1BagWriter bag(folder / "drive.bag");
  for (int i = 0; i < 3; ++i) {
    const double stamp_s = begin_s + 0.1 * i;
    bag.add("/odom", odometry_type, stamp_s, ros1_odometry(stamp_s, "camera_init", "body", pose_at(i)));
    bag.add("/registered", cloud_type, stamp_s, ros1_cloud(stamp_s, "camera_init", {{10, 1, 0}}));
  }
  bag.write();
  const auto scans = open_scans(folder / "drive.bag");
  ScanPoints scan;
  REQUIRE(scans->read(2, scan));
  check_near(scan.points.at(0), 8, 1, 0);
  CHECK(has(scans->warnings(), "the odometry's own frame"));
}

TEST_CASE("clocks that disagree are told, and the odometry is put on the scans' clock") {
  const TemporaryFolder folder;
  Ros1BagWriter bag(folder / "drive.bag");
  for (int i = 0; i < 5; ++i) {
    const double log_s = begin_s + 0.1 * i;
    bag.add("/odom", odometry_type, log_s, ros1_odometry(log_s - 1000, "odom", "base", pose_at(i)));
    bag.add("/points", cloud_type, log_s, ros1_cloud(log_s, "base", {{1, 0, 0}}));
  }
  bag.write();
  const auto scans = open_scans(folder / "drive.bag");
  CHECK(has(scans->warnings(), "the clocks of /points and /odom disagree"));
  CHECK(has(scans->warnings(), "1000.000 s apart"));
  for (std::size_t i = 0; i < 5; ++i) CHECK(scans->odometry(i)->translation_m.x() == static_cast<double>(i));
}

TEST_CASE(
    "scans without a stamp have the time of recording, those that are not later than the one before are left "
    "out") {
  const TemporaryFolder folder;
  Ros1BagWriter bag(folder / "drive.bag");
  bag.add("/points", cloud_type, begin_s, ros1_cloud(0, "base", {{1, 0, 0}}));
  bag.add("/points", cloud_type, begin_s + 1, ros1_cloud(begin_s + 0.5, "base", {{2, 0, 0}}));
  bag.add("/points", cloud_type, begin_s + 2, ros1_cloud(begin_s + 0.5, "base", {{3, 0, 0}}));
  bag.add("/points", cloud_type, begin_s + 3, ros1_cloud(begin_s + 0.7, "base", {{4, 0, 0}}));
  bag.write();
  const auto scans = open_scans(folder / "drive.bag");
  REQUIRE(scans->size() == 3);
  CHECK(*scans->stamp_s(0) == begin_s);
  ScanPoints scan;
  REQUIRE(scans->read(2, scan));
  CHECK(scan.points.at(0).x == 4);
  CHECK(has(scans->warnings(), "1 messages have no stamp; the time of recording is taken"));
  CHECK(has(scans->warnings(), "1 scans are stamped no later than the one before and are left out"));
}

TEST_CASE("a bag that was cut at any byte gives the scans that are whole, and says that it was cut") {
  const TemporaryFolder folder;
  const auto file = folder / "drive.bag";
  const Ros1BagWriter bag = plain_bag(file);
  const std::string whole = bag.bytes();
  std::size_t with_scans = 0;
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    bag.write(whole.substr(0, size));
    try {
      const auto scans = open_scans(file);
      ScanPoints scan;
      for (std::size_t i = 0; i < scans->size(); ++i) {
        REQUIRE(scans->read(i, scan));
        CHECK(scan.points.at(1).z == static_cast<float>(i));
      }
      if (scans->size() > 0) ++with_scans;
      CHECK((has(scans->warnings(), "was cut at byte") || has(scans->warnings(), "has no index")));
    } catch (const InputError& error) {
      CHECK_THAT(error.what(), Contains("drive.bag"));
    }
  }
  CHECK(with_scans > 50);
}

TEST_CASE("messages that are damaged are left out, counted and told") {
  const TemporaryFolder folder;
  const auto file = folder / "drive.bag";
  Ros1BagWriter bag = plain_bag(file);
  const double late_s = begin_s + 1;
  bag.add("/points", cloud_type, late_s,
          ros1_cloud(late_s, "base", {{"x", 0, 7}, {"y", 4, 7}}, 8, std::string(80, 'a')));
  bag.add("/points", cloud_type, late_s, ros1_cloud(late_s, "base", {{1, 2, 3}}).substr(0, 60));
  Pose broken = pose_at(1);
  broken.rotation.coeffs().setZero();
  bag.add("/odom", odometry_type, late_s, ros1_odometry(late_s, "odom", "base", broken));
  bag.write();
  const auto scans = open_scans(file);
  CHECK(scans->size() == 3);
  CHECK(has(scans->warnings(), "/points: 2 of 5 messages are left out: the first of them has no field z"));
  CHECK(has(scans->warnings(),
            "/odom: 1 of 4 messages are left out: the first of them holds a pose that is not finite"));
}

TEST_CASE("what cannot be mapped of a bag is said with what to do") {
  const TemporaryFolder folder;
  const auto file = folder / "drive.bag";
  Ros1BagWriter images(file);
  images.add("/camera", "sensor_msgs/Image", begin_s, "x");
  images.write();
  CHECK_THAT(refusal_of(file), Contains("its topics are /camera (sensor_msgs/Image)"));
  CHECK_THAT(refusal_of(folder.write("empty.bag", "")), Contains("is empty; nothing was recorded"));
  CHECK_THAT(refusal_of(folder.write("old.bag", "#ROSBAG V1.2\nxxxxxxxx")), Contains("'rosbag fix'"));
  CHECK_THAT(refusal_of(folder.write("text.bag", "stamp x y z and so on")), Contains("is no bag of ROS 1"));
  CHECK_THAT(refusal_of(folder.write("text.mcap", "stamp x y z and so on")),
             Contains("this is no MCAP file"));
  CHECK_THAT(refusal_of(folder.write("text.db3", "stamp x y z and so on")), Contains("SQLite"));
  CHECK_THAT(refusal_of(folder.write("whole.db3.zstd", "x")), Contains("unpack it with 'zstd -d'"));
  folder.write("bag/metadata.yaml", "rosbag2_bagfile_information:\n  relative_file_paths: [bag_0.mcap]\n");
  CHECK_THAT(refusal_of(folder / "bag"), Contains("the files that it names are not there: bag_0.mcap"));
  plain_bag(file).write();
  CHECK_THAT(refusal_of(file, {.format = "pcd"}), Contains("--format pcd: a bag says itself"));
  CHECK_THAT(refusal_of(file, {.bag = {.topics = {}, .frame = "gripper", .tf = {}}}),
             Contains("do not lead from base (of /points) to gripper"));
}

TEST_CASE("a trajectory in a bag is named by its topic where there are several") {
  const TemporaryFolder folder;
  const auto file = folder / "drive.bag";
  Ros1BagWriter bag = plain_bag(file);
  bag.write();
  const auto only = read_bag_trajectory(file);
  REQUIRE(only);
  CHECK(only->size() == 3);
  CHECK(only->has_time);
  CHECK(only->poses[2].translation_m.x() == 2);
  bag.add("/truth", odometry_type, begin_s, ros1_odometry(begin_s, "odom", "base", pose_at(7)));
  bag.write();
  CHECK_THROWS_WITH(read_bag_trajectory(file),
                    Contains("several trajectories (/odom, /truth): name one, as"));
  CHECK(read_trajectory(file.string() + ":/truth").poses.at(0).translation_m.x() == 7);
  CHECK_THROWS_WITH(read_trajectory(file.string() + ":/other"), Contains("has no poses on /other"));
  CHECK_FALSE(read_bag_trajectory(folder / "drive.tum"));

  // and as the odometry of a bag's scans
  const auto scans = open_scans(file, {.odometry = file.string() + ":/odom"});
  CHECK(scans->odometry(2)->translation_m.x() == 2);
}

TEST_CASE(
    "how the body moved within a scan of a bag is known from all of its odometry, not from the scans' poses "
    "alone") {
  const TemporaryFolder folder;
  plain_bag(folder / "drive.bag").write();
  const auto scans = open_scans(folder / "drive.bag");
  const std::vector<TimedPose> motion = scans->motion(1, begin_s + 0.1, begin_s + 0.15);
  REQUIRE(motion.size() >= 6);
  for (const TimedPose& pose : motion)
    CHECK(pose.odometry_from_body.translation_m.x() == Approx(10 * (pose.time_s - begin_s)).margin(1e-4));
  CHECK(motion.back().time_s >= begin_s + 0.1499);
}

TEST_CASE("a folder of scans takes its odometry from a topic of a bag") {
  const TemporaryFolder folder;
  Ros1BagWriter bag = plain_bag(folder / "drive.bag");
  for (int i = 0; i < 3; ++i) {
    const double stamp_s = begin_s + 0.1 * i;
    bag.add("/truth", odometry_type, stamp_s, ros1_odometry(stamp_s, "odom", "base", pose_at(2 * i)));
    folder.write(fmt::format("scans/{:.3f}.csv", stamp_s), "x,y,z\n1,2,3\n4,5,6\n");
  }
  bag.write();
  const auto scans = open_scans(folder / "scans", {.odometry = folder.path().string() + "/drive.bag:/truth"});
  REQUIRE(scans->size() == 3);
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(scans->odometry(i).value().translation_m.x() == 2 * static_cast<double>(i));
  CHECK_THAT(scans->odometry_origin().value().path.string(), Contains("drive.bag:/truth"));
}

TEST_CASE("a bag becomes a folder of scans, which is the same scans") {
  const TemporaryFolder folder;
  const auto file = folder / "drive.bag";
  plain_bag(file).write();
  const ProgramOutcome outcome = run_alces(folder, "convert drive.bag scans");
  REQUIRE(outcome.status == 0);
  const auto from_bag = open_scans(file);
  const auto from_folder = open_scans(folder / "scans");
  REQUIRE(from_folder->size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    ScanPoints a;
    ScanPoints b;
    REQUIRE(from_bag->read(i, a));
    REQUIRE(from_folder->read(i, b));
    REQUIRE(a.points.size() == b.points.size());
    CHECK(std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof(Point)) == 0);
    CHECK(from_bag->odometry(i)->translation_m == from_folder->odometry(i)->translation_m);
    CHECK(*from_bag->stamp_s(i) == *from_folder->stamp_s(i));
  }
}

TEST_CASE("info shows a bag's topics, and what would be used") {
  const TemporaryFolder folder;
  plain_bag(folder / "drive.bag").write();
  const ProgramOutcome outcome = run_alces(folder, "info drive.bag");
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("/points  sensor_msgs/PointCloud2          3      10.0  base   scans"));
  CHECK_THAT(outcome.out, Contains("2 points: x float32, y float32, z float32"));
  CHECK_THAT(outcome.out, Contains("a map is made of: /points in base, body base, odometry /odom"));
  CHECK_THAT(run_alces(folder, "replay drive.bag --out town").err, Contains("alces map"));
}

TEST_CASE("profiles of a 2D laser on a turning head become scans, each ray where head and vehicle were") {
  // The laser stands upright on the head: its plane holds the head's axis. It sees 180 deg: half a turn is a
  // scan.
  const TemporaryFolder folder;
  Ros1BagWriter bag(folder / "drive.bag");
  Pose head_from_laser;
  head_from_laser.rotation = Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitY());
  head_from_laser.translation_m = {0, 0, 1};
  bag.add("/tf_static", "tf2_msgs/TFMessage", begin_s,
          ros1_transform(begin_s, "head", "laser", head_from_laser));
  constexpr int profiles = 81;
  constexpr double interval_s = 0.025;
  // a wall 5 m in front at the begin, to which the vehicle drives at 1 m/s: x = 5 for every ray that goes
  // forward
  for (int i = 0; i < profiles; ++i) {
    const double stamp_s = begin_s + interval_s * i;
    const double yaw_rad = std::numbers::pi / 40 * i;  // half a turn in 40 profiles
    bag.add("/odom", odometry_type, stamp_s,
            ros1_odometry(stamp_s, "odom", "base_link", pose_at(interval_s * i)));
    bag.add("/tf", "tf2_msgs/TFMessage", stamp_s,
            ros1_transform(stamp_s, "base_link", "head", pose_at(0, yaw_rad)));
    Ros1Bytes scan;
    constexpr std::uint32_t rays = 181;
    constexpr float step_rad = static_cast<float>(std::numbers::pi / 180);
    scan.header(stamp_s, "laser").number(-90 * step_rad).number(90 * step_rad).number(step_rad);
    scan.number(0.0F).number(0.025F).number(0.1F).number(30.0F).number(rays);
    for (std::uint32_t k = 0; k < rays; ++k) {
      const double angle_rad = static_cast<double>(-90 * step_rad) + static_cast<double>(step_rad) * k;
      const Eigen::Vector3d in_laser(std::cos(angle_rad), std::sin(angle_rad), 0);
      const Eigen::Vector3d in_base = pose_at(0, yaw_rad).rotation * (head_from_laser.rotation * in_laser);
      const double wall_m = 5 - interval_s * i;
      scan.number(in_base.x() > 0.2 ? static_cast<float>(wall_m / in_base.x()) : 99.0F);
    }
    scan.number(std::uint32_t{0});
    bag.add("/scan", "sensor_msgs/LaserScan", stamp_s, scan.bytes());
  }
  bag.write();
  const auto scans = open_scans(folder / "drive.bag");
  REQUIRE(scans->size() == 2);
  CHECK(has(scans->warnings(), "81 profiles of a 2D laser on a turning head are assembled to 2 scans"));
  for (std::size_t i = 0; i < 2; ++i) {
    ScanPoints scan;
    REQUIRE(scans->read(i, scan));
    const double driven_m = scans->odometry(i)->translation_m.x();
    std::size_t on_wall = 0;
    for (const Point& point : scan.points) {
      if (!is_finite(point)) continue;
      ++on_wall;
      CHECK(std::abs(static_cast<double>(point.x) - (5 - driven_m)) < 1e-4);
    }
    CAPTURE(i, driven_m);
    CHECK(on_wall > 1000);
  }
}

TEST_CASE("a 2D laser that does not turn is no scanner, and is refused with what to do") {
  const TemporaryFolder folder;
  Ros1BagWriter bag(folder / "drive.bag");
  for (int i = 0; i < 3; ++i) {
    Ros1Bytes scan;
    scan.header(begin_s + i, "laser")
        .number(0.0F)
        .number(1.0F)
        .number(0.5F)
        .number(0.0F)
        .number(0.1F)
        .number(0.1F);
    scan.number(30.0F).number(std::uint32_t{2}).number(1.0F).number(1.0F).number(std::uint32_t{0});
    bag.add("/scan", "sensor_msgs/LaserScan", begin_s + i, scan.bytes());
  }
  bag.write();
  CHECK_THAT(refusal_of(folder / "drive.bag"),
             Contains("/scan is a 2D laser (sensor_msgs/LaserScan), and /tf does "
                      "not turn it against laser"));
}

TEST_CASE("Livox's clouds are read by the definition that the bag has of them") {
  const TemporaryFolder folder;
  Ros1BagWriter bag(folder / "drive.bag");
  // not the drivers' own order, and a field more
  const std::string definition =
      "std_msgs/Header header\nuint64 timebase # ns\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
      "CustomPoint[] points\n"
      "================\nMSG: livox_ros_driver2/CustomPoint\nuint32 offset_time\nfloat32 y\nfloat32 "
      "x\nfloat32 z\n"
      "uint8 reflectivity\nuint16 extra\n";
  for (int i = 0; i < 3; ++i) {
    const double stamp_s = begin_s + 0.1 * i;
    Ros1Bytes cloud;
    cloud.header(stamp_s, "livox").number(std::uint64_t{7}).number(std::uint32_t{2}).number(std::uint8_t{1});
    cloud.number(std::uint8_t{0}).number(std::uint8_t{0}).number(std::uint8_t{0}).number(std::uint32_t{2});
    for (int k = 0; k < 2; ++k)
      cloud.number(static_cast<std::uint32_t>(99'000'000 * k))
          .number(2.0F)
          .number(1.0F)
          .number(3.0F)
          .number(static_cast<std::uint8_t>(200 + k))
          .number(std::uint16_t{1});
    bag.add("/livox/lidar", "livox_ros_driver2/CustomMsg", stamp_s, cloud.bytes(), definition);
  }
  bag.write();
  const auto scans = open_scans(folder / "drive.bag");
  REQUIRE(scans->size() == 3);
  ScanPoints scan;
  REQUIRE(scans->read(1, scan));
  REQUIRE(scan.points.size() == 2);
  check_near(scan.points[1], 1, 2, 3);
  REQUIRE(scan.time_s.size() == 2);
  CHECK(std::abs(scan.time_s[1] - 0.099F) < 1e-5F);
  CHECK(scan.intensity.at(1) == 201);
}
