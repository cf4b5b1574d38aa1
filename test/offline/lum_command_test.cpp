// `alces optimize --with lum` as a script sees it, alone and under mpirun.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "lum_bench.h"
#include "offline/io/map_folder/trajectory.h"
#include "run_alces.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

constexpr std::size_t scan_count = 6;

/// scans/ and the map of them in map/.
void make_map(const TemporaryFolder& folder) {
  std::string odometry;
  for (std::size_t i = 0; i < scan_count; ++i) {
    folder.write("scans/scan00" + std::to_string(i) + ".pcd", room_pcd(i));
    const Pose pose = room_from_body(i);
    odometry += std::to_string(i);
    for (Eigen::Index n = 0; n < 3; ++n) odometry += " " + std::to_string(pose.translation_m[n]);
    for (Eigen::Index n = 0; n < 4; ++n) odometry += " " + std::to_string(pose.rotation.coeffs()[n]);
    odometry += "\n";
  }
  folder.write("odometry.tum", odometry);
  const ProgramOutcome outcome = run_alces(folder, "map scans --odometry odometry.tum --out map");
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
}

nlohmann::json report_of(const TemporaryFolder& folder, const std::string& out) {
  return nlohmann::json::parse(content_of(folder / (out + "/run.json")));
}

}  // namespace

TEST_CASE("optimize --with lum makes a better map folder of a map folder") {
  const TemporaryFolder folder;
  make_map(folder);
  const ProgramOutcome outcome = run_alces(folder, "optimize map --with lum --covariances --out better");
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("converged"));
  for (const char* name : {"trajectory.tum", "graph.g2o", "map.ply", "run.json", "covariances.csv"})
    CHECK(std::filesystem::exists(folder / "better" / name));
  CHECK_FALSE(std::filesystem::exists(folder / "better/lum.checkpoint"));
  const nlohmann::json lum = report_of(folder, "better")["optimize"];
  CHECK(lum["with"] == "lum");
  CHECK(lum["converged"] == true);
  CHECK(lum["links"]["distrusted"].empty());
  const Trajectory better = read_trajectory(folder / "better");
  REQUIRE(better.size() == scan_count);
  const std::string covariances = content_of(folder / "better/covariances.csv");
  CHECK(std::count(covariances.begin(), covariances.end(), '\n') == scan_count + 1);
}

TEST_CASE("covariances that cannot be written leave the whole folder of before, and say so") {
  const TemporaryFolder folder;
  make_map(folder);
  REQUIRE(run_alces(folder, "optimize map --with gn --out better").status == 0);
  const std::string before = content_of(folder / "better/run.json");
  std::filesystem::create_symlink("/dev/full", folder / "better/covariances.csv");
  const ProgramOutcome outcome = run_alces(folder, "optimize map --with lum --covariances --out better");
  INFO(outcome.err);
  CHECK(outcome.status == 5);
  CHECK_THAT(outcome.err, Contains("better/covariances.csv"));
  CHECK(content_of(folder / "better/run.json") == before);
}

TEST_CASE("what lum cannot work with ends in a sentence, and leaves nothing") {
  const TemporaryFolder folder;
  make_map(folder);
  const auto check = [&](const std::string& arguments, int status, const std::string& words) {
    const ProgramOutcome outcome = run_alces(folder, "optimize " + arguments);
    INFO(arguments << ": " << outcome.err);
    CHECK(outcome.status == status);
    CHECK_THAT(outcome.err, Contains(words));
    CHECK_FALSE(std::filesystem::exists(folder / "out"));
  };
  check("map --with lum --out out --resume", 3, "nothing was stopped in this folder");
  check("map --with lum --out out --loaded-scans 1", 2, "loaded scans");
  check("map --out out --resume", 2, "--resume belongs to --with lum");
  check("map/graph.g2o --with lum --out out", 2, "needs a map folder");
  check("map --with lum --scans nowhere --out out", 3, "nowhere");
  const ProgramOutcome onto_itself = run_alces(folder, "optimize map --with lum --out map/");
  CHECK(onto_itself.status == 2);
  CHECK_THAT(onto_itself.err, Contains("is the map itself"));
  CHECK_FALSE(std::filesystem::exists(folder / "map/lum.checkpoint"));
  folder.write("scans/scan003.pcd", room_pcd(3).substr(0, 5000));
  check("map --with lum --out out", 3, "scan003.pcd");
  std::filesystem::remove(folder / "scans/scan003.pcd");
  check("map --with lum --out out", 3, "scan 3 is missing");
  std::filesystem::remove_all(folder / "scans");
  check("map --with lum --out out", 3, "where nothing is; name them with --scans");
}

#ifdef ALCES_MPI_PROGRAM
namespace {

// Optimises the folder's map into `out`; the status is mpirun's. Open MPI does not free what plugins took
// that it has unloaded: a leak sanitizer cannot tell whose that was, and is not asked.
int optimize_under_mpirun(const TemporaryFolder& folder, int ranks, const std::string& out) {
  const std::string command =
      "cd '" + folder.path().string() +
      "' && LSAN_OPTIONS=detect_leaks=0 mpirun --allow-run-as-root --oversubscribe -n " +
      std::to_string(ranks) + " '" ALCES_MPI_PROGRAM "' optimize map --with lum --out " + out +
      " >stdout.txt 2>stderr.txt </dev/null";
  return std::system(command.c_str());
}

}  // namespace

TEST_CASE("under mpirun the poses are those of one process to the bit") {
  const TemporaryFolder folder;
  make_map(folder);
  REQUIRE(run_alces(folder, "optimize map --with lum --out alone").status == 0);
  const std::string alone = content_of(folder / "alone/trajectory.tum");
  for (const int ranks : {1, 2, 4}) {
    const std::string out = "out" + std::to_string(ranks);
    const int status = optimize_under_mpirun(folder, ranks, out);
    INFO(content_of(folder / "stderr.txt"));
    REQUIRE(status == 0);
    CHECK(content_of(folder / (out + "/trajectory.tum")) == alone);
    CHECK(report_of(folder, out)["optimize"]["ranks"] == ranks);
  }
}

TEST_CASE("under mpirun a missing scan ends all ranks with one sentence") {
  const TemporaryFolder folder;
  make_map(folder);
  std::filesystem::remove(folder / "scans/scan003.pcd");
  CHECK(optimize_under_mpirun(folder, 2, "out") != 0);
  const std::string err = content_of(folder / "stderr.txt");
  const std::size_t first = err.find("scan 3 is missing");
  CHECK(first != std::string::npos);
  CHECK(err.find("scan 3 is missing", first + 1) == std::string::npos);
  CHECK_FALSE(std::filesystem::exists(folder / "out"));
}
#endif
