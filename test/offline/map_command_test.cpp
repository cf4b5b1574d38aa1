// alces map as a script sees it: files in, exit status, one sentence, and what is in the folder afterwards.
#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <linux/capability.h>
#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"
#include "room.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace fs = std::filesystem;

namespace {

struct Outcome {
  int status = -1;
  std::string out;
  std::string err;
};

/// alces in a process of its own, in `folder`, as a user who may not write everywhere even if the test is
/// root. No file becomes larger than `largest_file_bytes`: a disk that gets full.
class Program {
 public:
  Program(const TemporaryFolder& folder, std::vector<std::string> arguments,
          rlim_t largest_file_bytes = RLIM_INFINITY)
      : folder_(folder) {
    arguments.insert(arguments.begin(), "alces");
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const std::string out = (folder / "stdout.txt").string();
    const std::string err = (folder / "stderr.txt").string();
    process_ = ::fork();
    REQUIRE(process_ >= 0);
    if (process_ > 0) return;
    const int out_file = ::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    const int err_file = ::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    ::dup2(out_file, STDOUT_FILENO);
    ::dup2(err_file, STDERR_FILENO);
    ::prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0);
    ::prctl(PR_CAPBSET_DROP, CAP_DAC_READ_SEARCH, 0, 0, 0);
    const rlimit limit{largest_file_bytes, largest_file_bytes};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    std::signal(SIGXFSZ, SIG_IGN);  // write() is to say it
    if (::chdir(folder.path().c_str()) != 0) ::_exit(99);
    ::execv(ALCES_PROGRAM, argv.data());
    ::_exit(98);
  }

  void signal(int number) const { ::kill(process_, number); }

  Outcome wait() const {
    int status = 0;
    REQUIRE(::waitpid(process_, &status, 0) == process_);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(folder_ / "stdout.txt"),
            content_of(folder_ / "stderr.txt")};
  }

 private:
  const TemporaryFolder& folder_;
  pid_t process_ = -1;
};

Outcome map(const TemporaryFolder& folder, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {"map", "scans", "--out", "out"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return Program(folder, arguments).wait();
}

void write_pcd_scans(const TemporaryFolder& folder, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    folder.write("scans/scan00" + std::to_string(i) + ".pcd", room_pcd(i));
}

/// One sentence that names what it must.
void check_sentence(const Outcome& outcome, int status, const std::string& names) {
  INFO(outcome.err);
  CHECK(outcome.status == status);
  CHECK_THAT(outcome.err, Contains(names));
  CHECK(outcome.err.rfind("alces: ", 0) == 0);
  CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
}

/// A whole map folder of `scans` scans and nothing half written.
void check_map(const TemporaryFolder& folder, std::size_t scans) {
  const fs::path out = folder / "out";
  CHECK(read_trajectory(out).size() == scans);
  CHECK(read_trajectory(out / "frames").size() == scans);
  ScanPoints scan;
  open_scans(out / "map.ply")->read(0, scan);
  const std::vector<Point>& points = scan.points;
  CHECK(points.size() > 100 * scans);
  CHECK_THAT(content_of(out / "graph.g2o"), Contains("VERTEX_SE3:QUAT"));
  const nlohmann::json run = nlohmann::json::parse(content_of(out / "run.json"));
  CHECK(run["scans"] == scans);
  for (const auto& entry : fs::recursive_directory_iterator(out)) CHECK(entry.path().extension() != ".part");
}

/// Five scans of which number 3 holds `bytes`: status 3, a sentence with its name and `names`, the first
/// three mapped.
void check_bad_scan(const std::string& bytes, const std::string& names,
                    const std::string& extension = ".pcd") {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < 5; ++i) {
    const std::string name = "scans/scan00" + std::to_string(i) + extension;
    folder.write(name, i == 3 ? bytes : extension == ".3d" ? room_3d(i) : room_pcd(i));
  }
  const Outcome outcome = map(folder);
  check_sentence(outcome, 3, "scan003" + extension);
  CHECK_THAT(outcome.err, Contains(names) && Contains("the 3 scans before are in out"));
  check_map(folder, 3);
  CHECK(nlohmann::json::parse(content_of(folder / "out/run.json"))["complete"] == false);
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

}  // namespace

