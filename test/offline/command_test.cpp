// The program as a script sees it: exit status, stdout, one sentence on stderr.
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "offline/io/map_folder/trajectory.h"
#include "temporary_folder.h"

namespace alces::offline {
namespace {

struct Outcome {
  int status = 0;
  std::string out;
  std::string err;
};

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

Outcome run(const TemporaryFolder& folder, const std::string& arguments) {
  const std::string command = "cd '" + folder.path().string() + "' && '" ALCES_PROGRAM "' " + arguments +
                              " >stdout.txt 2>stderr.txt </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(folder / "stdout.txt"),
          text_of(folder / "stderr.txt")};
}

bool is_one_sentence(const std::string& text) {
  return text.rfind("alces: ", 0) == 0 && std::count(text.begin(), text.end(), '\n') == 1;
}

void write_line(const std::filesystem::path& file, int count, double offset_m) {
  Trajectory trajectory;
  for (int i = 0; i < count; ++i) {
    trajectory.stamps_s.push_back(i);
    trajectory.poses.push_back({Eigen::Quaterniond::Identity(), {double(i), offset_m, 0}});
  }
  write_tum(file, trajectory);
}

TEST_CASE("help and version are no errors, and help teaches") {
  const TemporaryFolder folder;
  const Outcome help = run(folder, "--help");
  CHECK(help.status == 0);
  CHECK_THAT(help.out,
             Catch::Contains("Examples:") && Catch::Contains("evaluate") && Catch::Contains("Exit status"));
  CHECK(run(folder, "--version").out.rfind("alces ", 0) == 0);
  for (const char* verb : {"evaluate", "render", "info"}) {
    const Outcome verb_help = run(folder, std::string(verb) + " --help");
    CHECK(verb_help.status == 0);
    CHECK_THAT(verb_help.out, Catch::Contains("Examples:"));
    CHECK(verb_help.err.empty());
  }
}

TEST_CASE("a mistyped verb or option names the one that was probably meant, and only then") {
  const TemporaryFolder folder;
  const auto complaint = [&](const char* arguments) {
    const Outcome outcome = run(folder, arguments);
    CHECK(outcome.status == 2);
    return outcome.err;
  };
  CHECK_THAT(complaint("rendr town"), Catch::Contains("no verb rendr; did you mean render?"));
  CHECK_THAT(complaint("mpa town"), Catch::Contains("did you mean map?"));
  CHECK_THAT(complaint("frobnicate town"), Catch::Contains("no verb frobnicate") && !Catch::Contains("mean"));
  CHECK_THAT(complaint("map town --otu x"), Catch::Contains("map has no option --otu; did you mean --out?"));
  CHECK_THAT(complaint("map town --loop-optimiser=none --out x"),
             Catch::Contains("did you mean --loop-optimizer?"));
  CHECK_THAT(complaint("map town --frobnicate --out x"), !Catch::Contains("mean"));
}

TEST_CASE("a picture is refused under the name of another format") {
  const TemporaryFolder folder;
  const Outcome outcome = run(folder, "render town --out town.jpg");
  CHECK(outcome.status == 2);
  CHECK_THAT(outcome.err, Catch::Contains("town.jpg") && Catch::Contains(".png"));
}

TEST_CASE("status 5 is explained in the same words by every verb that can end with it") {
  const TemporaryFolder folder;
  for (const char* verb : {"", "map ", "replay ", "compare ", "report ", "simulate ", "calibrate "}) {
    CAPTURE(verb);
    CHECK_THAT(run(folder, std::string(verb) + "--help").out,
               Catch::Contains("5 a device failed or a file cannot be written"));
  }
}

TEST_CASE("wrong usage is status 2 and says where help is") {
  const TemporaryFolder folder;
  for (const char* arguments :
       {"", "fly", "evaluate", "evaluate map", "render map", "evaluate a --truth b --align c",
        "evaluate a --consistency b --truth c", "evaluate a --pairs b", "render map --out a.png --size 1"}) {
    const Outcome outcome = run(folder, arguments);
    INFO(arguments << ": " << outcome.err);
    CHECK(outcome.status == 2);
    CHECK(outcome.err.rfind("alces: ", 0) == 0);
    CHECK_THAT(outcome.err, Catch::Contains("--help'"));
    CHECK(outcome.out.empty());
  }
}

TEST_CASE("input that cannot be read is status 3 and one sentence with the file's name") {
  const TemporaryFolder folder;
  folder.write("words.txt", "no numbers here\n");
  write_line(folder / "line.tum", 4, 0);
  for (const char* arguments :
       {"info words.txt", "evaluate words.txt --truth line.tum", "evaluate line.tum --truth words.txt"}) {
    const Outcome outcome = run(folder, arguments);
    INFO(arguments << ": " << outcome.err);
    CHECK(outcome.status == 3);
    CHECK(is_one_sentence(outcome.err));
    CHECK_THAT(outcome.err, Catch::Contains("words.txt"));
  }
  for (const char* arguments : {"info nowhere", "evaluate nowhere --truth line.tum",
                                "render nowhere --out a.png", "evaluate line.tum --consistency nowhere"}) {
    const Outcome outcome = run(folder, arguments);
    INFO(arguments << ": " << outcome.err);
    CHECK(outcome.status == 3);
    CHECK(is_one_sentence(outcome.err));
    CHECK_THAT(outcome.err, Catch::Contains("nowhere"));
  }
}

TEST_CASE("evaluate prints the offset of two trajectories, for people and for machines") {
  const TemporaryFolder folder;
  write_line(folder / "estimate.tum", 10, 2);
  write_line(folder / "truth.tum", 10, 0);
  const Outcome text = run(folder, "evaluate estimate.tum --truth truth.tum --per-scan errors.csv");
  CHECK(text.status == 0);
  CHECK(text.err.empty());
  CHECK_THAT(text.out, Catch::Contains("10 poses associated by number") && Catch::Contains("2.0000"));
  const std::string csv = text_of(folder / "errors.csv");
  CHECK(std::count(csv.begin(), csv.end(), '\n') == 11);

  const auto json = nlohmann::json::parse(run(folder, "evaluate estimate.tum --truth truth.tum --json").out);
  CHECK(json["absolute"]["translation_m"]["mean"].get<double>() == Approx(2));
  CHECK(json["relative"]["translation_m"]["max"].get<double>() == Approx(0).margin(1e-6));
  const auto aligned =
      nlohmann::json::parse(run(folder, "evaluate estimate.tum --truth truth.tum --json --align first").out);
  CHECK(aligned["absolute"]["translation_m"]["max"].get<double>() == Approx(0).margin(1e-6));
}

TEST_CASE("evaluate --consistency counts what overlaps") {
  const TemporaryFolder folder;
  std::string scan = "x,y,z\n";
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 20; ++j)
      scan += std::to_string(0.1 * i - 3) + "," + std::to_string(0.1 * j + 2) + ",-1\n";
  }
  for (int i = 0; i < 12; ++i) folder.write("scans/scan" + std::to_string(i) + ".csv", scan);
  write_line(folder / "still.tum", 12, 0);
  const Outcome outcome = run(folder, "evaluate still.tum --consistency scans --json");
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  const auto json = nlohmann::json::parse(outcome.out);
  REQUIRE(json["groups"].size() == 3);
  CHECK(json["groups"][0]["name"] == "next");
  CHECK(json["groups"][0]["median_m"].get<double>() == Approx(0).margin(1e-6));
  CHECK(json["groups"][2]["median_m"].is_null());
}

TEST_CASE("info names what it is given") {
  const TemporaryFolder folder;
  write_line(folder / "line.tum", 4, 0);
  folder.write("graph.g2o", "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n");
  folder.write("scans/scan000.3d", "100 200 300\nnan 0 0\n");
  const auto info = [&](const std::string& what) {
    const Outcome outcome = run(folder, "info --json " + what);
    INFO(outcome.err);
    REQUIRE(outcome.status == 0);
    return nlohmann::json::parse(outcome.out);
  };
  CHECK(info("line.tum")["kind"] == "trajectory");
  CHECK(info("line.tum")["path_length_m"].get<double>() == Approx(3));
  CHECK(info("graph.g2o")["edges"] == 1);
  CHECK(info("scans")["kind"] == "scans");
  CHECK(info("scans")["points_not_finite"] == 1);
}

}  // namespace
}  // namespace alces::offline
