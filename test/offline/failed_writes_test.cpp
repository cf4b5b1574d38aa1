// A disk that gets full: what could not be written is said with exit status 5, and what was there stays.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "run_alces.h"

using namespace alces::offline;
using Catch::Contains;

namespace fs = std::filesystem;

namespace {

/// No file becomes larger than so many blocks of 512 bytes.
ProgramOutcome run_on_small_disk(const TemporaryFolder& folder, int blocks, const std::string& arguments) {
  const std::string command = "cd '" + folder.path().string() + "' && sh -c \"trap '' XFSZ; ulimit -f " +
                              std::to_string(blocks) + "; exec '" ALCES_PROGRAM "' " + arguments +
                              "\" >stdout.txt 2>stderr.txt </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(folder / "stdout.txt"),
          content_of(folder / "stderr.txt")};
}

void check_nothing_left(const TemporaryFolder& folder) {
  for (const auto& entry : fs::recursive_directory_iterator(folder.path())) {
    CAPTURE(entry.path().string());
    CHECK(entry.path().extension() != ".part");
    CHECK(entry.path().filename().string().front() != '.');
  }
}

}  // namespace

TEST_CASE("a drive and its traces that do not fit the disk leave those of before whole") {
  const TemporaryFolder folder;
  REQUIRE(run_alces(folder, "simulate --scans 3 --out drive.mcap").status == 0);
  REQUIRE(run_alces(folder, "convert drive.mcap traces").status == 0);
  const std::string drive = content_of(folder / "drive.mcap");
  const std::string frames = content_of(folder / "traces/can0.log");
  folder.write("traces/notes.md", "mine");
  SECTION("simulate") {
    const ProgramOutcome outcome = run_on_small_disk(folder, 400, "simulate --scans 4 --out drive.mcap");
    INFO(outcome.err);
    CHECK(outcome.status == 5);
    CHECK_THAT(outcome.err, Contains("drive.mcap: cannot be written (File too large)"));
  }
  SECTION("convert to a folder of traces") {
    const ProgramOutcome outcome = run_on_small_disk(folder, 100, "convert drive.mcap traces");
    INFO(outcome.err);
    CHECK(outcome.status == 5);
    CHECK_THAT(outcome.err, Contains("traces/") && !Contains("alces-part"));
  }
  SECTION("convert to one trace") {
    folder.write("can0.log", "before");
    const ProgramOutcome outcome = run_on_small_disk(folder, 20, "convert drive.mcap can0.log");
    INFO(outcome.err);
    CHECK(outcome.status == 5);
    CHECK(content_of(folder / "can0.log") == "before");
  }
  SECTION("convert to a recording") {
    const ProgramOutcome outcome = run_on_small_disk(folder, 100, "convert traces drive.mcap");
    INFO(outcome.err);
    CHECK(outcome.status == 5);
  }
  CHECK(content_of(folder / "drive.mcap") == drive);
  CHECK(content_of(folder / "traces/can0.log") == frames);
  CHECK(content_of(folder / "traces/notes.md") == "mine");
  check_nothing_left(folder);
}

TEST_CASE("traces replace those of before, and files of others stay among them") {
  const TemporaryFolder folder;
  REQUIRE(run_alces(folder, "simulate --scans 2 --out drive.mcap").status == 0);
  folder.write("traces/can3.log", "of another drive");
  folder.write("traces/notes.md", "mine");
  REQUIRE(run_alces(folder, "convert drive.mcap traces").status == 0);
  CHECK_FALSE(fs::exists(folder / "traces/can3.log"));
  CHECK(fs::exists(folder / "traces/can0.log"));
  CHECK(content_of(folder / "traces/notes.md") == "mine");
  check_nothing_left(folder);
}

TEST_CASE("an answer that does not fit where standard output goes is no success") {
  const TemporaryFolder folder;
  folder.write("a.tum", "0 1 2 3 0 0 0 1\n1 2 2 3 0 0 0 1\n");
  const std::string command =
      "cd '" + folder.path().string() + "' && '" ALCES_PROGRAM "' info a.tum >/dev/full 2>stderr.txt";
  const int status = std::system(command.c_str());
  CHECK(WEXITSTATUS(status) == 5);
  CHECK_THAT(content_of(folder / "stderr.txt"), Contains("standard output cannot be written"));
  const int mute = std::system(
      ("cd '" + folder.path().string() + "' && '" ALCES_PROGRAM "' info a.tum >/dev/full 2>/dev/full")
          .c_str());
  CHECK((WIFEXITED(mute) && WEXITSTATUS(mute) == 5));  // nor is what cannot even be complained of a crash
}
