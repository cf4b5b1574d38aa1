// A map that is compared with its own odometry.
#include "offline/evaluate/circular_truth.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "room.h"
#include "run_alces.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

std::string pose_line(std::size_t scan, double y_m = 0) {
  const Pose pose = room_from_body(scan);
  return fmt::format("{} {:.9f} {:.9f} {:.9f} 0 0 {:.12f} {:.12f}\n", scan, pose.translation_m.x(),
                     pose.translation_m.y() + y_m, pose.translation_m.z(), pose.rotation.z(),
                     pose.rotation.w());
}

/// Six scans with their odometry beside them.
void write_drive(const TemporaryFolder& folder) {
  std::string odometry;
  for (std::size_t i = 0; i < 6; ++i) {
    std::string text;
    for (const Point& p : scan_room(i)) text += fmt::format("{},{},{}\n", p.x, p.y, p.z);
    folder.write(fmt::format("scans/{}.csv", i), text);
    odometry += pose_line(i);
  }
  folder.write("scans/odometry.tum", odometry);
}

nlohmann::json evaluated(const TemporaryFolder& folder, const std::string& map, const std::string& truth) {
  const ProgramOutcome outcome =
      run_alces(folder, "evaluate " + map + " --align first --json --truth " + truth);
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  return nlohmann::json::parse(outcome.out);
}

}  // namespace

TEST_CASE("an evaluation says when the truth is what the map took as odometry, by file, content or poses") {
  const TemporaryFolder folder;
  write_drive(folder);
  REQUIRE(run_alces(folder, "map scans --out map").status == 0);
  const nlohmann::json run = nlohmann::json::parse(content_of(folder / "map/run.json"));
  CHECK_THAT(run["source"]["odometry"]["path"].get<std::string>(), Contains("scans/odometry.tum"));
  CHECK(run["source"]["odometry"]["digest"].get<std::string>().size() == 16);
  CHECK(run["source"]["odometry"]["paired_by"] == "number");

  const auto check_circular = [&](const std::string& truth, const std::string& how) {
    const nlohmann::json json = evaluated(folder, "map", truth);
    CHECK(json["truth_was_odometry"] == true);
    CHECK_THAT(json["circular"].get<std::string>(), Contains(how) && Contains("--odometry none"));
  };
  check_circular("scans/odometry.tum", "is the file");
  folder.write("copy.tum", content_of(folder / "scans/odometry.tum"));
  check_circular("copy.tum", "has the content");
  REQUIRE(run_alces(folder, "convert scans/odometry.tum other.kitti").status == 0);
  check_circular("other.kitti", "has the poses");
  const ProgramOutcome text = run_alces(folder, "evaluate map --align first --truth copy.tum");
  CHECK_THAT(text.out, Contains("NO MEASURE OF ACCURACY"));
  CHECK_THAT(text.err, Contains("warning: the truth copy.tum has the content"));

  std::string truth;  // 5 mm away, in another way at each scan
  for (std::size_t i = 0; i < 6; ++i) truth += pose_line(i, i % 2 == 0 ? 0.005 : -0.005);
  folder.write("truth.tum", truth);
  CHECK(evaluated(folder, "map", "truth.tum")["truth_was_odometry"] == false);
}

TEST_CASE("without odometry the same poses are a truth") {
  const TemporaryFolder folder;
  write_drive(folder);
  const ProgramOutcome outcome = run_alces(folder, "map scans --out map --odometry none");
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("no odometry, as asked for"));
  const nlohmann::json run = nlohmann::json::parse(content_of(folder / "map/run.json"));
  CHECK(run["source"]["odometry"].is_null());
  CHECK(evaluated(folder, "map", "scans/odometry.tum")["truth_was_odometry"] == false);
}

TEST_CASE("a trajectory that is compared with itself is told") {
  const TemporaryFolder folder;
  folder.write("a.tum", pose_line(0) + pose_line(1));
  CHECK_THAT(evaluated(folder, "a.tum", "a.tum")["circular"].get<std::string>(), Contains("with itself"));
}
