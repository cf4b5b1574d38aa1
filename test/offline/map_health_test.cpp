// What a map is worth: in run.json, in scans.csv, in a line at the end, and in the exit status, which it
// leaves.
#include "offline/io/map_folder/map_health.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "offline/io/map_folder/scan_table.h"
#include "room.h"
#include "run_alces.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;
using Json = nlohmann::json;

namespace {

constexpr std::size_t scans_of_a_part = 12;

/// A small dome that has nothing of the room.
std::string dome_pcd(std::size_t scan) {
  constexpr std::size_t count = 3000;
  std::mt19937 random(static_cast<std::uint32_t>(scan) + 1000);
  std::normal_distribution<double> normal;
  std::string pcd =
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3000\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3000\nDATA binary\n";
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Vector3d on_dome(normal(random), normal(random), normal(random));
    on_dome = 2.5 * on_dome.normalized() + Eigen::Vector3d(-0.05 * static_cast<double>(scan), 0, 0);
    const std::array<float, 3> xyz = {static_cast<float>(on_dome.x()), static_cast<float>(on_dome.y()),
                                      static_cast<float>(on_dome.z())};
    pcd.append(reinterpret_cast<const char*>(xyz.data()), sizeof(xyz));
  }
  return pcd;
}

std::string scan_name(std::size_t scan) {
  return "scans/scan" + std::to_string(100 + scan) + ".pcd";
}

Json run_of(const TemporaryFolder& folder, const std::string& map) {
  return Json::parse(content_of(folder / map / "run.json"));
}

/// As judged on the drive.
Json judged(const char* verdict, const char* doubt) {
  return {{"verdict", verdict},
          {"health", {{"doubt", doubt}, {"parts", 1}, {"weakest_scans", {12, 302, 310}}}}};
}

Json optimized(std::size_t distrusted) {
  Json edges = Json::array();
  for (std::size_t i = 0; i < distrusted; ++i) edges.push_back({{"from", i}, {"to", i + 50}});
  return {{"with", "gn"}, {"distrusted", edges}};
}

}  // namespace

TEST_CASE("map: a good drive is called good, in run.json and at the end of what is printed") {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < scans_of_a_part; ++i) folder.write(scan_name(i), room_pcd(i));
  const ProgramOutcome outcome = run_alces(folder, "map scans --out out");
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.out, Catch::EndsWith("\n  verdict: good: nothing speaks against it\n"));
  CHECK_THAT(outcome.err, !Contains("verdict"));
  const Json run = run_of(folder, "out");
  CHECK(run["verdict"] == "good");
  CHECK(run["health"]["doubt"] == "nothing speaks against it");
  CHECK(run["health"]["scans"] == scans_of_a_part);
  CHECK(run["health"]["parts"] == 1);
  CHECK(run["health"]["steps_on_odometry"] == 0);
  const ScanTable table = read_scan_table(folder / "out/scans.csv");
  REQUIRE(table.rows.size() == scans_of_a_part);
  CHECK(table.rows[0].step == "first");
  for (std::size_t i = 1; i < table.rows.size(); ++i) {
    CHECK(table.rows[i].step == "believed");
    CHECK(table.rows[i].doubt == "none");
    CHECK(table.rows[i].fit > 0.2);
  }
}

TEST_CASE(
    "map: a drive in two parts is called bad, its parts are counted and the scan between them is named") {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < scans_of_a_part; ++i) {
    folder.write(scan_name(i), room_pcd(i));
    folder.write(scan_name(scans_of_a_part + i), dome_pcd(i));
  }
  const ProgramOutcome outcome = run_alces(folder, "map scans --out out");
  INFO(outcome.out << outcome.err);
  CHECK(outcome.status == 0);  // the map is there; what it is worth is said
  const std::string line = "verdict: bad: it is in parts that no loop joins; ";
  CHECK_THAT(outcome.out, Contains("\n  " + line));
  CHECK_THAT(outcome.err, Contains("alces: warning: " + line));
  const Json run = run_of(folder, "out");
  CHECK(run["verdict"] == "bad");
  REQUIRE_FALSE(run["health"]["weakest_scans"].empty());
  CHECK(run["health"]["weakest_scans"][0] == 100 + scans_of_a_part);  // the number of its file
  const ScanTable table = read_scan_table(folder / "out/scans.csv");
  REQUIRE(table.rows.size() == 2 * scans_of_a_part);
  CHECK(table.rows[scans_of_a_part].step == "apart");
  CHECK(table.rows[scans_of_a_part].doubt != "none");
  const auto apart = std::count_if(table.rows.begin(), table.rows.end(),
                                   [](const ScanRow& row) { return row.step == "apart"; });
  CHECK(run["health"]["parts"] == 1 + apart);
  CHECK(apart == 1);
  CHECK_THAT(outcome.out, Contains(std::to_string(1 + apart) + " parts; look at scan"));

  const ProgramOutcome printed = run_alces(folder, "map scans --out again --json");
  CHECK(printed.status == 0);
  CHECK(Json::parse(printed.out)["verdict"] == "bad");
  CHECK_THAT(printed.err, Contains("alces: warning: " + line));

  const ProgramOutcome better = run_alces(folder, "optimize out --out better");
  CHECK(better.status == 0);
  CHECK_THAT(better.out, Contains("\n  " + line));
  CHECK_THAT(better.err, Contains("alces: warning: " + line));
  CHECK(run_of(folder, "better")["verdict"] == "bad");
}

