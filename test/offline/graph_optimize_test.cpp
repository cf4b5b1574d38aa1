// `alces optimize` as a script sees it, and the map folders that it reads and writes.
#include <sys/wait.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "offline/io/files/output_file.h"
#include "offline/io/map_folder/map_writer.h"
#include "offline/io/map_folder/scan_table.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/optimize/graph/graph_file.h"
#include "offline/optimize/graph/map_graph.h"
#include "support/sample_graph.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using alces::test::sample_graph;
using Catch::Contains;

namespace {

struct Outcome {
  int status = 0;
  std::string out;
  std::string err;
};

Outcome run(const TemporaryFolder& folder, const std::string& arguments) {
  const std::string command = "cd '" + folder.path().string() + "' && '" ALCES_PROGRAM "' optimize " +
                              arguments + " >stdout.txt 2>stderr.txt </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(folder / "stdout.txt"),
          content_of(folder / "stderr.txt")};
}

std::vector<std::string> names_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

/// A map folder of a drive whose scans are one point each, 1 m ahead.
ConstraintGraph make_map(const std::filesystem::path& folder) {
  make_folder(folder);
  const ConstraintGraph graph = sample_graph({.poses = 60, .loops = 6, .streets = 3});
  write_graph(folder / "graph.g2o", graph, GraphFormat::g2o);
  Trajectory trajectory;
  PlyMapWriter points(folder / "map.ply");
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
    trajectory.stamps_s.push_back(static_cast<double>(i + 10));  // the first scan was number 10
    trajectory.poses.push_back(graph.vertices[i].map_from_body);
    const std::vector<Point> ahead = {{1, 0, 0}};
    points.add(ahead, trajectory.poses.back(), static_cast<std::uint32_t>(i + 10));
  }
  points.finish();
  write_tum(folder / "trajectory.tum", trajectory);
  std::ofstream(folder / "run.json") << R"({"loops": [], "complete": true})";
  return graph;
}

}  // namespace

TEST_CASE("optimize: a graph file comes out as one, in the format of its name") {
  const TemporaryFolder folder;
  const ConstraintGraph graph = sample_graph({.is_planar = true});
  write_graph(folder / "in.g2o", graph, GraphFormat::g2o);
  const Outcome gn = run(folder, "in.g2o --out out.graph --json");
  REQUIRE(gn.status == 0);
  const auto json = nlohmann::json::parse(gn.out);
  CHECK(json["with"] == "gn");
  CHECK(json["planar"] == true);
  CHECK(json["end"] == "converged");
  CHECK(json["chi_squared_before"].get<double>() == Approx(chi_squared(graph)));
  const GraphFile out = read_graph(folder / "out.graph");
  CHECK(out.format == GraphFormat::toro);
  CHECK(chi_squared(out.graph) == Approx(json["chi_squared"].get<double>()));

  const Outcome elch = run(folder, "in.g2o --with elch --out out.g2o");
  REQUIRE(elch.status == 0);
  CHECK_THAT(elch.out, Contains("loops closed") && Contains("planar"));
  CHECK(chi_squared(read_graph(folder / "out.g2o").graph) > chi_squared(out.graph));
  const Outcome paper = run(folder, "in.g2o --with elch --sharing paper --out paper.g2o --json");
  CHECK(nlohmann::json::parse(paper.out)["sharing"] == "paper");
  CHECK(content_of(folder / "paper.g2o") != content_of(folder / "out.g2o"));
}

TEST_CASE("optimize: every method takes a graph file, and none makes it worse") {
  const TemporaryFolder folder;
  const ConstraintGraph graph = sample_graph({.poses = 60, .loops = 6, .streets = 3});
  write_graph(folder / "in.g2o", graph, GraphFormat::g2o);
  for (const char* method : {"gn", "toro", "hogman"}) {
    CAPTURE(method);
    const Outcome outcome = run(folder, std::string("in.g2o --out out.g2o --json --with ") + method);
    INFO(outcome.err);
    REQUIRE(outcome.status == 0);
    CHECK(nlohmann::json::parse(outcome.out).is_object());
    CHECK(chi_squared(read_graph(folder / "out.g2o").graph) <= chi_squared(graph));
  }
}

