// Small inputs of others' kinds, where they lie beside the repository: each was read wrongly, or refused,
// once.
#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "offline/evaluate/evaluation.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"
#include "run_alces.h"
#include "support/test_data.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

std::string at(const std::string& name) {
  return test::test_data("../cases/" + name).lexically_normal().string();
}

bool has(const std::string& name) {
  return test::has_test_data("../cases/" + name);
}

/// Mean distance of a map from the truth, first poses laid together.
double error_m(const TemporaryFolder& folder, const std::string& map, const std::string& truth) {
  const ProgramOutcome outcome =
      run_alces(folder, "evaluate " + map + " --align first --json --truth " + truth);
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  return nlohmann::json::parse(outcome.out)["absolute"]["translation_m"]["mean"];
}

/// Of the coordinates on one axis of a cloud, how many different decimals there are: of half-metre steps two.
std::size_t decimals_of(const std::filesystem::path& cloud, std::size_t axis) {
  ScanPoints scan;
  open_scans(cloud)->read(0, scan);
  std::set<int> decimals;
  for (const Point& p : scan.points) {
    const double value = static_cast<double>(axis == 0 ? p.x : axis == 1 ? p.y : p.z);
    decimals.insert(static_cast<int>(std::lround((value - std::floor(value)) * 1000)));
  }
  return decimals.size();
}

}  // namespace

TEST_CASE("case decimal-names: mapped in the order of time") {
  if (!has("decimal-names")) return;
  const TemporaryFolder folder;
  const ProgramOutcome outcome = run_alces(folder, "map " + at("decimal-names/scans") + " --odometry " +
                                                       at("decimal-names/odometry.tum") + " --out map");
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("by stamp"));
  CHECK(error_m(folder, "map", at("decimal-names/truth.tum")) < 0.01);
}

TEST_CASE("case five-floats: nuScenes' sweeps are mapped") {
  if (!has("five-floats")) return;
  ScanPoints scan;
  const auto source = open_scans(at("five-floats/scans"));
  source->read(0, scan);
  CHECK(scan.size() == 7000);
  CHECK_THAT(source->warnings().at(0), Contains("five float32"));
}

TEST_CASE("case utm: no steps in any form") {
  if (!has("utm")) return;
  const TemporaryFolder folder;
  for (const char* in : {"utm.pcd", "utm.ply", "utm.csv"}) {
    for (const char* out : {"out.ply", "out.pcd", "out.las", "out.csv"}) {
      CAPTURE(in, out);
      const ProgramOutcome outcome = run_alces(folder, "convert " + at(std::string("utm/") + in) + " " + out);
      INFO(outcome.err);
      REQUIRE(outcome.status == 0);
      CHECK(decimals_of(folder / out, 1) > 500);
      const auto back = open_scans(folder / out);
      CHECK(back->origin_m()[1] == 5'428'000);
    }
  }
}

TEST_CASE("case las-bounds: all points, whatever the header says of them") {
  if (!has("las-bounds")) return;
  const TemporaryFolder folder;
  for (const char* in : {"zero.las", "untouched.las"}) {
    CAPTURE(in);
    const ProgramOutcome outcome =
        run_alces(folder, "convert " + at(std::string("las-bounds/") + in) + " out.ply");
    INFO(outcome.err);
    REQUIRE(outcome.status == 0);
    CHECK_THAT(outcome.out, Contains("7000 points"));
    CHECK(decimals_of(folder / "out.ply", 1) > 500);
    CHECK(run_alces(folder, "info " + at(std::string("las-bounds/") + in)).status == 0);
  }
}

TEST_CASE("case las-tiles: two tiles of a flight adjoin") {
  if (!has("las-tiles")) return;
  const auto source = open_scans(at("las-tiles"));
  REQUIRE(source->size() == 2);
  double least[2] = {1e9, 1e9};
  double most[2] = {-1e9, -1e9};
  for (std::size_t tile = 0; tile < 2; ++tile) {
    ScanPoints scan;
    source->read(tile, scan);
    for (const Point& p : scan.points) {
      least[tile] = std::min(least[tile], static_cast<double>(p.x));
      most[tile] = std::max(most[tile], static_cast<double>(p.x));
    }
  }
  const double gap_m = std::max(least[0], least[1]) - std::min(most[0], most[1]);
  CHECK(std::abs(gap_m) < 5);
}

