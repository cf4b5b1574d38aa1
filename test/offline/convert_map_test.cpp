// Clouds, maps and trajectories in the forms of other programs, and back.
#include "offline/convert/convert_map.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "alces_platform/recording/byte_source.h"
#include "alces_platform/recording/recording_reader.h"
#include "offline/io/files/error.h"
#include "offline/io/map_folder/map_writer.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"
#include "run_alces.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;
using Catch::Contains;

const std::vector<Point> cloud = {{1, 2, 3}, {-4.5F, 0.25F, 0.125F}, {100.0625F, -200.5F, 7}};

Pose pose_of(std::size_t scan) {
  const auto angle = 0.3 * static_cast<double>(scan);
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(0.6, 0, 0.8))),
          {2.0 * static_cast<double>(scan), 1, -0.5}};
}

/// A map folder of two scans, as far as conversion needs one.
fs::path write_map(const TemporaryFolder& folder, bool has_time) {
  const fs::path map = folder / "map";
  fs::create_directories(map);
  Trajectory trajectory;
  trajectory.has_time = has_time;
  PlyMapWriter ply(map / "map.ply");
  for (std::size_t scan : {3U, 7U}) {
    trajectory.poses.push_back(pose_of(scan));
    trajectory.stamps_s.push_back(has_time ? 1000.5 + static_cast<double>(scan) : static_cast<double>(scan));
    ply.add(cloud, pose_of(scan), static_cast<std::uint32_t>(scan));
  }
  ply.finish();
  write_tum(map / "trajectory.tum", trajectory);
  return map;
}

MapConversionReport convert(const fs::path& in, const fs::path& out) {
  const auto source = conversion_source(in);
  const auto form = conversion_form(out);
  REQUIRE(source);
  REQUIRE(form);
  return convert_map({in, out, *source, *form, {}});
}

std::vector<Point> points_of(const fs::path& file) {
  ScanPoints scan;
  open_scans(file)->read(0, scan);
  return scan.points;
}

void check_same(const std::vector<Point>& a, const std::vector<Point>& b, double tolerance_m) {
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    CHECK(std::abs(static_cast<double>(a[i].x) - static_cast<double>(b[i].x)) <= tolerance_m);
    CHECK(std::abs(static_cast<double>(a[i].y) - static_cast<double>(b[i].y)) <= tolerance_m);
    CHECK(std::abs(static_cast<double>(a[i].z) - static_cast<double>(b[i].z)) <= tolerance_m);
  }
}

template <typename T>
T number_at(const std::string& bytes, std::size_t at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

template <typename T>
std::string with_number_at(std::string bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof(T));
  return bytes;
}

TEST_CASE("a map becomes every form of cloud, and each reads back as the map's points") {
  const TemporaryFolder folder;
  const fs::path map = write_map(folder, GENERATE(false, true));
  const std::vector<Point> truth = points_of(map / "map.ply");
  REQUIRE(truth.size() == 6);
  for (const char* name : {"a.ply", "a.pcd", "a.las", "a.csv", "a.bin"}) {
    CAPTURE(name);
    const MapConversionReport report = convert(map, folder / name);
    CHECK(report.scans == 2);
    CHECK(report.points == 6);
    CHECK(report.warnings.empty());
    // through the body's frame and back costs a float's rounding at 200 m
    check_same(points_of(folder / name), truth, name == std::string("a.las") ? 1e-4 : 4e-5);
    CHECK_FALSE(fs::exists(folder / (std::string(name) + ".part")));
  }
}

TEST_CASE("one cloud goes through every form without a change") {
  const TemporaryFolder folder;
  std::string csv = "x,y,z\n";
  for (const Point& p : cloud)
    csv += std::to_string(p.x) + "," + std::to_string(p.y) + "," + std::to_string(p.z) + "\n";
  fs::path at = folder.write("first.xyz", csv);
  for (const char* name : {"a.ply", "b.pcd", "c.las", "d.ply"}) {
    const MapConversionReport report = convert(at, folder / name);
    CHECK(report.points == cloud.size());
    at = folder / name;
  }
  check_same(points_of(at), cloud, 5.1e-5);
}

