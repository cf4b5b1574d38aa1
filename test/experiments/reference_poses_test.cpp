// Reference poses from a surveyed map: outlines, walls, and scans found in a room whose every wall is known.
#include <fmt/format.h>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "experiments/reference/building_outlines.h"
#include "experiments/reference/reference_map.h"
#include "experiments/reference/reference_poses.h"
#include "offline/io/files/error.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/room.h"
#include "offline/run_alces.h"
#include "offline/temporary_folder.h"

namespace alces::offline {
namespace {

using Catch::Contains;

// room.h's room and its pillar, in the room's own frame
constexpr const char* room_outlines =
    "# the room, then the pillar\n"
    "building 4 -1\n-12 -6\n12 -6\n12 6\n-12 6\n"
    "building 4 -1\n2.5 -3.5\n3.5 -3.5\n3.5 -2.5\n2.5 -2.5\n2.5 -3.5\n";

/// Floor and ceiling, as a flight over a room without a roof might see them.
std::vector<Point> floor_and_ceiling() {
  std::vector<Point> points;
  for (int x = -120; x <= 120; ++x)
    for (int y = -60; y <= 60; ++y)
      for (const float z : {-1.0F, 3.0F})
        points.push_back({0.1F * static_cast<float>(x), 0.1F * static_cast<float>(y), z});
  return points;
}

std::vector<Point> whole_room(const TemporaryFolder& folder) {
  std::vector<Point> points = floor_and_ceiling();
  const std::vector<Point> walls =
      extrude_walls(read_building_outlines(folder.write("room.txt", room_outlines)), 0.1);
  points.insert(points.end(), walls.begin(), walls.end());
  return points;
}

ReferenceSettings room_settings() {
  ReferenceSettings settings;
  settings.voxel.cell_capacity = 4096;
  return settings;
}

Pose moved_a_bit(const Pose& pose) {
  return Pose{exp_so3({0.01, -0.02, 0.04}), {0.25, -0.2, 0.1}} * pose;
}

TEST_CASE("scans in a surveyed room are found to the centimetre, from poses some decimetres away") {
  const TemporaryFolder folder;
  const ReferenceMap map(whole_room(folder), 0.05);
  RoomSource scans(8);
  std::vector<std::optional<Pose>> start;
  for (std::size_t i = 0; i < 8; ++i) start.emplace_back(moved_a_bit(room_from_body(i)));
  const ReferenceRun run = find_reference_poses(scans, start, map, room_settings());
  REQUIRE(run.poses.size() == 8);
  for (std::size_t i = 0; i < 8; ++i) {
    CAPTURE(i, to_string(run.poses[i].verdict), run.poses[i].overlap, run.poses[i].rms_m);
    CHECK(run.poses[i].verdict == ReferenceVerdict::trusted);
    CHECK((run.poses[i].map_from_body.translation_m - room_from_body(i).translation_m).norm() < 0.015);
    CHECK(angle_between_rad(run.poses[i].map_from_body.rotation, room_from_body(i).rotation) < 0.003);
    CHECK(run.poses[i].overlap > 0.9);
  }
}

/// The room's scans, but of scan 3 something else, far from anything.
class InterruptedRoom final : public RoomSource {
 public:
  using RoomSource::RoomSource;
  bool read(std::size_t index, ScanPoints& scan) override {
    scan = {.points = scan_room(index)};
    std::vector<Point>& points = scan.points;
    if (index == 3)
      for (Point& point : points) point = {point.x * 3 + 40, point.y * 2, point.z * 4 + 30};
    if (index == 4) points.assign(20, {std::numeric_limits<float>::quiet_NaN(), 0, 0});
    return true;
  }
};

TEST_CASE("a scan that is not of the map is marked, and the drive goes on behind it") {
  const TemporaryFolder folder;
  const ReferenceMap map(whole_room(folder), 0.05);
  InterruptedRoom scans(7);
  std::vector<std::optional<Pose>> start;
  for (std::size_t i = 0; i < 7; ++i) start.emplace_back(moved_a_bit(room_from_body(i)));
  start[5].reset();
  const ReferenceRun run = find_reference_poses(scans, start, map, room_settings());
  CHECK(run.poses[2].verdict == ReferenceVerdict::trusted);
  CHECK(run.poses[3].verdict != ReferenceVerdict::trusted);
  CHECK(run.poses[4].verdict == ReferenceVerdict::empty_scan);
  CHECK(run.poses[5].verdict == ReferenceVerdict::no_start);
  CHECK(run.poses[6].verdict == ReferenceVerdict::trusted);
  CHECK((run.poses[6].map_from_body.translation_m - room_from_body(6).translation_m).norm() < 0.015);

  write_reference_poses(folder / "truth.tum", scans, run, false);
  const Trajectory written = read_trajectory(folder / "truth.tum");
  CHECK(written.stamps_s == std::vector<double>{0, 1, 2, 6});
  CHECK_THAT(content_of(folder / "truth.tum"), Contains("# scan3.synthetic is not trustworthy: "));
  const std::string quality = content_of(folder / "truth.quality.csv");
  CHECK(std::count(quality.begin(), quality.end(), '\n') == 8);
  CHECK_THAT(quality, Contains("\n6,6,1,trusted,"));
}

TEST_CASE("walls alone leave height open: nothing is trusted") {
  const TemporaryFolder folder;
  const std::vector<Point> walls =
      extrude_walls(read_building_outlines(folder.write("room.txt", room_outlines)), 0.1);
  const ReferenceMap map(walls, 0.05);
  RoomSource scans(2);
  const std::vector<std::optional<Pose>> start = {room_from_body(0), room_from_body(1)};
  const ReferenceRun run = find_reference_poses(scans, start, map, room_settings());
  for (const ReferencePose& pose : run.poses) {
    CAPTURE(to_string(pose.verdict), pose.overlap, pose.rms_m);
    CHECK(pose.verdict == ReferenceVerdict::undetermined);
  }
}

TEST_CASE("outlines read the same from text and from GeoJSON, with courtyards") {
  const TemporaryFolder folder;
  const auto from_text =
      read_building_outlines(folder.write("a.txt", "building 9.5\n0 0\n20 0\n20 10 # corner\n0 10\n"));
  REQUIRE(from_text.size() == 1);
  CHECK(from_text[0].height_m == 9.5);
  CHECK(from_text[0].rings[0].size() == 4);
  const auto from_json = read_building_outlines(folder.write(
      "a.geojson",
      R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{"height":9.5,"base":2},"geometry":
      {"type":"MultiPolygon","coordinates":[[[[0,0],[20,0],[20,10],[0,10],[0,0]],[[5,5],[6,5],[6,6],[5,5]]]]}}]})"));
  REQUIRE(from_json.size() == 1);
  CHECK(from_json[0].rings[0] == from_text[0].rings[0]);
  CHECK(from_json[0].rings.size() == 2);
  CHECK(from_json[0].base_m == 2);

