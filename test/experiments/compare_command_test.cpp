// alces compare as a script sees it.
#include <stdlib.h>

#include <fmt/format.h>
#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "offline/refusal.h"
#include "offline/room.h"
#include "offline/run_alces.h"

namespace alces::offline {
namespace {

using Catch::Contains;

constexpr std::size_t scan_count = 26;

/// A folder scans/ of the room, its odometry, and truth.tum, for all cases.
const TemporaryFolder& room_folder() {
  static const TemporaryFolder folder;
  static const bool is_made = [] {
    std::string truth;
    for (std::size_t i = 0; i < scan_count; ++i) {
      const Pose pose = room_from_body(0).inverse() * room_from_body(i);
      const Eigen::Vector3d& t = pose.translation_m;
      const Eigen::Quaterniond& q = pose.rotation;
      truth += fmt::format("{} {} {} {} {} {} {} {}\n", i, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
      folder.write(fmt::format("scans/scan{:03}.pcd", i), room_pcd(i));
    }
    folder.write("scans/odometry.tum", truth);
    folder.write("truth.tum", truth);
    // its way of 5 m closes loops all the same
    folder.write("room.toml", "[detector]\nminimum_gap_m = 0\n[belief]\nknown_m = 0\n");
    return true;
  }();
  (void)is_made;
  return folder;
}

TEST_CASE("compare writes tables and figures, and the figures can be drawn again") {
  const TemporaryFolder& folder = room_folder();
  const ProgramOutcome outcome = run_alces(
      folder,
      "compare scans --truth truth.tum --out tables --only icp,elch,elch+lum --watch 3 --config room.toml");
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("| ELCH & LUM |"));
  CHECK(content_of(folder / "tables/tables.md") == outcome.out);
  const nlohmann::json json = nlohmann::json::parse(content_of(folder / "tables/compare.json"));
  CHECK(json["complete"] == true);
  CHECK(json["rows"].size() == 3);
  for (const auto& entry : std::filesystem::directory_iterator(folder / "tables"))
    CHECK(entry.path().filename().string().front() != '.');  // no scratch file stays
  if (std::system("command -v gnuplot >/dev/null") != 0) {
    WARN("skipped: no gnuplot");
    return;
  }
  for (const char* figure : {"trajectories", "error-by-scan", "error-by-scan-post", "convergence-3",
                             "run-time", "error-by-loops"}) {
    CAPTURE(figure);
    CHECK_THAT(content_of(folder / fmt::format("tables/plots/{}.svg", figure)), Contains("</svg>"));
    CHECK(content_of(folder / fmt::format("tables/plots/{}.png", figure)).substr(1, 3) == "PNG");
  }
  std::filesystem::remove(folder / "tables/plots/run-time.svg");
  REQUIRE(std::system(
              fmt::format("cd '{}/tables/plots' && gnuplot run-time.gp", folder.path().string()).c_str()) ==
          0);
  CHECK(std::filesystem::exists(folder / "tables/plots/run-time.svg"));
}

TEST_CASE("without loops compare draws what there is, and says what there is not") {
  const TemporaryFolder& folder = room_folder();
  const bool has_gnuplot = std::system("command -v gnuplot >/dev/null") == 0;
  const auto compare = [&](const char* rows) {
    const ProgramOutcome outcome =
        run_alces(folder, fmt::format("compare scans --truth truth.tum --out calm --only {}", rows));
    INFO(outcome.err);
    CHECK(outcome.status == 0);
    CHECK_THAT(outcome.err, !Contains("gnuplot does not draw"));
    if (has_gnuplot) CHECK_THAT(content_of(folder / "calm/plots/error-by-loops.svg"), Contains("</svg>"));
    return outcome.err;
  };
  // looking for loops took some microseconds
  CHECK_THAT(compare("icp,elch"), Contains("ELCH              0 loops") && !Contains("left out"));
  CHECK(std::filesystem::exists(folder / "calm/plots/run-time.svg") == has_gnuplot);
  CHECK_THAT(compare("icp"), Contains("the figure run-time is left out: no strategy closed a loop"));
  CHECK_FALSE(std::filesystem::exists(folder / "calm/plots/run-time.svg"));
}

TEST_CASE("without gnuplot the tables are there, and a sentence says what is missing") {
  const TemporaryFolder& folder = room_folder();
  const std::string path = ::getenv("PATH");
  ::setenv("PATH", "/nowhere", 1);
  const ProgramOutcome outcome = run_alces(folder, "compare scans --truth truth.tum --out bare --only icp");
  ::setenv("PATH", path.c_str(), 1);
  INFO(outcome.err);
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.err, Contains("gnuplot is not installed"));
  CHECK(std::filesystem::exists(folder / "bare/tables.csv"));
  CHECK(std::filesystem::exists(folder / "bare/plots/trajectories.gp"));
}

TEST_CASE("truth of fewer scans counts what it knows, and says so") {
  const TemporaryFolder& folder = room_folder();
  folder.write("few.tum", "0 0 0 0 0 0 0 1\n4 0.8 0.2 0 0 0 0.02 1\n9 1.8 0.45 0 0 0 0.045 1\n");
  const ProgramOutcome outcome =
      run_alces(folder, "compare scans --truth few.tum --out few --only icp --no-plots --json");
  INFO(outcome.err);
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.err, Contains("23 of 26 scans have no ground truth"));
  CHECK(nlohmann::json::parse(outcome.out)["rows"][0]["error"]["translation_m"]["count"] == 3);
}

TEST_CASE("what compare cannot do it says in one sentence, before the work") {
  const TemporaryFolder& folder = room_folder();
  const auto check = [&](const std::string& arguments, int status, const std::string& names) {
    check_refusal(folder, arguments, status, names);
  };
  check("compare scans --out x --only elch,isam", 2, "isam");
  check("compare scans --out x --align first", 2, "--truth");
  check("compare scans --out x --truth truth.tum --watch 99", 2, "--watch 99");
  check("compare missing --out x", 3, "missing");
  check("compare missing.mcap --out x", 3, "missing.mcap");
  check("compare scans --out x --truth missing.tum", 3, "missing.tum");
  folder.write("times.tum", "1600000000.25 0 0 0 0 0 0 1\n1600000001.25 1 0 0 0 0 0 1\n");
  check("compare scans --out x --truth times.tum", 3, "times.tum");
  check("compare scans --out /proc/x", 5, "/proc/x");
  check("compare scans --out truth.tum/x", 5, "truth.tum/x");
  check("compare scans --out x --memory 1KiB --only icp", 4, "memory");
  folder.write("one/scan000.pcd", room_pcd(0));
  check("compare one --out x", 3, "two are the least");
}

}  // namespace
}  // namespace alces::offline