TEST_CASE("optimize: a graph file and a folder's name give graph.g2o and trajectory.tum") {
  const TemporaryFolder folder;
  write_graph(folder / "in.graph", sample_graph({}), GraphFormat::toro);
  REQUIRE(run(folder, "in.graph --out better").status == 0);
  CHECK(names_in(folder / "better") == std::vector<std::string>{"graph.g2o", "trajectory.tum"});
  CHECK(read_trajectory(folder / "better").size() == 200);
}

TEST_CASE("optimize: of a map folder a whole one comes out, every scan's points moved with its pose") {
  const TemporaryFolder folder;
  make_map(folder / "map");
  const Outcome outcome = run(folder, "map --out better");
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  CHECK(names_in(folder / "better") ==
        std::vector<std::string>{"frames", "graph.g2o", "map.ply", "run.json", "trajectory.tum"});
  const Trajectory trajectory = read_trajectory(folder / "better");
  CHECK(trajectory.stamps_s.front() == 10);
  CHECK(names_in(folder / "better" / "frames").size() == 60);
  CHECK(std::filesystem::exists(folder / "better" / "frames" / "scan010.frames"));
  const auto report = nlohmann::json::parse(content_of(folder / "better" / "run.json"));
  CHECK(report["complete"] == true);
  CHECK(report["optimize"]["chi_squared"].get<double>() <
        report["optimize"]["chi_squared_before"].get<double>());

  const std::string ply = content_of(folder / "better" / "map.ply");
  const char* at = ply.data() + ply.find("end_header\n") + 11;
  REQUIRE(ply.data() + ply.size() - at == 60 * 16);
  double most_moved_m = 0;
  const Trajectory before = read_trajectory(folder / "map");
  for (std::size_t i = 0; i < 60; ++i, at += 16) {
    Eigen::Vector3f xyz;
    std::memcpy(xyz.data(), at, sizeof(xyz));
    const Eigen::Vector3d expected = trajectory.poses[i] * Eigen::Vector3d(1, 0, 0);
    REQUIRE((xyz.cast<double>() - expected).norm() < 1e-4);
    most_moved_m =
        std::max(most_moved_m, (before.poses[i].translation_m - trajectory.poses[i].translation_m).norm());
  }
  CHECK(most_moved_m > 0.01);
}

TEST_CASE("optimize: what a report tells of the drive comes along, and nothing of an earlier map stays") {
  const TemporaryFolder folder;
  const ConstraintGraph graph = make_map(folder / "map");
  Trajectory without_loops = read_trajectory(folder / "map");
  for (Pose& pose : without_loops.poses) pose.translation_m.x() += 1;
  write_tum(folder / "map/trajectory_without_loops.tum", without_loops);
  ScanTable table;
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
    ScanRow row;
    row.scan = i + 10;
    row.points = 1;
    row.overlap = 0.5;
    table.rows.push_back(row);
  }
  write_scan_table(folder / "map/scans.csv", table);
  folder.write("map/counters.csv", "time_s,gps.fixes\n0,1\n1,2\n");
  REQUIRE(run(folder, "map --out better").status == 0);
  for (const char* name : {"trajectory_without_loops.tum", "scans.csv", "counters.csv"}) {
    CAPTURE(name);
    CHECK(content_of(folder / "better" / name) == content_of(folder / "map" / name));
  }
  const std::string report = "cd '" + folder.path().string() +
                             "' && '" ALCES_PROGRAM
                             "' report better --out better.html >stdout.txt 2>stderr.txt </dev/null";
  const int status = std::system(report.c_str());
  if (WEXITSTATUS(status) == 5) {
    CHECK_THAT(content_of(folder / "stderr.txt"), Contains("built without the page"));
  } else {
    REQUIRE(status == 0);
    const std::string html = content_of(folder / "better.html");
    for (const char* figure : {"\"before_x\"", "\"rms_m\"", "\"gps.fixes\""})
      CHECK_THAT(html, Contains(figure));
  }

  folder.write("better/covariances.csv", "scan,stamp\n");
  for (const char* name : {"trajectory_without_loops.tum", "scans.csv", "counters.csv"})
    std::filesystem::remove(folder / "map" / name);
  REQUIRE(run(folder, "map --out better").status == 0);
  CHECK(names_in(folder / "better") ==
        std::vector<std::string>{"frames", "graph.g2o", "map.ply", "run.json", "trajectory.tum"});
}

