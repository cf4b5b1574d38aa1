// The parts of `alces compare`: rows, truth beside the scans, the experiment itself on a drive through a
// room.
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "experiments/back_ends/loop_back_ends.h"
#include "experiments/compare/drive_observer.h"
#include "experiments/compare/experiment.h"
#include "experiments/compare/link_matching.h"
#include "experiments/compare/plots.h"
#include "experiments/compare/tables.h"
#include "offline/io/files/error.h"
#include "offline/io/scans/spooled_scan_source.h"
#include "offline/room.h"
#include "offline/temporary_folder.h"

namespace alces::offline {
namespace {

using Catch::Contains;

constexpr std::size_t room_scans = 26;  // the last ones see the first within the detector's reach

std::string room_truth(std::size_t count, std::size_t every = 1) {
  std::string text;
  const Pose first_from_room = room_from_body(0).inverse();
  for (std::size_t i = 0; i < count; i += every) {
    const Pose pose = first_from_room * room_from_body(i);
    const Eigen::Vector3d& t = pose.translation_m;
    const Eigen::Quaterniond& q = pose.rotation;
    for (const double number : {static_cast<double>(i), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()})
      text += std::to_string(number) + " ";
    text += "\n";
  }
  return text;
}

struct Bench {
  TemporaryFolder folder;
  RoomSource room{room_scans};
  SpooledScanSource scans{room, folder.path()};
  ExperimentRequest request;

  explicit Bench(std::string_view rows) {
    add_loop_back_ends();
    request.map = small_request();
    request.map.config.detector.minimum_gap_m = 0;     // the whole way is 5 m long
    request.map.config.loop_verification.known_m = 0;  // and so short that the map knows it well
    request.lum.threads = 1;
    request.lum.maximum_iterations = 6;
    request.rows = select_rows(rows);
    request.out = folder.path();
    request.truth =
        read_scan_truth(folder.write("truth.tum", room_truth(room_scans)), scans, Alignment::none, 0.02);
  }
};

TEST_CASE("rows are chosen by name, come in the paper's order, and an unknown one is refused with the list") {
  CHECK(select_rows("").size() == 8);
  const std::vector<CompareRow> rows = select_rows("elch+lum,icp");
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].key == "icp");
  CHECK(rows[1].title == "ELCH & LUM");
  CHECK_THROWS_WITH(select_rows("elch,isam"), Contains("isam") && Contains("elch+hogman"));
  CHECK_THROWS_AS(select_rows("icp,"), UsageError);
}

TEST_CASE("truth of another drive is refused at once, truth of some of the scans says of how many") {
  const TemporaryFolder folder;
  RoomSource scans(10);
  CHECK(read_scan_truth(folder.write("all.tum", room_truth(10)), scans, Alignment::none, 0.02).known == 10);
  const ScanTruth some =
      read_scan_truth(folder.write("some.tum", room_truth(10, 3)), scans, Alignment::none, 0.02);
  CHECK(some.known == 4);
  CHECK_FALSE(some.truth_from_body[1].has_value());
  CHECK(some.truth_from_body[9].has_value());
  folder.write("times.tum", "1600000000.25 0 0 0 0 0 0 1\n1600000001.25 1 0 0 0 0 0 1\n");
  CHECK_THROWS_WITH(read_scan_truth(folder / "times.tum", scans, Alignment::none, 0.02),
                    Contains("times.tum"));
  folder.write("others.tum", "100 0 0 0 0 0 0 1\n101 1 0 0 0 0 0 1\n");
  CHECK_THROWS_AS(read_scan_truth(folder / "others.tum", scans, Alignment::none, 0.02), InputError);
  folder.write("one.tum", "3 0 0 0 0 0 0 1\n");
  CHECK_THROWS_AS(read_scan_truth(folder / "one.tum", scans, Alignment::none, 0.02), InputError);
}

TEST_CASE("with alignment of the first scan a truth in another frame gives the same errors") {
  const TemporaryFolder folder;
  RoomSource scans(4);
  ScanTruth truth;
  truth.alignment = Alignment::first;
  std::vector<Pose> map;
  for (std::size_t i = 0; i < 4; ++i) {
    truth.truth_from_body.emplace_back(room_from_body(i));
    map.push_back(room_from_body(0).inverse() * room_from_body(i));
  }
  const std::vector<std::size_t> index = {0, 1, 2, 3};
  CHECK(error_against(truth, map, index).error.translation_m.max < 1e-9);
  truth.alignment = Alignment::none;
  CHECK(error_against(truth, map, index).error.translation_m.mean > 1);
  truth.truth_from_body[2].reset();
  CHECK(error_against(truth, map, index).poses == std::vector<std::size_t>{0, 1, 3});
}