TEST_CASE("map: a folder of scans becomes a map folder") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 6);
  const Outcome outcome = map(folder);
  INFO(outcome.err);
  CHECK(outcome.status == 0);
  CHECK(outcome.err.empty());
  CHECK_THAT(outcome.out,
             Contains("6 of 6 scans mapped") && Contains("loops: 0 closed") && Contains("memory:"));
  check_map(folder, 6);
}

TEST_CASE("map: --json prints run.json") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 3);
  const Outcome outcome = map(folder, {"--json", "--front-end", "paper", "--loop-optimizer", "none"});
  REQUIRE(outcome.status == 0);
  const nlohmann::json run = nlohmann::json::parse(outcome.out);
  CHECK(run == nlohmann::json::parse(content_of(folder / "out/run.json")));
  CHECK(run["front_end"] == "paper");
  CHECK(run["settings"]["trigger"]["close_loops"] == false);
  CHECK(run["settings"]["scan_match"]["metric"] == "point_to_point");
  CHECK(run["memory"]["block_bytes"] <= run["memory"]["limit_bytes"]);
  CHECK(run["loops"].is_array());
  CHECK(run["program"]["command_line"][1] == "map");
}

TEST_CASE("map: with an archive the trajectory is the same byte for byte") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 8);
  folder.write("small.toml",
               "[voxel]\ncell_capacity = 4096\n[memory]\nloop_capacity = 16\npool_bytes = 20000\n");
  REQUIRE(map(folder).status == 0);
  const std::string trajectory = content_of(folder / "out/trajectory.tum");
  const std::string points = content_of(folder / "out/map.ply");
  const Outcome outcome =
      map(folder, {"--archive", "scans.archive", "--config", "small.toml", "--memory", "3MiB"});
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  const nlohmann::json run = nlohmann::json::parse(content_of(folder / "out/run.json"));
  CHECK(run["counters"]["scans_archived"] >= 6);
  CHECK(content_of(folder / "out/trajectory.tum") == trajectory);
  CHECK(content_of(folder / "out/map.ply") == points);
}

TEST_CASE("map: usage that cannot be meant") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 1);
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"map"},
                                             {"map", "scans"},
                                             {"map", "--out", "out"},
                                             {"map", "scans", "--out", "out", "--memory", "lots"},
                                             {"map", "scans", "--out", "out", "--front-end", "magic"},
                                             {"map", "scans", "--out", "out", "--loop-optimizer", "magic"}}) {
    const Outcome outcome = Program(folder, arguments).wait();
    INFO(outcome.err);
    CHECK(outcome.status == 2);
    CHECK_FALSE(fs::exists(folder / "out"));
  }
}

TEST_CASE("map: a missing scan number is a warning, and numbers stay those of the files") {
  const TemporaryFolder folder;
  for (std::size_t i : {0U, 1U, 4U}) folder.write("scans/scan00" + std::to_string(i) + ".3d", room_3d(i));
  const Outcome outcome = map(folder);
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.err, Contains("warning: 2 scans are missing between scan001.3d and scan004.3d"));
  CHECK(read_trajectory(folder / "out").stamps_s == std::vector<double>{0, 1, 4});
  CHECK(fs::exists(folder / "out/frames/scan004.frames"));
}

TEST_CASE("map: numbers too large for map.ply, as times are, give way to the order, and that is said once") {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < 3; ++i)
    folder.write("scans/scan163057775856949000" + std::to_string(i) + ".pcd", room_pcd(i));
  const Outcome outcome = map(folder);
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.err, Contains("warning: scan1630577758569490002.pcd: the numbers in the names go beyond "
                                   "4294967295") &&
                              Contains("numbered in their order, 0 to 2"));
  CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
  CHECK(read_trajectory(folder / "out").stamps_s == std::vector<double>{0, 1, 2});
  check_map(folder, 3);
}

TEST_CASE("map: an empty scan file is left out") {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < 4; ++i)
    folder.write("scans/scan00" + std::to_string(i) + ".3d", i == 2 ? "" : room_3d(i));
  const Outcome outcome = map(folder);
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.err, Contains("warning: scan002.3d is left out"));
  check_map(folder, 3);
}