TEST_CASE("a LAS file has the header that LAS 1.4 asks for") {
  const TemporaryFolder folder;
  const fs::path map = write_map(folder, true);
  convert(map, folder / "a.las");
  const std::string bytes = content_of(folder / "a.las");
  REQUIRE(bytes.size() == 375 + 6 * 30);
  CHECK(bytes.substr(0, 4) == "LASF");
  CHECK(number_at<std::uint16_t>(bytes, 6) == 16);  // WKT, as point formats from 6 on must have
  CHECK(bytes[24] == 1);
  CHECK(bytes[25] == 4);
  CHECK(number_at<std::uint16_t>(bytes, 94) == 375);
  CHECK(number_at<std::uint32_t>(bytes, 96) == 375);
  CHECK(bytes[104] == 6);
  CHECK(number_at<std::uint16_t>(bytes, 105) == 30);
  CHECK(number_at<std::uint64_t>(bytes, 247) == 6);
  CHECK(number_at<double>(bytes, 131) == 1e-4);
  std::vector<Point> points = points_of(folder / "a.las");
  double most_x = -1e9;
  for (const Point& point : points) most_x = std::max(most_x, static_cast<double>(point.x));
  CHECK(number_at<double>(bytes, 179) == Approx(most_x).margin(1e-4));
  CHECK(number_at<std::uint16_t>(bytes, 375 + 20) == 3);  // the scan
  CHECK(number_at<double>(bytes, 375 + 22) == 1003.5);    // its stamp
}

