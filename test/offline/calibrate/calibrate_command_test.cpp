// alces calibrate as a script sees it: a simulated vehicle stands, with a configuration that is wrong.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "../run_alces.h"

namespace alces::offline {
namespace {

using Catch::Contains;

/// Stands for 20 s, of which the scanner needs 4 to come up.
const TemporaryFolder& standing() {
  static const TemporaryFolder folder;
  static const bool is_made = [] {
    const ProgramOutcome outcome =
        run_alces(folder, "simulate --standstill 20 --scans 1 --out standing.mcap");
    INFO(outcome.err);
    REQUIRE(outcome.status == 0);
    return true;
  }();
  (void)is_made;
  return folder;
}

struct Change {
  std::string table;
  std::string key;
  double value;
};

/// The simulated vehicle's configuration, with these values.
void write_config(const TemporaryFolder& folder, const std::string& name,
                  const std::vector<Change>& changes) {
  std::string config = run_alces(folder, "simulate --print-config").out;
  for (const Change& change : changes) {
    const std::size_t table = config.find("\n[" + change.table + "]\n");
    REQUIRE(table != std::string::npos);
    const std::size_t at = config.find("\n" + change.key + " = ", table);
    REQUIRE(at != std::string::npos);
    const std::size_t value = at + change.key.size() + 4;
    config.replace(value, config.find(' ', value) - value, std::to_string(change.value));
  }
  std::ofstream(folder / name) << config;
}

TEST_CASE("a wrong mounting is found from a stand, within what is said of it") {
  const TemporaryFolder& folder = standing();
  write_config(folder, "wrong.toml",
               {{"laser_b", "x_m", -0.06},
                {"laser_b", "roll_deg", 89},
                {"laser_b", "z_m", 0.02},
                {"laser_b", "pitch_deg", 0.6},
                {"laser_b", "yaw_deg", 181},
                {"head", "z_m", 1.05},
                {"head", "roll_deg", 1.5},
                {"head", "pitch_deg", -1}});
  const ProgramOutcome outcome = run_alces(
      folder, "calibrate standing.mcap --config wrong.toml --out found.toml --pictures pictures --json");
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  const nlohmann::json json = nlohmann::json::parse(outcome.out);
  const auto value = [&json](const char* table, const char* key) {
    return json["mounting"][table][key]["value"].get<double>();
  };
  INFO(json.dump(1));
  CHECK(json["turns"][0].get<int>() >= 4);
  CHECK(json["has_converged"] == true);
  CHECK(json["after"]["median_gap_m"].get<double>() < 0.5 * json["before"]["median_gap_m"].get<double>());
  CHECK(value("laser_b", "z_m") == Approx(0).margin(0.002));
  CHECK(std::abs(value("laser_b", "yaw_deg")) == Approx(180).margin(0.05));
  CHECK(value("laser_b", "roll_deg") == Approx(90).margin(0.05));
  CHECK(value("laser_b", "pitch_deg") == Approx(0).margin(0.05));
  CHECK(value("laser_b", "x_m") == Approx(-0.08).margin(0.002));
  CHECK(value("laser_b", "y_m") == Approx(0).margin(0.004));
  CHECK(value("head", "z_m") == Approx(1).margin(0.01));
  CHECK(value("head", "roll_deg") == Approx(0).margin(0.4));
  CHECK(value("head", "pitch_deg") == Approx(0).margin(0.4));
  CHECK(json["mounting"]["laser_a"]["yaw_deg"]["kept"].get<std::string>().find("head") != std::string::npos);
  CHECK(json["mounting"]["head"]["yaw_deg"]["kept"].get<std::string>().find("drives") != std::string::npos);

  const std::string toml = content_of(folder / "found.toml");
  CHECK_THAT(toml, Contains("[laser_a]") && Contains("[laser_b]") && Contains("[head]"));
  CHECK(std::filesystem::file_size(folder / "pictures/before.png") > 5000);
  CHECK(std::filesystem::file_size(folder / "pictures/after.png") > 5000);
}

TEST_CASE("a calibration is the same every time, and its tables can be pasted") {
  const TemporaryFolder& folder = standing();
  REQUIRE(run_alces(folder, "calibrate standing.mcap --turns 2 --out one.toml").status == 0);
  REQUIRE(run_alces(folder, "calibrate standing.mcap --turns 2 --out two.toml").status == 0);
  CHECK(content_of(folder / "one.toml") == content_of(folder / "two.toml"));
  REQUIRE_FALSE(content_of(folder / "one.toml").empty());
  // Alone it is a configuration, too: all other keys are the simulated vehicle's.
  const ProgramOutcome again = run_alces(folder, "calibrate standing.mcap --turns 2 --config one.toml");
  INFO(again.err);
  CHECK(again.status == 0);
}

TEST_CASE("what cannot be calibrated is refused in one sentence that says why") {
  const TemporaryFolder& folder = standing();
  const auto refusal = [&folder](const std::string& arguments, int status) {
    const ProgramOutcome outcome = run_alces(folder, "calibrate " + arguments);
    INFO(outcome.err);
    CHECK(outcome.status == status);
    CHECK(is_one_sentence(outcome.err));
    CHECK(outcome.out.empty());
    return outcome.err;
  };
  SECTION("no such file") {
    refusal("nothing.mcap", 3);
  }
  SECTION("no recording") {
    std::ofstream(folder / "text.mcap") << "no recording at all";
    refusal("text.mcap", 3);
  }
  SECTION("the head never turned a full turn") {
    const std::string whole = content_of(folder / "standing.mcap");
    std::ofstream(folder / "cut.mcap", std::ios::binary) << whole.substr(0, whole.size() / 16);
    CHECK_THAT(refusal("cut.mcap", 3), Contains("full turn") || Contains("no laser profile"));
  }
  SECTION("no odometry") {
    std::string config = run_alces(folder, "simulate --print-config").out;
    const std::size_t at = config.find("has_odometry = true");
    config.replace(at, 19, "has_odometry = false");
    std::ofstream(folder / "blind.toml") << config;
    CHECK_THAT(refusal("standing.mcap --config blind.toml", 3), Contains("--standing"));
    CHECK(run_alces(folder, "calibrate standing.mcap --config blind.toml --standing --turns 1").status == 0);
  }
  SECTION("the scan plane lies across the axis") {
    write_config(folder, "flat.toml", {{"laser_b", "roll_deg", 0}});
    CHECK_THAT(refusal("standing.mcap --config flat.toml", 3), Contains("laser_b"));
  }
  SECTION("the disk is full") {
    const ProgramOutcome outcome = run_alces(folder, "calibrate standing.mcap --turns 1 --out /dev/full");
    CHECK(outcome.status == 5);
    CHECK_THAT(outcome.err, Contains("/dev/full"));
  }
}

TEST_CASE("a vehicle that moved all the time is told so") {
  const TemporaryFolder folder;
  REQUIRE(run_alces(folder, "simulate --standstill 1 --scans 12 --out moving.mcap").status == 0);
  std::filesystem::resize_file(folder / "moving.mcap",
                               std::filesystem::file_size(folder / "moving.mcap") * 3 / 5);
  const ProgramOutcome outcome = run_alces(folder, "calibrate moving.mcap");
  INFO(outcome.err);
  CHECK(outcome.status == 3);
  CHECK_THAT(outcome.err, Contains("the vehicle moved"));
}

}  // namespace
}  // namespace alces::offline