TEST_CASE("map: nothing but empty scans is an error, and nothing is written") {
  const TemporaryFolder folder;
  folder.write("scans/scan000.3d", "");
  const Outcome outcome = map(folder);
  CHECK(outcome.status == 3);
  CHECK_THAT(outcome.err, Contains("none of the scans could be mapped"));
  CHECK_FALSE(fs::exists(folder / "out/trajectory.tum"));
}

TEST_CASE("map: scans of one point") {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < 3; ++i)
    folder.write("scans/scan00" + std::to_string(i) + ".3d", "100 200 300\n");
  CHECK(map(folder).status == 0);
  CHECK(read_trajectory(folder / "out").size() == 3);
}

TEST_CASE("map: NaN, Inf and 1e30 in a scan's text") {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < 3; ++i)
    folder.write("scans/scan00" + std::to_string(i) + ".3d",
                 "nan 0 0\n1e30 inf -inf\n1e39 0 0\n" + room_3d(i));
  const Outcome outcome = map(folder);
  INFO(outcome.err);
  CHECK(outcome.status == 0);
  check_map(folder, 3);
}

TEST_CASE("map: a truncated binary PCD") {
  check_bad_scan(room_pcd(3).substr(0, 5000), "cut off");
}

TEST_CASE("map: a header that promises 4 billion points") {
  check_bad_scan(
      replaced(replaced(room_pcd(3), "WIDTH 3000", "WIDTH 4000000000"), "POINTS 3000", "POINTS 4000000000"),
      "4000000000");
}

TEST_CASE("map: wrong field sizes") {
  check_bad_scan(replaced(room_pcd(3), "SIZE 4 4 4", "SIZE 4 3 4"), "scan003.pcd:10: field y");
}

TEST_CASE("map: text where numbers belong: the line is named") {
  check_bad_scan("100 200 300\n100 200 300\n100 two 300\n", "scan003.3d:3:", ".3d");
}

TEST_CASE("map: a pose file with five numbers") {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < 3; ++i) {
    folder.write("scans/scan00" + std::to_string(i) + ".3d", room_3d(i));
    folder.write("scans/scan00" + std::to_string(i) + ".pose", i == 1 ? "0 0 0\n0 0\n" : "0 0 0\n0 0 0\n");
  }
  check_sentence(map(folder), 3, "scan001.pose");
}

TEST_CASE("map: a scan that may not be read") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 4);
  fs::permissions(folder / "scans/scan002.pcd", fs::perms::none);
  const Outcome outcome = map(folder);
  check_sentence(outcome, 3, "scans/scan002.pcd: cannot be read (Permission denied)");
  CHECK_THAT(outcome.err, Contains("the 2 scans before are in out"));
  check_map(folder, 2);
}

TEST_CASE(
    "map: a run that comes to half of the scans leaves the whole map of before, and its half lies beside") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 4);
  REQUIRE(map(folder).status == 0);
  const std::string before = content_of(folder / "out/run.json");
  folder.write("scans/scan002.pcd", "no cloud");
  const Outcome outcome = map(folder);
  check_sentence(outcome, 3, "scan002.pcd");
  CHECK_THAT(outcome.err, Contains("the 2 scans before are in out.partial; the whole map of before stays"));
  CHECK(content_of(folder / "out/run.json") == before);
  check_map(folder, 4);
  CHECK(read_trajectory(folder / "out.partial").size() == 2);

  fs::remove_all(folder / "out");
  REQUIRE(map(folder).status == 3);  // half a map does give way
  folder.write("scans/scan001.pcd", "no cloud");
  CHECK_THAT(map(folder).err, Contains("the 1 scans before are in out)"));
}

TEST_CASE("map: a folder that cannot be read") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 2);
  fs::permissions(folder / "scans", fs::perms::none);
  const Outcome outcome = map(folder);
  fs::permissions(folder / "scans", fs::perms::owner_all);
  check_sentence(outcome, 3, "scans");
}

