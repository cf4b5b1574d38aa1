#include "offline/optimize/graph/graph_file.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <numbers>
#include <string>

#include "offline/optimize/graph/graph_parts.h"
#include "offline/optimize/graph/planar_pose.h"
#include "support/test_data.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

constexpr const char* unit_information = " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n";

std::string edge_3d(int from, int to) {
  return "EDGE_SE3:QUAT " + std::to_string(from) + " " + std::to_string(to) + " 1 0 0 0 0 0 1" +
         unit_information;
}

/// What reading `text` complains of.
std::string complaint(const std::string& text) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.write("a.g2o", text);
  try {
    static_cast<void>(read_graph(file));
  } catch (const InputError& error) {
    const std::string sentence = error.what();
    const std::string name = file.string();
    CHECK_THAT(sentence, Catch::StartsWith(name));
    return sentence.substr(name.size());
  }
  return "none";
}

ConstraintGraph read_text(const std::string& text) {
  const TemporaryFolder folder;
  return read_graph(folder.write("a.g2o", text)).graph;
}

}  // namespace

TEST_CASE("graph files: g2o in 3D, edges before vertices, ids with gaps, comments, Windows line ends") {
  const ConstraintGraph graph = read_text("# a comment\r\n" + edge_3d(7, 9000000) +
                                          "\n  VERTEX_SE3:QUAT 9000000 1 2 3 0 0 0.6 0.8\r\n"
                                          "VERTEX_SE3:QUAT 7 0 0 0 0 0 0 1\nFIX 7");
  REQUIRE(graph.vertices.size() == 2);
  REQUIRE(graph.constraints.size() == 1);
  CHECK_FALSE(graph.is_planar);
  CHECK(graph.vertices[0].id == 9000000);
  CHECK(graph.vertices[0].map_from_body.translation_m == Eigen::Vector3d(1, 2, 3));
  CHECK(graph.vertices[0].map_from_body.rotation.z() == Approx(0.6));
  CHECK_FALSE(graph.vertices[0].is_fixed);
  CHECK(graph.vertices[1].is_fixed);
  CHECK(graph.constraints[0].from == 1);
  CHECK(graph.constraints[0].to == 0);
  CHECK(graph.constraints[0].information == Matrix6d::Identity());
}

TEST_CASE("graph files: g2o and TORO order a planar edge's information each in its own way") {
  const ConstraintGraph g2o =
      read_text("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 2 0.5\nEDGE_SE2 0 1 1 2 0.5 11 0.12 0.13 22 0.23 33\n");
  const ConstraintGraph toro =
      read_text("VERTEX2 0 0 0 0\nVERTEX2 1 1 2 0.5\nEDGE2 0 1 1 2 0.5 11 0.12 22 33 0.13 0.23\n");
  Eigen::Matrix3d expected;
  expected << 11, 0.12, 0.13, 0.12, 22, 0.23, 0.13, 0.23, 33;
  CHECK(g2o.is_planar);
  CHECK(toro.is_planar);
  CHECK(g2o.constraints[0].planar_information == expected);
  CHECK(toro.constraints[0].planar_information == expected);
  CHECK(heading_rad(g2o.vertices[1].map_from_body) == Approx(0.5));
  CHECK(chi_squared(g2o) == Approx(0).margin(1e-24));
}

TEST_CASE("graph files: Euler angles are yaw after pitch after roll, and their information counts twice") {
  const ConstraintGraph graph = read_text(
      "VERTEX3 0 0 0 0 0 0 0\nVERTEX3 1 0 0 0 1.5707963267948966 0 1.5707963267948966\n"
      "EDGE3 0 1 0 0 0 0 0 0 1 0 0 0.1 0 0 1 0 0 0 0 1 0 0 0 100 0 0 100 0 25\n");
  // roll takes y to z, then yaw leaves z
  const Eigen::Vector3d y = graph.vertices[1].map_from_body.rotation * Eigen::Vector3d::UnitY();
  CHECK((y - Eigen::Vector3d::UnitZ()).norm() < 1e-12);
  const Matrix6d& information = graph.constraints[0].information;
  CHECK(information(0, 0) == 1);
  CHECK(information(0, 3) == 0.2);
  CHECK(information(3, 0) == 0.2);
  CHECK(information(3, 3) == 400);
  CHECK(information(5, 5) == 100);
}