  const std::vector<Point> points = extrude_walls(from_text, 0.5);
  CHECK(points.size() == 120 * 20);
  for (const Point& p : points) {
    CHECK((p.x == 0 || p.x == 20 || p.y == 0 || p.y == 10));
    CHECK(p.z >= 0);
    CHECK(p.z <= 9.5F);
  }
  CHECK_THROWS_AS(extrude_walls(from_text, 0.0001), CapacityError);
}

TEST_CASE("outlines that are none are refused by line or feature") {
  const TemporaryFolder folder;
  const auto refuses = [&](const std::string& content, const std::string& why) {
    CAPTURE(content);
    CHECK_THROWS_WITH(read_building_outlines(folder.write("bad", content)), Contains(why));
    CHECK_THROWS_AS(read_building_outlines(folder / "bad"), InputError);
  };
  refuses("", "no building");
  refuses("# nothing\n", "no building");
  refuses("0 0\n1 0\n", ":1: a corner before");
  refuses("building\n", ":1: a building needs its height");
  refuses("building 5 low\n", "base is no number");
  refuses("building 5\n0 0\n1 0\n", ":1: this building has an outline of 2 corners");
  refuses("building -3\n0 0\n1 0\n1 1\n", "height of -3");
  refuses("building nan\n0 0\n1 0\n1 1\n", "height");
  refuses("building 5\n0 0\n1 zero\n1 1\n", ":3: a corner is two numbers");
  refuses("building 5\n0 0 0\n", ":2: a corner is two numbers");
  refuses("building 5\n550000 5800000\n550001 5800000\n550001 5800001\n", "subtract a round offset");
  refuses("{\"type\": ", "no GeoJSON");
  refuses("{}", "has no type");
  refuses(R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{},"geometry":
          {"type":"Polygon","coordinates":[[[0,0],[1,0],[1,1]]]}}]})",
          "feature 1: has no property \"height\"");
  refuses(R"({"type":"Feature","properties":{"height":3},"geometry":{"type":"Point","coordinates":[0,0]}})",
          "Point");
  refuses(R"({"type":"Feature","properties":{"height":3},"geometry":null})", "has no type");
  refuses(
      R"({"type":"Feature","properties":{"height":3},"geometry":{"type":"Polygon","coordinates":[[[0,"x"]]]}})",
      "[x, y]");
  CHECK_THROWS_AS(read_building_outlines(folder / "missing"), InputError);
  CHECK_THROWS_AS(ReferenceMap(std::vector<Point>{}, 0.1), InputError);
}

