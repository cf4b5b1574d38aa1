// Pose graphs into other programs' files, into trajectories, and through a recording.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "alces_platform/recording/byte_source.h"
#include "alces_platform/recording/recording_reader.h"
#include "offline/io/map_folder/map_writer.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/optimize/graph/graph_file.h"
#include "refusal.h"
#include "run_alces.h"
#include "support/sample_graph.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;
using alces::test::sample_graph;
using Catch::Contains;

void convert(const TemporaryFolder& folder, const std::string& arguments) {
  const ProgramOutcome outcome = run_alces(folder, "convert " + arguments);
  INFO(arguments << ": " << outcome.err);
  REQUIRE(outcome.status == 0);
}

template <typename Matrix>
double difference(const Matrix& a, const Matrix& b) {
  return (a - b).norm() / std::max(1.0, a.norm());
}

void check_same(const ConstraintGraph& a, const ConstraintGraph& b, double tolerance = 1e-9) {
  REQUIRE(a.is_planar == b.is_planar);
  REQUIRE(a.vertices.size() == b.vertices.size());
  REQUIRE(a.constraints.size() == b.constraints.size());
  double worst = 0;
  for (std::size_t i = 0; i < a.vertices.size(); ++i) {
    REQUIRE(a.vertices[i].id == b.vertices[i].id);
    const Pose offset = a.vertices[i].map_from_body.inverse() * b.vertices[i].map_from_body;
    worst = std::max({worst, offset.translation_m.norm(), offset.rotation.vec().norm()});
  }
  for (std::size_t i = 0; i < a.constraints.size(); ++i) {
    const Constraint& c = a.constraints[i];
    const Constraint& d = b.constraints[i];
    REQUIRE(c.from == d.from);
    REQUIRE(c.to == d.to);
    const Pose offset = c.from_from_to.inverse() * d.from_from_to;
    worst = std::max({worst, offset.translation_m.norm(), offset.rotation.vec().norm()});
    worst = std::max(worst, a.is_planar ? difference(c.planar_information, d.planar_information)
                                        : difference(c.information, d.information));
  }
  CHECK(worst < tolerance);
  CHECK(chi_squared(b) == Approx(chi_squared(a)).epsilon(tolerance));
}

constexpr std::size_t closed_loops = 10;
constexpr EdgeVariance variance{0.01, 0.04, 0.0025, 0.0012};

/// A map folder whose edges are as a mapper writes them; the returned graph is that of its graph.g2o.
ConstraintGraph write_map(const fs::path& map) {
  fs::create_directories(map);
  ConstraintGraph graph = sample_graph({.streets = 4});
  nlohmann::json loops = nlohmann::json::array();
  for (Constraint& c : graph.constraints) {
    c.information = g2o_information(variance);
    if (c.to - c.from == 1) continue;
    loops.push_back({{"first", c.from},
                     {"last", c.to},
                     {"accepted", true},
                     {"reason", "closed"},
                     {"overlap", 0.75},
                     {"correction_deg", 90},
                     {"iterations", 11}});
  }
  REQUIRE(loops.size() == closed_loops);
  loops.push_back(
      {{"first", 3}, {"last", 20}, {"accepted", false}, {"reason", "too little overlap"}, {"rms_m", 0.5}});
  write_graph(map / "graph.g2o", graph, GraphFormat::g2o);
  Trajectory trajectory;
  trajectory.has_time = true;
  PlyMapWriter points(map / "map.ply");
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
    trajectory.stamps_s.push_back(1000.25 + static_cast<double>(i));
    trajectory.poses.push_back(graph.vertices[i].map_from_body);
    const std::vector<Point> ahead = {{1, 0, 0}};
    points.add(ahead, trajectory.poses.back(), static_cast<std::uint32_t>(i));
  }
  points.finish();
  write_tum(map / "trajectory.tum", trajectory);
  std::ofstream(map / "run.json") << nlohmann::json{{"loops", loops}};
  return graph;
}

}  // namespace