TEST_CASE("all eight rows run, each into a map folder, and their errors are those of the maps in it") {
  Bench bench("");
  std::vector<std::string> finished;
  const ExperimentResult result =
      run_experiment(bench.scans, bench.request,
                     {.progress = {},
                      .finished = [&](const RowResult& row) { finished.emplace_back(row.row.key); },
                      .stop_signal = {}});
  if (result.problem) FAIL(result.problem->what());
  REQUIRE(result.rows.size() == 8);
  CHECK(finished.size() == 8);
  for (const RowResult& row : result.rows) {
    CAPTURE(row.row.key);
    CHECK(row.scans == room_scans);
    REQUIRE(row.error);
    CHECK(row.error->translation_m.count == room_scans);
    CHECK(row.error->translation_m.mean < 0.05);
    CHECK(row.error->translation_m.mean > 0);
    CHECK((row.loops_closed > 0) == (row.row.key != "icp"));
    CHECK(row.times.icp_s > 0);
    CHECK((row.times.post_front_end_s > 0) == (row.row.post != PostMethod::none));
    CHECK(row.times.total_s >= row.times.icp_s);
    const Trajectory written = read_trajectory(bench.folder / (std::string(row.row.key) + "/trajectory.tum"));
    REQUIRE(written.size() == room_scans);
    CHECK(same_pose(written.poses.back(), row.trajectory.poses.back(), 1e-6));
    CHECK(row.drive.size() >= room_scans);
    REQUIRE_FALSE(row.watched.empty());
    CHECK(row.watched.front().samples.front().phase == ConvergencePhase::match);
    if (row.row.post != PostMethod::none)
      CHECK(row.watched.front().samples.back().phase == ConvergencePhase::relaxation);
  }
  CHECK(std::filesystem::exists(bench.folder / "elch+lum/map.ply"));

  const std::string tables = markdown_tables(result, {"a room", "truth.tum", "default", {}, "0", {}});
  for (const CompareRow& row : compare_rows())
    CHECK_THAT(tables, Contains("| " + std::string(row.title) + " |"));
  CHECK_THAT(tables, Contains("Table 1") && Contains("Table 2") && !Contains("Consistency"));
  const std::string csv = csv_table(result);
  CHECK(std::count(csv.begin(), csv.end(), '\n') == 9);
  const auto commas = [](const std::string& line) { return std::count(line.begin(), line.end(), ','); };
  std::istringstream lines(csv);
  std::string head;
  std::getline(lines, head);
  for (std::string line; std::getline(lines, line);) CHECK(commas(line) == commas(head));
  const nlohmann::json json = experiment_json(result, {});
  CHECK(json["rows"].size() == 8);
  CHECK(json["rows"][5]["error"]["translation_xy_m"]["count"] == room_scans);

  const PlotReport plots =
      write_plots(bench.folder.path(), result, bench.request, "gnuplot-that-is-not-there");
  CHECK(plots.pictures.empty());
  CHECK_THAT(plots.problem, Contains("is not installed"));
  for (const char* figure :
       {"trajectories", "error-by-scan", "error-by-scan-post", "run-time", "error-by-loops"})
    CHECK(std::filesystem::exists(bench.folder / (std::string("plots/") + figure + ".gp")));
  CHECK_THAT(content_of(bench.folder / "plots/data/trajectory-elch+lum.dat"),
             Contains("# stamp x_m y_m z_m"));
}

TEST_CASE("run times are drawn of whatever there is: one end alone, less than a millisecond, nothing") {
  if (std::system("command -v gnuplot >/dev/null") != 0) {
    WARN("skipped: no gnuplot");
    return;
  }
  struct Case {
    double front_s;
    double back_s;
    bool is_drawn;
  };
  for (const Case& each : {Case{0.2, 0.3, true}, Case{0, 0.3, true}, Case{0.2, 0, true},
                           Case{0.00004, 0.00007, true}, Case{0.001, 0.001, true}, Case{0, 0, false}}) {
    CAPTURE(each.front_s, each.back_s);
    const TemporaryFolder folder;
    ExperimentResult result;
    for (const CompareRow& row : select_rows("icp,elch,elch+lum")) {
      RowResult& added = result.rows.emplace_back();
      added.row = row;
      added.trajectory.stamps_s = {0, 1};
      added.trajectory.poses = {room_from_body(0), room_from_body(1)};
      added.source_index = {0, 1};
      if (row.key == "icp") continue;
      added.times.online_front_end_s = each.front_s;
      added.times.online_back_end_s = each.back_s;
    }
    const PlotReport plots = write_plots(folder.path(), result, {});
    CHECK(plots.problem.empty());
    CHECK(plots.left_out.empty() == each.is_drawn);
    CHECK(std::filesystem::exists(folder / "plots/run-time.svg") == each.is_drawn);
    CHECK(std::filesystem::exists(folder / "plots/run-time.gp") == each.is_drawn);
  }
}