TEST_CASE("graph files: what is written reads back the same, in each format and dimension") {
  const char* const files[] = {"tinyGrid3D.g2o", "MIT.g2o", "CSAIL_P_toro.graph", "sphere_mednoise.graph"};
  for (const char* const name : files) {
    const std::string data = std::string("pose_graphs/") + name;
    if (!test::has_test_data(data)) return;
    const GraphFile first = read_graph(test::test_data(data));
    for (const GraphFormat format : {GraphFormat::g2o, GraphFormat::toro}) {
      CAPTURE(name, static_cast<int>(format));
      const TemporaryFolder folder;
      write_graph(folder / "out", first.graph, format);
      const GraphFile second = read_graph(folder / "out");
      CHECK(second.format == format);
      CHECK(second.graph.is_planar == first.graph.is_planar);
      REQUIRE(second.graph.vertices.size() == first.graph.vertices.size());
      REQUIRE(second.graph.constraints.size() == first.graph.constraints.size());
      double worst = 0;
      bool same_information = true;
      bool same_ends = true;
      for (std::size_t i = 0; i < first.graph.constraints.size(); ++i) {
        const Constraint& a = first.graph.constraints[i];
        const Constraint& b = second.graph.constraints[i];
        same_ends = same_ends && a.from == b.from && a.to == b.to;
        same_information = same_information && a.information == b.information &&
                           a.planar_information == b.planar_information;
        worst = std::max(worst, (a.from_from_to.translation_m - b.from_from_to.translation_m).norm());
        worst = std::max(worst, angle_between_rad(a.from_from_to.rotation, b.from_from_to.rotation));
      }
      CHECK(same_ends);
      CHECK(same_information);
      CHECK(worst < 1e-7);
    }
  }
}

TEST_CASE("graph files: FIX is written where it says more than that the first vertex stays") {
  const TemporaryFolder folder;
  ConstraintGraph graph = read_text("VERTEX_SE2 3 0 0 0\nVERTEX_SE2 4 1 0 0\nFIX 3\n");
  write_graph(folder / "out.g2o", graph, GraphFormat::g2o);
  CHECK_THAT(content_of(folder / "out.g2o"), Contains("FIX 3\n"));
  write_graph(folder / "out.graph", graph, GraphFormat::toro);
  CHECK_THAT(content_of(folder / "out.graph"), !Contains("FIX"));
  graph.vertices[1].is_fixed = true;
  write_graph(folder / "out.graph", graph, GraphFormat::toro);
  CHECK_THAT(content_of(folder / "out.graph"), Contains("FIX 4\n"));
}

TEST_CASE("graph files: an unknown tag is named, with its line and what is read") {
  CHECK_THAT(complaint("VERTEX_SE2 0 0 0 0\nVERTEX_TRACKXYZ 1 0 0 0\n"),
             Contains(":2: the tag 'VERTEX_TRACKXYZ' is not known") && Contains("EDGE_SE3:QUAT"));
  CHECK_THAT(complaint(std::string("\x7f"
                                   "ELF\0\1\2",
                                   7)),
             Contains(":1: the tag"));
}

TEST_CASE("graph files: an edge to a missing vertex, and FIX of one, are named with their lines") {
  CHECK_THAT(complaint(edge_3d(0, 5) + "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n"),
             Contains(":1: an edge to vertex 5, which the file does not hold"));
  CHECK_THAT(complaint("VERTEX_SE2 0 0 0 0\nFIX 0 8\n"), Contains(":2: FIX of vertex 8"));
}

TEST_CASE("graph files: information must be positive definite") {
  const std::string vertices = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 0 0 0\n";
  CHECK_THAT(complaint(vertices + "EDGE_SE2 0 1 0 0 0 1 2 0 1 0 1\n"),
             Contains(":3: the information of the edge from 0 to 1 is not positive definite"));
  CHECK_THAT(complaint(vertices + "EDGE_SE2 0 1 0 0 0 1 0 0 0 0 1\n"), Contains("not positive definite"));
  CHECK_THAT(complaint("EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 -1 0 0 1 0 1\n"),
             Contains("not positive definite"));
}

TEST_CASE("graph files: NaN and infinity are turned away wherever they stand") {
  CHECK_THAT(complaint("VERTEX_SE2 0 nan 0 0\n"), Contains(":1: VERTEX_SE2 holds NaN or Inf"));
  CHECK_THAT(complaint("VERTEX3 0 0 0 0 0 inf 0\n"), Contains("NaN or Inf"));
  CHECK_THAT(complaint("EDGE_SE2 0 1 0 0 0 1 0 0 NaN 0 1\n"), Contains("NaN or Inf"));
  CHECK_THAT(complaint("VERTEX_SE2 0 1e999 0 0\n"), Contains("NaN or Inf"));
  CHECK_THAT(complaint("VERTEX_SE2 0 1e200 0 0\n"), Contains("is no place"));
}

TEST_CASE("graph files: a vertex stands in a file once") {
  CHECK_THAT(complaint("VERTEX_SE2 4 0 0 0\nVERTEX_SE2 5 0 0 0\n\nVERTEX_SE2 4 0 0 0\n"),
             Contains(":4: vertex 4 has been given before, as the 1. vertex"));
}

TEST_CASE("graph files: an edge joins two vertices, not one to itself") {
  CHECK_THAT(complaint("VERTEX_SE2 0 0 0 0\nEDGE_SE2 0 0 0 0 0 1 0 0 1 0 1\n"),
             Contains(":2: an edge from vertex 0 to itself"));
}