TEST_CASE("a table of scans from before steps were judged is read, without them") {
  const TemporaryFolder folder;
  const std::string old_header =
      "scan,stamp_s,points,iterations,correspondences,overlap,rms_m,is_predicted,reduce_ms,store_ms,match_ms,"
      "detect_ms,loop_match_ms,loop_share_out_ms\n";
  folder.write("scans.csv", old_header + "7,,10,5,9,0.5,0.02,1,1,2,3,4,5,6\n");
  const ScanTable table = read_scan_table(folder / "scans.csv");
  REQUIRE(table.rows.size() == 1);
  CHECK(table.rows[0].scan == 7);
  CHECK(table.rows[0].step.empty());
  CHECK(table.rows[0].stage_ms[5] == 6);
}

TEST_CASE("a table of scans from before directions were measured is read, without them") {
  const TemporaryFolder folder;
  const std::string old_header =
      "scan,stamp_s,points,iterations,correspondences,overlap,rms_m,is_predicted,step,doubt,fit,reduce_ms,"
      "store_ms,match_ms,detect_ms,loop_match_ms,loop_share_out_ms\n";
  folder.write("scans.csv", old_header + "7,,10,5,9,0.5,0.02,1,found,fit,0.25,1,2,3,4,5,6\n");
  const ScanTable table = read_scan_table(folder / "scans.csv");
  REQUIRE(table.rows.size() == 1);
  CHECK_FALSE(table.has_held);
  CHECK(table.rows[0].step == "found");
  CHECK(table.rows[0].fit == 0.25);
  CHECK(table.rows[0].surfaces == 0);
  CHECK(table.rows[0].stage_ms[0] == 1);
  CHECK(table.rows[0].stage_ms[5] == 6);
}

TEST_CASE("the verdict's line names reason, parts and scans, and says nothing where there is no verdict") {
  CHECK(verdict_line(judged("doubtful", "its steps are off")) ==
        "verdict: doubtful: its steps are off; look at scans 12, 302, 310");
  CHECK(verdict_line(judged("good", "nothing")) == "verdict: good: nothing");
  Json bent = judged("good", "nothing");
  bent["health"]["tilt_deg"] = 15.4;
  CHECK_THAT(verdict_line(bent), Contains("nothing; but heights may be bent: it tilts by 15 deg"));
  bent["health"]["tilt_deg"] = 13.9;
  CHECK(verdict_line(bent) == "verdict: good: nothing");
  Json parts = judged("bad", "in parts");
  parts["health"]["parts"] = 3;
  parts["health"]["weakest_scans"] = {4};
  CHECK(verdict_line(parts) == "verdict: bad: in parts; 3 parts; look at scan 4");
  CHECK(verdict_line(Json::object()).empty());
  CHECK(verdict_line(nullptr).empty());
  CHECK(verdict_line({{"verdict", 3}}).empty());
  CHECK(verdict_line({{"verdict", "bad"}, {"health", {1}}}) == "verdict: bad");
}

TEST_CASE("of an optimised map the drive's verdict goes on") {
  Json run = judged("good", "nothing");
  add_optimization(run, optimized(2), 10);
  CHECK(run["verdict"] == "good");
  CHECK(run["optimize"]["with"] == "gn");
  CHECK(run["optimize"]["drive_verdict"] == "good");
  CHECK(run["health"]["weakest_scans"].size() == 3);
}

TEST_CASE("loops that contradict the others make an optimised map worse by one step, once") {
  Json run = judged("good", "nothing");
  add_optimization(run, optimized(3), 20);
  CHECK(run["verdict"] == "doubtful");
  CHECK(run["health"]["doubt"] == "3 of 20 loops contradict the others");
  add_optimization(run, optimized(3), 20);
  CHECK(run["verdict"] == "doubtful");
  CHECK(run["health"]["doubt"] == "3 of 20 loops contradict the others");
  add_optimization(run, optimized(0), 20);
  CHECK(run["verdict"] == "good");
  CHECK(run["health"]["doubt"] == "nothing");

  Json doubtful = judged("doubtful", "its steps are off");
  add_optimization(doubtful, optimized(3), 20);
  CHECK(doubtful["verdict"] == "bad");
  CHECK(doubtful["health"]["doubt"] == "its steps are off; and 3 of 20 loops contradict the others");

  Json many = judged("good", "nothing");
  add_optimization(many, optimized(3), 100);  // a few among many: they were switched off
  CHECK(many["verdict"] == "good");
}

TEST_CASE(
    "an optimised map from before there were verdicts gets none, unless its loops contradict each other") {
  Json run = Json::object();
  add_optimization(run, optimized(0), 20);
  CHECK_FALSE(run.contains("verdict"));
  add_optimization(run, optimized(5), 20);
  CHECK(run["verdict"] == "doubtful");
}