TEST_CASE("case comment-header: mapped within a centimetre or two") {
  if (!has("comment-header")) return;
  const TemporaryFolder folder;
  const std::string files =
      at("comment-header/000.csv") + " " + at("comment-header/001.csv") + " " + at("comment-header/002.csv");
  REQUIRE(run_alces(folder, "map " + files + " --out map").status == 0);
  folder.write("truth.tum", content_of(at("comment-header/truth.tum")));
  const Trajectory truth = read_trajectory(folder / "truth.tum");
  const Trajectory map = read_trajectory(folder / "map");
  REQUIRE(map.size() == 3);
  const Pose ours = map.poses[0].inverse() * map.poses[2];
  const Pose theirs = truth.poses[0].inverse() * truth.poses[2];
  CHECK((ours.translation_m - theirs.translation_m).norm() < 0.02);
}

TEST_CASE(
    "case trajectories: EuRoC's order by its names, whole seconds against fractions, a byte-order mark") {
  if (!has("trajectories")) return;
  const TemporaryFolder folder;
  const ProgramOutcome euroc =
      run_alces(folder, "evaluate " + at("trajectories/euroc_qw_first.csv") + " --truth " +
                            at("trajectories/euroc_same.tum") + " --json");
  REQUIRE(euroc.status == 0);
  CHECK(nlohmann::json::parse(euroc.out)["absolute"]["rotation_deg"]["max"].get<double>() < 1e-3);
  CHECK(nlohmann::json::parse(euroc.out)["associated_by"] == "stamp");
  const ProgramOutcome gnss = run_alces(folder, "evaluate " + at("trajectories/estimate.tum") + " --truth " +
                                                    at("trajectories/gnss.tum") + " --json");
  REQUIRE(gnss.status == 0);
  CHECK(nlohmann::json::parse(gnss.out)["associated"] == 3);
  CHECK(nlohmann::json::parse(gnss.out)["absolute"]["translation_m"]["max"].get<double>() < 1e-6);
  CHECK(error_m(folder, at("trajectories/bom.tum"), at("trajectories/estimate.tum")) < 1e-9);
}

TEST_CASE("case text-clouds: fifty points in every form") {
  if (!has("text-clouds")) return;
  for (const char* name : {"bom.csv", "cc.asc", "count.xyz", "decimal-comma.csv", "lidarview.csv"}) {
    CAPTURE(name);
    ScanPoints scan;
    open_scans(at(std::string("text-clouds/") + name))->read(0, scan);
    const std::vector<Point>& points = scan.points;
    REQUIRE(points.size() == 50);
    CHECK(points[0].x == Approx(3.807));
    CHECK(points[0].y == Approx(1.339));
    CHECK(points[0].z == Approx(-0.809));
  }
}

TEST_CASE("case candump: what is no frame is passed over and told, and a clock that is set forward, too") {
  if (!has("candump")) return;
  const TemporaryFolder folder;
  for (const char* name : {"banner.txt", "cut.log", "dropcount.log", "nul.log"}) {
    CAPTURE(name);
    const std::string file = at(std::string("candump/") + name);
    const ProgramOutcome explained = run_alces(folder, "explain-can " + file);
    CHECK(explained.status == 0);
    CHECK_THAT(explained.err, Contains(std::string(name) + ":"));
    CHECK(run_alces(folder, "convert " + file + " out.mcap").status == 0);
  }
  const ProgramOutcome set =
      run_alces(folder, "convert " + at("candump/clock_set_forward.log") + " out.mcap");
  INFO(set.err);
  CHECK(set.status == 0);
  CHECK_THAT(set.err, Contains("its clock was set"));
  const ProgramOutcome info = run_alces(folder, "info out.mcap --json");
  CHECK(nlohmann::json::parse(info.out)["duration_s"].get<double>() < 60);
}

TEST_CASE("case eds: remarks and stray lines are no reason to refuse a drive's dictionary") {
  if (!has("eds")) return;
  const TemporaryFolder folder;
  for (const char* name : {"inline.eds", "no-equals.eds"}) {
    CAPTURE(name);
    const ProgramOutcome outcome =
        run_alces(folder, "explain-can " + at("eds/t.log") + " --dcf " + at(std::string("eds/") + name));
    INFO(outcome.err);
    CHECK(outcome.status == 0);
    CHECK_THAT(outcome.out, Contains("statusword"));
  }
}

TEST_CASE("case foreign-topic: all scans are mapped, whatever somebody else's clock says") {
  if (!has("foreign-topic")) return;
  const TemporaryFolder folder;
  const ProgramOutcome outcome =
      run_alces(folder, "replay " + at("foreign-topic/foreign_small.mcap") + " --out map");
  INFO(outcome.err);
  CHECK(outcome.status == 0);
  CHECK(read_trajectory(folder / "map").size() == 14);
}