TEST_CASE("graph files: lines that are cut off or too long") {
  CHECK_THAT(complaint("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 0 0 0\nEDGE_SE2 0 1 0 0 0 1 0 0 1"),
             Contains(":3: EDGE_SE2 has 7 numbers after its ids, 9 are expected; is the line cut off?"));
  CHECK_THAT(complaint("VERTEX_SE2 0 0 0 0 0\n"), Contains("has 4 numbers after its ids, 3 are expected"));
  CHECK_THAT(complaint("VERTEX_SE2"), Contains("needs a vertex's id here"));
  CHECK_THAT(complaint("EDGE_SE2 0\n 1 0 0 0 1 0 0 1 0 1\n"), Contains(":1: EDGE_SE2 needs a vertex's id"));
  CHECK_THAT(complaint("VERTEX_SE2 0 1 2 x\n"), Contains("no number after the first 2"));
  CHECK_THAT(complaint("FIX\nVERTEX_SE2 0 1 2 3\n"), Contains(":1: FIX needs a vertex's id"));
}

TEST_CASE("graph files: an empty file, one of comments, one of edges only") {
  CHECK_THAT(complaint(""), Contains("holds no pose graph"));
  CHECK_THAT(complaint("# nothing\n\n"), Contains("holds no pose graph"));
}

TEST_CASE("graph files: edges alone get their vertices by number, and poses along them") {
  const TemporaryFolder folder;
  const GraphFile file = read_graph(folder.write("a.g2o", edge_3d(9, 4) + edge_3d(4, 7)));
  CHECK_FALSE(file.has_poses);
  REQUIRE(file.graph.vertices.size() == 3);
  CHECK(file.graph.vertices[0].id == 4);
  CHECK(file.graph.vertices[2].id == 9);
  CHECK_FALSE(file.graph.vertices[0].is_fixed);
  CHECK(file.graph.vertices[0].map_from_body.translation_m.x() == 0);
  CHECK(file.graph.vertices[1].map_from_body.translation_m.x() == 1);
  CHECK(file.graph.vertices[2].map_from_body.translation_m.x() == -1);
  CHECK(
      read_graph(folder.write("b.g2o", "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 0 0 0 0 0 0 1\n" +
                                           edge_3d(0, 1)))
          .has_poses);
}

TEST_CASE("graph files: a quaternion has length 1, but for rounding") {
  CHECK_THAT(complaint("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 0\n"), Contains(":1: the quaternion has length 0"));
  CHECK_THAT(complaint("VERTEX_SE3:QUAT 0 0 0 0 5 6 7 8\n"), Contains("instead of 1"));
  CHECK(read_text("VERTEX_SE3:QUAT 0 0 0 0 0 0 0.6001 0.8\n").vertices[0].map_from_body.rotation.norm() ==
        Approx(1).epsilon(1e-15));
}

TEST_CASE("graph files: ids up to the largest 64-bit number, none below 0 and none above") {
  CHECK(read_text("VERTEX_SE2 9223372036854775807 0 0 0\n").vertices[0].id == INT64_MAX);
  CHECK_THAT(complaint("VERTEX_SE2 9223372036854775808 0 0 0\n"), Contains(":1: an id of VERTEX_SE2"));
  CHECK_THAT(complaint("VERTEX_SE2 -1 0 0 0\n"), Contains("is not between 0 and 9223372036854775807"));
  CHECK_THAT(complaint("VERTEX_SE2 1.5 0 0 0\n"), Contains("a whole number"));
}

TEST_CASE("graph files: 2D and 3D do not mix") {
  CHECK_THAT(complaint("VERTEX_SE2 0 0 0 0\n" + edge_3d(0, 1)),
             Contains(":2: EDGE_SE3:QUAT in a file that began with VERTEX_SE2"));
}

TEST_CASE("graph files: a file that is not there, a folder, a full disk") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_graph(folder / "none.g2o"), Contains("none.g2o: cannot be read"));
  CHECK_THROWS_WITH(read_graph(folder.path()), Contains("is a folder"));
  const ConstraintGraph graph = read_text("VERTEX_SE2 0 0 0 0\n");
  CHECK_THROWS_WITH(write_graph("/dev/full", graph, GraphFormat::g2o), Contains("the disk is full"));
}

TEST_CASE("parts of a graph are counted and named by their first vertices") {
  ConstraintGraph graph;
  graph.vertices.resize(6);
  for (std::uint32_t i = 0; i < 6; ++i) graph.vertices[i].id = 10 + i;
  const auto join = [&](std::uint32_t from, std::uint32_t to) {
    graph.constraints.emplace_back();
    graph.constraints.back().from = from;
    graph.constraints.back().to = to;
  };
  join(5, 0);
  join(3, 1);
  join(2, 5);
  const GraphParts parts = graph_parts(graph);
  CHECK(parts.part_of_vertex == std::vector<std::uint32_t>{0, 1, 0, 1, 2, 0});
  CHECK(parts.first_vertex == std::vector<std::uint32_t>{0, 1, 4});
  CHECK(parts.vertex_count == std::vector<std::uint32_t>{3, 2, 1});
  CHECK_THROWS_WITH(require_connected(graph),
                    Contains("3 parts") && Contains("begins at vertex 11 (2 of 6 vertices)"));
  join(4, 1);
  join(1, 0);
  CHECK_NOTHROW(require_connected(graph));
}