TEST_CASE("map: a folder that does not exist, and odometry that does not") {
  const TemporaryFolder folder;
  check_sentence(map(folder), 3, "scans");
  write_pcd_scans(folder, 2);
  check_sentence(map(folder, {"--odometry", "nowhere.tum"}), 3, "nowhere.tum");
}

TEST_CASE("map: no permission to write is noticed before the work") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 2);
  fs::create_directory(folder / "out");
  fs::permissions(folder / "out", fs::perms::owner_read | fs::perms::owner_exec);
  const Outcome outcome = map(folder);
  fs::permissions(folder / "out", fs::perms::owner_all);
  check_sentence(outcome, 5, "out");
  CHECK(fs::is_empty(folder / "out"));
}

TEST_CASE("map: a file where the folder should be") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 2);
  folder.write("out", "a file");
  check_sentence(map(folder), 5, "out");
  CHECK(content_of(folder / "out") == "a file");
}

TEST_CASE("map: the disk is full while the map is written") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 3);
  fs::create_directory(folder / "out");
  fs::create_symlink("/dev/full", folder / "out/map.ply");
  const Outcome outcome = map(folder);
  check_sentence(outcome, 5, "map.ply");
  CHECK_THAT(outcome.err, Contains("disk is full"));
  CHECK_FALSE(fs::exists(folder / "out/trajectory.tum"));  // all of it or nothing
}

TEST_CASE("map: a map that could not be written leaves the one before whole") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 3);
  REQUIRE(map(folder).status == 0);
  const std::string before = content_of(folder / "out/run.json");
  folder.write("out/notes.txt", "mine");
  write_pcd_scans(folder, 4);
  const Outcome outcome = Program(folder, {"map", "scans", "--out", "out"}, 60'000).wait();
  check_sentence(outcome, 5, "out/map.ply");
  CHECK(content_of(folder / "out/run.json") == before);
  check_map(folder, 3);
  REQUIRE(map(folder).status == 0);
  check_map(folder, 4);
  CHECK(content_of(folder / "out/notes.txt") == "mine");
  for (const auto& entry : fs::directory_iterator(folder.path()))
    CHECK(entry.path().filename().string().front() != '.');
}

TEST_CASE("map: into the folder of the scans, twice, is the same map") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 3);
  const std::vector<std::string> arguments = {"map", "scans", "--out", "scans"};
  REQUIRE(Program(folder, arguments).wait().status == 0);
  const std::string first = content_of(folder / "scans/trajectory.tum");
  const Outcome again = Program(folder, arguments).wait();
  CHECK(again.status == 0);
  CHECK_THAT(again.err, Contains("a map beside the scans"));
  CHECK(content_of(folder / "scans/trajectory.tum") == first);
  CHECK(read_trajectory(folder / "scans").size() == 3);
}

TEST_CASE("map: a path that is not UTF-8 is a path like others") {
  const TemporaryFolder folder;
  const std::string name = "sc\xE4ns";
  for (std::size_t i = 0; i < 3; ++i) folder.write(name + "/" + std::to_string(i) + ".pcd", room_pcd(i));
  const Outcome outcome = Program(folder, {"map", name, "--out", "\xFCt"}).wait();
  INFO(outcome.err);
  CHECK(outcome.status == 0);
  CHECK(read_trajectory(folder / "\xFCt").size() == 3);
  CHECK(nlohmann::json::parse(content_of(folder / "\xFCt/run.json"))["complete"] == true);
}

TEST_CASE("map: the disk is full when the archive is begun") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 2);
  check_sentence(map(folder, {"--archive", "/dev/full"}), 5, "/dev/full");
}