TEST_CASE("a LAS cloud in a national grid comes nearer by whole kilometres, and says so") {
  const TemporaryFolder folder;
  convert(write_map(folder, false), folder / "a.las");
  std::string bytes = content_of(folder / "a.las");
  const std::vector<Point> here = points_of(folder / "a.las");
  bytes = with_number_at(bytes, 155, 548'000.0);  // x offset
  for (const std::size_t bound : {179U, 187U})
    bytes = with_number_at(bytes, bound, number_at<double>(bytes, bound) + 548'000);
  const auto source = open_scans(folder.write("far.las", bytes));
  ScanPoints scan;
  source->read(0, scan);
  const std::vector<Point>& points = scan.points;
  REQUIRE(source->warnings().size() == 1);
  CHECK_THAT(source->warnings()[0], Contains("548000") || Contains("547000"));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double moved = static_cast<double>(points[i].x) - static_cast<double>(here[i].x);
    CHECK(std::abs(moved - std::round(moved / 1000) * 1000) < 2e-3);
  }
}

TEST_CASE("a LAS file that is not what it promises is refused with the reason") {
  const TemporaryFolder folder;
  convert(write_map(folder, false), folder / "a.las");
  const std::string good = content_of(folder / "a.las");
  const auto complaint = [&](const std::string& bytes) -> std::string {
    try {
      static_cast<void>(points_of(folder.write("bad.las", bytes)));
    } catch (const InputError& error) {
      return error.what();
    }
    return "no complaint";
  };
  CHECK_THAT(complaint(good.substr(0, good.size() - 1)), Contains("promises 6 points and holds 5"));
  CHECK_THAT(complaint(good.substr(0, 100)), Contains("within its header"));
  CHECK_THAT(complaint(good.substr(0, 300)), Contains("within its header"));
  CHECK_THAT(complaint("LASX"), Contains("no LAS file"));
  CHECK_THAT(complaint(""), Contains("no LAS file"));
  CHECK_THAT(complaint(with_number_at(good, 104, std::uint8_t{0x86})), Contains("LAZ"));
  CHECK_THAT(complaint(with_number_at(good, 104, std::uint8_t{11})), Contains("point format 11"));
  CHECK_THAT(complaint(with_number_at(good, 105, std::uint16_t{29})), Contains("29 bytes"));
  CHECK_THAT(complaint(with_number_at(good, 247, std::uint64_t{1} << 62)), Contains("promises"));
  CHECK_THAT(complaint(with_number_at(good, 131, 0.0)), Contains("scale"));
  CHECK_THAT(complaint(with_number_at(good, 155, std::nan(""))), Contains("offset"));
  CHECK_THAT(complaint(with_number_at(good, 96, std::uint32_t{4'000'000'000})), Contains("promises"));
}

TEST_CASE(
    "a map becomes a recording with its scans and poses, and that the same cloud and trajectory again") {
  const TemporaryFolder folder;
  const fs::path map = write_map(folder, true);
  convert(map, folder / "map.mcap");
  const MapConversionReport back = convert(folder / "map.mcap", folder / "back.ply");
  CHECK(back.scans == 2);
  check_same(points_of(folder / "back.ply"), points_of(map / "map.ply"), 6e-5);
  convert(folder / "map.mcap", folder / "back.tum");
  const Trajectory was = read_trajectory(map);
  const Trajectory is = read_trajectory(folder / "back.tum");
  REQUIRE(is.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(is.stamps_s[i] == was.stamps_s[i]);
    CHECK((is.poses[i].translation_m - was.poses[i].translation_m).norm() < 1e-6);
    CHECK(angle_between_rad(is.poses[i].rotation, was.poses[i].rotation) < 1e-6);
  }
}

TEST_CASE("a map's recording lasts as long as the map, and a transform places every cloud") {
  const TemporaryFolder folder;
  const bool has_time = GENERATE(false, true);
  convert(write_map(folder, has_time), folder / "map.mcap");
  REQUIRE(run_alces(folder, "convert map.mcap copy.mcap").status == 0);
  for (const char* name : {"map.mcap", "copy.mcap"}) {
    CAPTURE(name, has_time);
    FileSource source((folder / name).c_str());
    RecordingReader reader(source);
    REQUIRE(reader.open());
    RecordedMessage message;
    std::vector<TransformRecord> transforms;
    std::size_t clouds = 0;
    while (reader.next(message)) {
      if (const auto* transform = std::get_if<TransformRecord>(&message.content)) {
        CHECK(message.handed_on_ns == transform->stamp_ns);
        transforms.push_back(*transform);
      } else if (const auto* scan = std::get_if<CloudRecord>(&message.content)) {
        CHECK(message.handed_on_ns == scan->stamp_ns);
        REQUIRE(transforms.size() == ++clouds);
        CHECK(transforms.back().stamp_ns == scan->stamp_ns);
        CHECK((transforms.back().map_from_body * Eigen::Vector3d(1, 2, 3) -
               pose_of(clouds == 1 ? 3 : 7) * Eigen::Vector3d(1, 2, 3))
                  .norm() < 1e-5);
      }
    }
    CHECK(clouds == 2);
    CHECK(transforms.front().stamp_ns == (has_time ? 1'003'500'000'000 : 3'000'000'000));
    const nlohmann::json info =
        nlohmann::json::parse(run_alces(folder, std::string("info --json ") + name).out);
    CHECK(info["duration_s"] == 4);
  }
}

TEST_CASE("a trajectory becomes KITTI's and 3DTK's, and TUM's again") {
  const TemporaryFolder folder;
  const fs::path map = write_map(folder, false);
  convert(map, folder / "t.kitti");
  CHECK(convert(map, folder / "frames").poses == 2);
  CHECK(fs::exists(folder / "frames/scan007.frames"));
  for (const char* from : {"t.kitti", "frames"}) {
    CAPTURE(from);
    convert(folder / from, folder / "again.tum");
    const Trajectory again = read_trajectory(folder / "again.tum");
    REQUIRE(again.size() == 2);
    CHECK((again.poses[1].translation_m - pose_of(7).translation_m).norm() < 1e-6);
    CHECK(angle_between_rad(again.poses[1].rotation, pose_of(7).rotation) < 1e-5);
  }
}

TEST_CASE("points that are not finite are counted and left out") {
  const TemporaryFolder folder;
  const MapConversionReport report =
      convert(folder.write("a.xyz", "1,2,3\nnan,0,0\n4,5,6\n0,inf,0\n"), folder / "a.pcd");
  CHECK(report.points == 2);
  CHECK(report.not_finite == 2);
  CHECK(points_of(folder / "a.pcd").size() == 2);
}

TEST_CASE("what cannot be converted is refused in one sentence, and nothing is left behind") {
  const TemporaryFolder folder;
  const fs::path map = write_map(folder, false);
  const auto refuse = [&](const std::string& arguments, int status, const char* words) {
    CAPTURE(arguments);
    const ProgramOutcome outcome = run_alces(folder, "convert " + arguments);
    INFO(outcome.err);
    CHECK(outcome.status == status);
    CHECK_THAT(outcome.err, Contains(words));
    CHECK_THAT(outcome.err, Catch::StartsWith("alces: "));
  };
  folder.write("scan.laz", "LASF");
  folder.write("scan.e57", "ASTM-E57");
  folder.write("one.tum", "0 0 0 0 0 0 0 1\n");
  refuse("map a.unknown", 2, "--to");
  refuse("scan.laz a.ply", 3, "Debian");
  refuse("scan.e57 a.ply", 3, "Debian");
  refuse("one.tum a.ply", 2, "no points");
  refuse("map /dev/full --to las", 5, "/dev/full");
  refuse("map nowhere/a.ply", 5, "nowhere");
  refuse("missing.ply a.pcd", 3, "does not exist");
  fs::resize_file(map / "map.ply", fs::file_size(map / "map.ply") - 5);
  refuse("map a.pcd", 3, "map.ply");
  for (const char* name : {"a.ply", "a.las", "a.pcd", "a.las.part", "a.pcd.part"})
    CHECK_FALSE(fs::exists(folder / name));
}

}  // namespace
}  // namespace alces::offline