TEST_CASE("a pose graph goes to TORO's form and back unchanged, in 2D and in 3D") {
  const TemporaryFolder folder;
  const bool is_planar = GENERATE(false, true);
  CAPTURE(is_planar);
  const ConstraintGraph graph = sample_graph({.is_planar = is_planar});
  write_graph(folder / "a.g2o", graph, GraphFormat::g2o);
  convert(folder, "a.g2o b.graph");
  const GraphFile toro = read_graph(folder / "b.graph");
  CHECK(toro.format == GraphFormat::toro);
  check_same(graph, toro.graph);
  convert(folder, "b.graph c.g2o");
  CHECK(read_graph(folder / "c.g2o").format == GraphFormat::g2o);
  check_same(graph, read_graph(folder / "c.g2o").graph);
  convert(folder, "a.g2o d.txt --to toro");
  CHECK(content_of(folder / "d.txt") == content_of(folder / "b.graph"));
}

TEST_CASE("a pose graph becomes a trajectory in the order of its ids") {
  const TemporaryFolder folder;
  const bool is_planar = GENERATE(false, true);
  CAPTURE(is_planar);
  ConstraintGraph graph = sample_graph({.poses = 30, .loops = 0, .is_planar = is_planar});
  const std::vector<ConstraintVertex> vertices = graph.vertices;
  for (ConstraintVertex& vertex : graph.vertices) vertex.id = 100 - vertex.id;  // 100, 99, ...
  write_graph(folder / "a.g2o", graph, GraphFormat::g2o);
  for (const char* name : {"a.tum", "a.kitti", "frames"}) {
    CAPTURE(name);
    convert(folder, std::string("a.g2o ") + name);
    const Trajectory trajectory = read_trajectory(folder / name);
    REQUIRE(trajectory.size() == 30);
    double worst = 0;
    for (std::size_t i = 0; i < 30; ++i) {
      const Pose offset = trajectory.poses[i].inverse() * vertices[29 - i].map_from_body;
      worst = std::max({worst, offset.translation_m.norm(), offset.rotation.vec().norm()});
      if (is_planar) CHECK(trajectory.poses[i].translation_m.z() == 0);
    }
    CHECK(worst < 1e-6);
    CHECK_FALSE(trajectory.has_time);
  }
  CHECK(read_trajectory(folder / "a.tum").stamps_s.front() == 71);
}