TEST_CASE("an experiment that is interrupted keeps the rows before") {
  Bench bench("icp,elch,elch+lum");
  int rows = 0;
  const ExperimentResult result = run_experiment(bench.scans, bench.request,
                                                 {.progress = {},
                                                  .finished = [&](const RowResult&) { ++rows; },
                                                  .stop_signal = [&] { return rows == 1 ? SIGINT : 0; }});
  REQUIRE(result.problem);
  CHECK(result.problem->exit_status() == 130);
  CHECK_THAT(result.problem->what(), Contains("elch"));
  REQUIRE(result.rows.size() == 1);
  CHECK(std::filesystem::exists(bench.folder / "icp/run.json"));
  CHECK_FALSE(std::filesystem::exists(bench.folder / "elch"));
  CHECK_THAT(markdown_tables(result, {}), Contains("Not finished"));
}

TEST_CASE("the same experiment gives the same poses to the bit") {
  Bench bench("lum,elch+lum,elch+toro");
  const ExperimentResult once = run_experiment(bench.scans, bench.request);
  bench.request.lum.threads = 2;
  const ExperimentResult again = run_experiment(bench.scans, bench.request);
  REQUIRE(once.rows.size() == 3);
  REQUIRE(again.rows.size() == 3);
  for (std::size_t row = 0; row < 3; ++row) {
    CAPTURE(row);
    for (std::size_t i = 0; i < room_scans; ++i)
      CHECK((once.rows[row].trajectory.poses[i].matrix() - again.rows[row].trajectory.poses[i].matrix())
                .norm() == 0);
  }
}

TEST_CASE("without truth there is consistency, the same pairs for all rows, and no errors") {
  Bench bench("icp,elch");
  bench.request.truth.reset();
  bench.request.measures_consistency = true;
  bench.request.revisits = std::vector<ScanPair>{{0, 25}, {1, 24}};
  const ExperimentResult result = run_experiment(bench.scans, bench.request);
  if (result.problem) FAIL(result.problem->what());
  for (const RowResult& row : result.rows) {
    CHECK_FALSE(row.error);
    REQUIRE(row.consistency);
    REQUIRE(row.consistency->groups.size() == 3);
    CHECK(row.consistency->groups[2].pairs.size() == 2);
    CHECK(row.consistency->entropy.measured > 0);
  }
  const std::string tables = markdown_tables(result, {"a room", "", "default", {}, "0", {}});
  CHECK_THAT(tables, Contains("this is not an error") && !Contains("Table 1"));
}

TEST_CASE("matched links hold the measured relative poses, scans that nothing binds keep their place") {
  const TemporaryFolder folder;
  RoomSource room(6);
  std::vector<Pose> map;
  for (std::size_t i = 0; i < 6; ++i) {
    map.push_back(room_from_body(0).inverse() * room_from_body(i));
    map.back().translation_m.x() += i % 2 == 0 ? 0.03 : -0.03;  // ICP is to take that out again
  }
  map[5].translation_m.x() += 500;
  LinkMatchingSettings settings = link_matching_settings(small_request().config, {});
  settings.links.voxel = small_request().config.voxel;
  ScanCache cache(room, {0, 1, 2, 3, 4, 5}, settings.links, folder.path());
  const LinkMatching matching = match_links(map, cache, settings);
  CHECK(matching.links == 11);
  CHECK(matching.bridges == 1);
  REQUIRE(matching.graph.constraints.size() == 11);
  for (const Constraint& constraint : matching.graph.constraints) {
    CAPTURE(constraint.from, constraint.to);
    CHECK((constraint.information - constraint.information.transpose()).norm() == Approx(0).margin(1e-6));
    CHECK(constraint.information.llt().info() == Eigen::Success);
    if (constraint.to == 5) continue;
    const Pose truth = room_from_body(constraint.from).inverse() * room_from_body(constraint.to);
    CHECK(same_pose(constraint.from_from_to, truth, 0.02));
  }
}

}  // namespace
}  // namespace alces::offline