TEST_CASE("alces reference makes the truth that alces evaluate takes") {
  const TemporaryFolder folder;
  folder.write("room.txt", room_outlines);
  std::string start;
  std::string ply = "x,y,z\n";
  for (const Point& p : floor_and_ceiling()) ply += fmt::format("{},{},{}\n", p.x, p.y, p.z);
  folder.write("flight.csv", ply);
  for (std::size_t i = 0; i < 4; ++i) {
    folder.write(fmt::format("scans/scan{:03}.pcd", i), room_pcd(i));
    const Pose pose = moved_a_bit(room_from_body(i));
    const Eigen::Vector3d& t = pose.translation_m;
    const Eigen::Quaterniond& q = pose.rotation;
    start += fmt::format("{} {} {} {} {} {} {} {}\n", i, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  folder.write("start.tum", start);
  const std::string parts = "reference --buildings room.txt --airborne flight.csv ";
  const ProgramOutcome outcome =
      run_alces(folder, parts + "scans --start start.tum --out truth.tum --cell 0.05");
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("4 of 4 scans"));
  const Trajectory truth = read_trajectory(folder / "truth.tum");
  REQUIRE(truth.size() == 4);
  CHECK((truth.poses[3].translation_m - room_from_body(3).translation_m).norm() < 0.015);
  CHECK(run_alces(folder, "evaluate start.tum --truth truth.tum").status == 0);

  const auto check = [&](const std::string& arguments, int status, const std::string& names) {
    const ProgramOutcome bad = run_alces(folder, arguments);
    CAPTURE(arguments, bad.err);
    CHECK(bad.status == status);
    CHECK_THAT(bad.err, Contains(names));
  };
  check("reference scans --out t.tum", 2, "MAP");
  check(parts + "flight.csv scans --out t.tum", 2, "SCANS");
  check(parts + "scans --out t.tum", 3, "--start");
  check(parts + "scans --start start.tum --out /proc/t.tum", 5, "/proc/t.tum");
  check("reference missing.ply scans --start start.tum --out t.tum", 3, "missing.ply");
  folder.write("far.tum", "0 900 0 0 0 0 0 1\n1 900 0 0 0 0 0 1\n2 900 0 0 0 0 0 1\n3 900 0 0 0 0 0 1\n");
  check(parts + "scans --start far.tum --out far.truth.tum", 3, "no scan could be matched");
}

}  // namespace
}  // namespace alces::offline
