#include "offline/io/map_folder/map_writer.h"

#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <sstream>
#include <vector>

#include "offline/io/files/output_file.h"
#include "offline/io/scans/scan_source.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

Pose pose_at(double x, double y, double yaw_rad) {
  Pose pose;
  pose.translation_m = {x, y, 0};
  pose.rotation = exp_so3({0, 0, yaw_rad});
  return pose;
}

struct Graph {
  std::vector<std::byte> memory = std::vector<std::byte>(65536 + Arena::alignment);
  Arena arena{aligned()};
  PoseGraph graph{arena, {.vertices = 10, .edges = 10}};

  std::span<std::byte> aligned() {
    void* start = memory.data();
    std::size_t space = memory.size();
    return {static_cast<std::byte*>(std::align(Arena::alignment, 65536, start, space)), 65536};
  }
};

}  // namespace

TEST_CASE("graph.g2o holds vertices, the fixed first one, and edges with 21 entries of information") {
  const TemporaryFolder folder;
  Graph g;
  REQUIRE(g.graph.add_vertex(Pose{}) == Status::ok);
  REQUIRE(g.graph.add_vertex(pose_at(1.0 / 3.0, 0, 1.5)) == Status::ok);
  Edge edge;
  edge.to = 1;
  edge.from_from_to = pose_at(1.0 / 3.0, 0, 1.5);
  edge.variance = {0.01, 0.04, 0.25, 0.003};
  REQUIRE(g.graph.add_edge(edge) == Status::ok);
  write_g2o(folder / "graph.g2o", g.graph);

  std::istringstream lines(content_of(folder / "graph.g2o"));
  std::string line;
  std::vector<std::string> tags;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string tag;
    words >> tag;
    tags.push_back(tag);
    if (tag != "EDGE_SE3:QUAT") continue;
    int from = -1;
    int to = -1;
    words >> from >> to;
    CHECK(from == 0);
    CHECK(to == 1);
    std::array<double, 7> pose{};
    for (double& number : pose) words >> number;
    CHECK(pose[0] == 1.0 / 3.0);
    CHECK(pose[5] == edge.from_from_to.rotation.z());
    const Matrix6d expected = g2o_information(edge.variance);
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) {
        double number = -1;
        words >> number;
        CHECK(number == Approx(expected(row, column)).margin(1e-9));
      }
    }
    CHECK(words);
    words >> tag;
    CHECK(words.eof());
  }
  CHECK(tags == std::vector<std::string>{"VERTEX_SE3:QUAT", "VERTEX_SE3:QUAT", "FIX", "EDGE_SE3:QUAT"});
  CHECK_THAT(content_of(folder / "graph.g2o"), Contains("\nFIX 0\n"));
}

TEST_CASE("g2o's information is that of its error vector: body axes of `to`, half angles") {
  const EdgeVariance variance = {0.01, 0.04, 0.25, 0.003};
  const Matrix6d straight = g2o_information(variance);
  CHECK(straight(0, 0) == Approx(100));
  CHECK(straight(1, 1) == Approx(25));
  CHECK(straight(2, 2) == Approx(4));
  CHECK(straight(0, 1) == 0);
  // 0.001 rad^2 an axis; half an angle has a quarter of its variance
  for (int axis = 3; axis < 6; ++axis) CHECK(straight(axis, axis) == Approx(4000));
  const Matrix6d by_axis = g2o_information({0.01, 0.04, 0.25, 0.003, {0.6, 0.3, 0.1}});  // heading is surest
  CHECK(by_axis(3, 3) == Approx(4 / 0.0018));
  CHECK(by_axis(4, 4) == Approx(4 / 0.0009));
  CHECK(by_axis(5, 5) == Approx(4 / 0.0003));
}

TEST_CASE("map.ply takes points as they come, knows its count at the end, and can be read again") {
  const TemporaryFolder folder;
  PlyMapWriter writer(folder / "map.ply");
  std::vector<Point> points(100000, Point{1, 2, 3});
  points[7].x = std::nanf("");
  writer.add(points, Pose{}, 0);
  writer.add(std::vector<Point>{{1, 0, 0}}, pose_at(10, 20, std::acos(-1.0) / 2), 258);
  CHECK_FALSE(std::filesystem::exists(folder / "map.ply"));
  writer.finish();
  CHECK(writer.written() == 100000);
  CHECK(writer.not_finite() == 1);

  const std::string file = content_of(folder / "map.ply");
  CHECK_THAT(file.substr(0, 300), Contains("right-handed, x forward, y left, z up, metres, origin scan 0"));
  CHECK(file.substr(file.size() - 4) == std::string("\x02\x01\0\0", 4));
  ScanPoints scan;
  open_scans(folder / "map.ply")->read(0, scan);
  const std::vector<Point>& back = scan.points;
  REQUIRE(back.size() == 100000);
  CHECK(back[99998].z == 3);
  CHECK(back[99999].x == Approx(10));
  CHECK(back[99999].y == Approx(21));
}