TEST_CASE("a map's edges and loops are in its recording, each after the scan that ends it") {
  const TemporaryFolder folder;
  const ConstraintGraph graph = write_map(folder / "map");
  convert(folder, "map map.mcap");
  FileSource source((folder / "map.mcap").c_str());
  RecordingReader reader(source);
  REQUIRE(reader.open());
  std::size_t poses = 0;
  std::size_t edges = 0;
  std::size_t closing = 0;
  std::size_t closed = 0;
  std::size_t refused = 0;
  RecordedMessage message;
  while (reader.next(message)) {
    if (std::holds_alternative<PoseRecord>(message.content)) ++poses;
    if (const auto* edge = std::get_if<GraphEdgeRecord>(&message.content)) {
      ++edges;
      REQUIRE(std::max(edge->from, edge->to) + 1 == poses);
      CHECK(edge->stamp_ns == 1'000'250'000'000 + static_cast<std::int64_t>(poses - 1) * 1'000'000'000);
      CHECK(edge->x_m2 == Approx(variance.x_m2));
      CHECK(edge->y_m2 == Approx(variance.y_m2));
      CHECK(edge->z_m2 == Approx(variance.z_m2));
      CHECK(edge->rotation_rad2 == Approx(variance.rotation_rad2));
      CHECK(edge->closes_loop == (edge->to - edge->from != 1));
      if (edge->closes_loop) ++closing;
    }
    if (const auto* loop = std::get_if<LoopRecord>(&message.content)) {
      ++(loop->is_closed ? closed : refused);
      REQUIRE(loop->last + 1 == poses);
      CHECK(loop->verdict == (loop->is_closed ? "closed" : "too little overlap"));
      CHECK(loop->iterations == (loop->is_closed ? 11 : 0));
      CHECK(loop->correction_rad == Approx(loop->is_closed ? std::numbers::pi / 2 : 0));
      CHECK(loop->rms_m == (loop->is_closed ? 0 : 0.5));
    }
  }
  CHECK(poses == graph.vertices.size());
  CHECK(edges == graph.constraints.size());
  CHECK(closing == closed_loops);
  CHECK(closed == closed_loops);
  CHECK(refused == 1);

  convert(folder, "map.mcap back.g2o");
  ConstraintGraph back = read_graph(folder / "back.g2o").graph;
  ConstraintGraph in_order = graph;
  const auto by_ends = [](const Constraint& a, const Constraint& b) {
    return std::pair(a.to, a.from) < std::pair(b.to, b.from);
  };
  std::sort(back.constraints.begin(), back.constraints.end(), by_ends);
  std::sort(in_order.constraints.begin(), in_order.constraints.end(), by_ends);
  check_same(in_order, back, 1e-6);  // poses are those of trajectory.tum, to 1e-7 m
  convert(folder, "map direct.g2o");
  check_same(graph, read_graph(folder / "direct.g2o").graph);
}

TEST_CASE("what is no graph, or cannot become one, is refused in one sentence, and nothing is left behind") {
  const TemporaryFolder folder;
  const std::string vertices = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\n";
  const std::string edge = "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n";
  folder.write("good.g2o", vertices + edge);
  folder.write("tag.g2o", vertices + "VERTEX_XY 2 0 0\n");
  folder.write("missing.g2o", vertices + "EDGE_SE2 0 7 1 0 0 1 0 0 1 0 1\n");
  folder.write("twice.graph", "VERTEX2 0 0 0 0\nVERTEX2 0 1 0 0\n");
  folder.write("nan.g2o", "VERTEX_SE2 0 0 nan 0\n");
  folder.write("singular.g2o", vertices + "EDGE_SE2 0 1 1 0 0 0 0 0 1 0 1\n");
  folder.write("cut.g2o", vertices + edge.substr(0, 20));
  folder.write("empty.g2o", "");
  folder.write("one.tum", "0 0 0 0 0 0 0 1\n");
  folder.write("cloud.xyz", "1,2,3\n");
  const auto refuse = [&](const std::string& arguments, int status, const char* words) {
    check_refusal(folder, "convert " + arguments, status, words);
  };
  refuse("tag.g2o out.graph", 3, "tag.g2o:3");
  refuse("missing.g2o out.graph", 3, "missing.g2o:3");
  refuse("twice.graph out.g2o", 3, "twice.graph:2");
  refuse("nan.g2o out.tum", 3, "nan.g2o:1");
  refuse("singular.g2o out.graph", 3, "singular.g2o:3");
  refuse("cut.g2o out.kitti", 3, "cut.g2o:3");
  refuse("empty.g2o out.graph", 3, "empty.g2o");
  refuse("nowhere.g2o out.graph", 3, "does not exist");
  refuse("good.g2o out.ply", 2, "has no points");
  refuse("good.g2o out.mcap", 2, "has no points");
  refuse("one.tum out.g2o", 2, "no edges");
  refuse("cloud.xyz out.graph", 2, "no edges");
  refuse("good.g2o /dev/full --to toro", 5, "/dev/full");
  refuse("good.g2o nowhere/out.graph", 5, "nowhere");
  write_map(folder / "map");
  folder.write("map/run.json", R"({"loops": [{"first": 3, "last": 200}]})");
  refuse("map out.mcap", 3, "loop 0 names no scan below 200 as \"last\"");
  folder.write("map/run.json", "{");
  refuse("map out.mcap", 3, "is no JSON object");
  fs::remove(folder / "map/run.json");
  folder.write("map/graph.g2o", vertices + edge);
  refuse("map out.mcap", 3, "map the scans again");
  fs::remove(folder / "map/graph.g2o");
  refuse("map out.g2o", 3, "holds no graph.g2o");
  convert(folder, "map edgeless.mcap");
  refuse("edgeless.mcap out.g2o", 3, "no edges of a pose graph");
  for (const char* name :
       {"out.g2o", "out.graph", "out.tum", "out.kitti", "out.ply", "out.mcap", "out.mcap.part"})
    CHECK_FALSE(fs::exists(folder / name));
}

}  // namespace alces::offline