TEST_CASE("map: a disk that gets full with half of the scans in the archive") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 9);
  folder.write("small.toml",
               "[voxel]\ncell_capacity = 4096\n[memory]\nloop_capacity = 16\npool_bytes = 20000\n");
  fs::create_directory(folder / "out");
  for (const char* larger_than_the_archive : {"out/map.ply", "out/scans.alces"})
    fs::create_symlink("/dev/null", folder / larger_than_the_archive);
  const Outcome outcome =
      Program(folder,
              {"map", "scans", "--out", "out", "--archive", "scans.archive", "--config", "small.toml"},
              140'000)
          .wait();
  check_sentence(outcome, 5, "scans.archive: scan ");
  CHECK_THAT(outcome.err, Contains("cannot be archived (File too large)") && Contains("are in out"));
  const nlohmann::json run = nlohmann::json::parse(content_of(folder / "out/run.json"));
  const std::size_t scans = run["scans"];
  CHECK(scans > 2);
  CHECK(scans < 9);
  CHECK(run["complete"] == false);
  CHECK_THAT(run["stopped_by"].get<std::string>(), Contains("scans.archive"));
  CHECK(run["counters"]["archive_failures"] == 1);
  CHECK(run["counters"]["scans_archived"] >= 1);
  CHECK(read_trajectory(folder / "out").size() == scans);
  CHECK(read_trajectory(folder / "out/frames").size() == scans);
}

TEST_CASE("map: too little memory states the least that will do, and it does") {
  const TemporaryFolder folder;
  for (const std::size_t scans : {1U, 2U}) {
    write_pcd_scans(folder, scans);
    const Outcome outcome = map(folder, {"--memory", "64KiB"});
    check_sentence(outcome, 4,
                   "64.0 KiB of memory are not enough for " +
                       std::string(scans == 1 ? "one scan of up to" : "2 scans of up to"));
    const std::size_t begin = outcome.err.find("--memory '");
    REQUIRE(begin != std::string::npos);
    const std::string least = outcome.err.substr(begin + 10, outcome.err.find('\'', begin + 10) - begin - 10);
    CHECK_THAT(least, Catch::EndsWith(" KiB"));
    CHECK(map(folder, {"--memory", least, "--archive", "scans.archive"}).status == 0);
  }
}

TEST_CASE("map: where the pool is full it goes on in an archive in OUT, which is gone afterwards") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 6);
  REQUIRE(map(folder).status == 0);
  const std::string trajectory = content_of(folder / "out/trajectory.tum");
  folder.write("tiny.toml", "[memory]\npool_bytes = 80000\n");
  const Outcome outcome = map(folder, {"--config", "tiny.toml"});
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("the pool was full after") && Contains(".archive"));
  CHECK_FALSE(fs::exists(folder / "out/scans.archive"));
  const nlohmann::json run = nlohmann::json::parse(content_of(folder / "out/run.json"));
  CHECK(run["counters"]["scans_archived"] >= 1);
  CHECK(content_of(folder / "out/trajectory.tum") == trajectory);
}

TEST_CASE("map: another's file of the archive's name is neither overwritten nor removed") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 2);
  fs::create_directory(folder / "out");
  folder.write("out/scans.archive", "years of work");
  CHECK(map(folder).status == 0);
  CHECK(content_of(folder / "out/scans.archive") == "years of work");
}

TEST_CASE("map: a wrong setting is named") {
  const TemporaryFolder folder;
  write_pcd_scans(folder, 1);
  folder.write("wrong.toml", "[memory]\npool = 80000\n");
  check_sentence(map(folder, {"--config", "wrong.toml"}), 3, "wrong.toml:2");
}

TEST_CASE("map: Ctrl-C leaves the whole map of what was mapped") {
  const TemporaryFolder folder;
  const fs::path scan = folder.write("scan.pcd", room_pcd(0, 20000));
  fs::create_directory(folder / "scans");
  constexpr std::size_t count = 4000;  // more than can be mapped before the signal comes
  for (std::size_t i = 0; i < count; ++i)
    fs::create_symlink(scan, folder / ("scans/" + std::to_string(i) + ".pcd"));
  const Program program(folder, {"map", "scans", "--out", "out"});
  // it has begun when the folder is there
  for (int i = 0; i < 1000 && !fs::exists(folder / "out/frames"); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  program.signal(SIGINT);
  const Outcome outcome = program.wait();
  INFO(outcome.err);
  CHECK(outcome.status == 130);
  CHECK_THAT(outcome.err, Contains("interrupted after") && Contains("are in out"));
  const std::size_t mapped = read_trajectory(folder / "out").size();
  CHECK(mapped > 0);
  CHECK(mapped < count);
  check_map(folder, mapped);
}