TEST_CASE("map.ply with colours: 15 bytes a point") {
  const TemporaryFolder folder;
  PlyMapWriter writer(folder / "map.ply", PlyMapWriter::Attribute::color);
  const std::vector<Point> points = {{1, 2, 3}, {4, 5, 6}};
  writer.add(points, Pose{}, std::vector<Rgb>{{1, 2, 3}, {4, 5, 6}});
  writer.add(points, Pose{}, Rgb{7, 8, 9});
  writer.finish();
  const std::string file = content_of(folder / "map.ply");
  CHECK(file.size() - file.find("end_header\n") - 11 == 4 * 15);
  CHECK(file.substr(file.size() - 3) == "\x07\x08\x09");
  ScanPoints scan;
  open_scans(folder / "map.ply")->read(0, scan);
  const std::vector<Point>& back = scan.points;
  REQUIRE(back.size() == 4);
  CHECK(back[3].z == 6);
}

TEST_CASE("a map that is not finished leaves nothing behind, and an old one whole") {
  const TemporaryFolder folder;
  folder.write("map.ply", "old");
  {
    PlyMapWriter writer(folder / "map.ply");
    writer.add(std::vector<Point>(200000), Pose{}, 0);
  }
  CHECK(content_of(folder / "map.ply") == "old");
  CHECK_FALSE(std::filesystem::exists(folder / "map.ply.part"));
}

TEST_CASE("a full disk is an error of every writer") {
  if (!std::filesystem::exists("/dev/full")) {
    WARN("/dev/full not found");
    return;
  }
  Graph g;
  REQUIRE(g.graph.add_vertex(Pose{}) == Status::ok);
  const Trajectory one = {{0}, {Pose{}}, false};
  CHECK_THROWS_WITH(write_g2o("/dev/full", g.graph), Contains("/dev/full") && Contains("full"));
  CHECK_THROWS_AS(write_tum("/dev/full", one), OutputError);
  CHECK_THROWS_AS(write_kitti("/dev/full", one), OutputError);
  PlyMapWriter writer("/dev/full");
  CHECK_THROWS_AS(writer.finish(), OutputError);
  PlyMapWriter long_writer("/dev/full");
  CHECK_THROWS_AS(long_writer.add(std::vector<Point>(200000), Pose{}, 0), OutputError);
}

TEST_CASE(
    "a folder in the place of a file, a file in the place of a folder, and no folder at all are errors") {
  const TemporaryFolder folder;
  const Trajectory one = {{0}, {Pose{}}, false};
  std::filesystem::create_directory(folder / "graph.g2o");
  CHECK_THROWS_WITH(write_tum(folder / "graph.g2o", one), Contains("folder of that name"));
  folder.write("frames", "a file");
  CHECK_THROWS_WITH(write_3dtk_frames(folder / "frames", one), Contains("frames"));
  CHECK_THROWS_WITH(write_tum(folder / "frames/trajectory.tum", one), Contains("trajectory.tum"));
  CHECK_THROWS_WITH(write_tum(folder / "nowhere/trajectory.tum", one), Contains("folder must exist"));
  CHECK_THROWS_AS(PlyMapWriter(folder / "nowhere/map.ply"), OutputError);
}

TEST_CASE("a folder without permission is an error") {
  if (::geteuid() == 0) {
    WARN("root may write everywhere, permission not tested");
    return;
  }
  const TemporaryFolder folder;
  std::filesystem::permissions(folder.path(),
                               std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  CHECK_THROWS_WITH(write_tum(folder / "trajectory.tum", {}), Contains("ermission"));
  std::filesystem::permissions(folder.path(), std::filesystem::perms::owner_all);
}

TEST_CASE("a symbolic link stays one, the file behind it is replaced") {
  const TemporaryFolder folder;
  folder.write("real.tum", "old");
  std::filesystem::create_symlink("real.tum", folder / "trajectory.tum");
  write_tum(folder / "trajectory.tum", {{5}, {Pose{}}, false});
  CHECK(std::filesystem::is_symlink(folder / "trajectory.tum"));
  CHECK(content_of(folder / "real.tum").substr(0, 2) == "5 ");
}