TEST_CASE("optimize: what cannot work ends in one sentence, and nothing is written") {
  const TemporaryFolder folder;
  make_map(folder / "map");
  folder.write("bad.g2o", "VERTEX_SE2 0 0 0 0\nVERTEX_XY 1 0 0\n");
  folder.write("parts.g2o", "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 0 0 0\n");
  struct Case {
    const char* arguments;
    int status;
    const char* sentence;
  };
  for (const Case& c : {Case{"bad.g2o --out o.g2o", 3, "bad.g2o:2: the tag 'VERTEX_XY'"},
                        {"parts.g2o --out o.g2o", 3, "falls into 2 parts"},
                        {"none.g2o --out o.g2o", 3, "none.g2o: cannot be read"},
                        {"map --out o.g2o", 2, "name a folder"},
                        {"map --out map", 2, "is the map itself"},
                        {"map --with elch --robust dcs --out o", 2, "--robust belongs to --with gn"},
                        {"map --sharing paper --out o", 2, "--sharing belongs to --with elch"},
                        {"map --with magic --out o", 2, "magic"},
                        {"map", 2, "--out"}}) {
    CAPTURE(c.arguments);
    const Outcome outcome = run(folder, c.arguments);
    CHECK(outcome.status == c.status);
    CHECK_THAT(outcome.err, Contains(c.sentence));
    CHECK(outcome.out.empty());
    CHECK_FALSE(std::filesystem::exists(folder / "o.g2o"));
    CHECK_FALSE(std::filesystem::exists(folder / "o"));
  }
}

TEST_CASE("optimize: a full disk") {
  const TemporaryFolder folder;
  write_graph(folder / "in.g2o", sample_graph({}), GraphFormat::g2o);
  std::filesystem::create_symlink("/dev/full", folder / "full.g2o");
  const Outcome outcome = run(folder, "in.g2o --out full.g2o");
  CHECK(outcome.status == 5);
  CHECK_THAT(outcome.err, Contains("the disk is full"));
}

TEST_CASE("optimize: a map folder whose files do not belong together leaves no folder behind") {
  const TemporaryFolder folder;
  make_map(folder / "map");
  SECTION("a point of a scan that is not in the trajectory") {
    PlyMapWriter points(folder / "map" / "map.ply");
    const std::vector<Point> one = {{1, 0, 0}};
    points.add(one, Pose{}, 999);
    points.finish();
    const Outcome outcome = run(folder, "map --out o");
    CHECK(outcome.status == 3);
    CHECK_THAT(outcome.err, Contains("scan 999"));
  }
  SECTION("map.ply is cut off") {
    std::filesystem::resize_file(folder / "map" / "map.ply", 600);
    CHECK_THAT(run(folder, "map --out o").err, Contains("map.ply: ends before its 60 vertices"));
  }
  SECTION("a trajectory of another length") {
    write_tum(folder / "map" / "trajectory.tum", {.stamps_s = {0}, .poses = {Pose{}}});
    CHECK_THAT(run(folder, "map --out o").err, Contains("60 vertices and trajectory.tum 1 poses"));
  }
  SECTION("run.json is no JSON") {
    folder.write("map/run.json", "{");
    CHECK_THAT(run(folder, "map --out o").err, Contains("run.json: is no JSON"));
  }
  SECTION("no graph") {
    std::filesystem::remove(folder / "map" / "graph.g2o");
    CHECK_THAT(run(folder, "map --out o").err, Contains("holds no graph.g2o"));
  }
  CHECK_FALSE(std::filesystem::exists(folder / "o"));
}

TEST_CASE("optimize: an earlier map stays whole when the new one cannot be written") {
  const TemporaryFolder folder;
  make_map(folder / "map");
  REQUIRE(run(folder, "map --out o --iterations 1").status == 0);
  const std::string before = content_of(folder / "o" / "trajectory.tum");
  std::filesystem::resize_file(folder / "map" / "map.ply", 600);
  CHECK(run(folder, "map --out o").status == 3);
  CHECK(content_of(folder / "o" / "trajectory.tum") == before);
  CHECK_FALSE(std::filesystem::exists(folder / ".o.alces-part"));
}
