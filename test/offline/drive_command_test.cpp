// alces simulate and replay as a script sees them: a drive is made, recorded, and mapped through the drivers.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "offline/io/files/error.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/simulate/drive_simulation.h"
#include "refusal.h"
#include "run_alces.h"
#include "support/test_data.h"

namespace alces::offline {
namespace {

using Catch::Contains;

/// One short drive for all cases.
const TemporaryFolder& short_drive() {
  static const TemporaryFolder folder;
  static const bool is_made = [] {
    const ProgramOutcome outcome = run_alces(folder, "simulate --scans 12 --seed 3 --out drive.mcap");
    INFO(outcome.err);
    REQUIRE(outcome.status == 0);
    return true;
  }();
  (void)is_made;
  return folder;
}

nlohmann::json report_of(const TemporaryFolder& folder, const std::string& map) {
  return nlohmann::json::parse(content_of(folder / (map + "/run.json")));
}

TEST_CASE("a simulated drive replays into a map near its truth, the same to the bit every time") {
  const TemporaryFolder& folder = short_drive();
  REQUIRE(run_alces(folder, "replay drive.mcap --out map").status == 0);
  REQUIRE(run_alces(folder, "replay drive.mcap --out again").status == 0);
  CHECK(content_of(folder / "map/trajectory.tum") == content_of(folder / "again/trajectory.tum"));
  CHECK(content_of(folder / "map/map.ply") == content_of(folder / "again/map.ply"));
  CHECK_FALSE(std::filesystem::exists(folder / "map/scans.archive"));

  const Trajectory map = read_trajectory(folder / "map/trajectory.tum");
  const Trajectory truth = read_trajectory(folder / "drive.truth.tum");
  REQUIRE(map.size() == truth.size());
  CHECK(map.size() >= 12);
  for (std::size_t i = 0; i < map.size(); ++i) {
    CAPTURE(i);
    CHECK(map.stamps_s[i] == Approx(truth.stamps_s[i]).margin(1e-6));
    CHECK(same_pose(map.poses[i], truth.poses[i], 0.1));
  }
}

TEST_CASE("a head that turns twice as fast as it is configured to loses no scan in a replay") {
  const TemporaryFolder& folder = short_drive();
  std::string config = run_alces(folder, "simulate --print-config").out;
  const std::string key = "expected_speed_deg_s = 150";
  REQUIRE(config.find(key) != std::string::npos);
  config.replace(config.find(key), key.size(), "expected_speed_deg_s = 75");
  std::ofstream(folder / "slow.toml") << config;
  REQUIRE(run_alces(folder, "replay drive.mcap --config slow.toml --out slow").status == 0);
  CHECK(read_trajectory(folder / "slow/trajectory.tum").size() ==
        read_trajectory(folder / "drive.truth.tum").size());
}

TEST_CASE("run.json tells what the devices of a drive went through") {
  const TemporaryFolder& folder = short_drive();
  REQUIRE(run_alces(folder, "replay drive.mcap --out told").status == 0);
  const nlohmann::json drive = report_of(folder, "told")["drive"];
  CHECK(drive["scans"]["handed_on"] == report_of(folder, "told")["scans"]);
  CHECK(drive["counters"]["motor"]["motor_starts"] == 1);
  CHECK(drive["counters"]["laser_a"]["profiles"].get<int>() > 1000);
  CHECK(drive["counters"]["laser_b"]["profiles"].get<int>() > 1000);
  CHECK(drive["counters"]["encoder"]["index_pulses"].get<int>() > 5);
  bool was_at_speed = false;
  for (const nlohmann::json& notice : drive["notices"]) was_at_speed |= notice["text"] == "at speed";
  CHECK(was_at_speed);
}

TEST_CASE("a laser that sends more rays than there is room for is no silent matter") {
  if (!test::has_test_data("../cases/lms-rays")) return;
  const TemporaryFolder folder;
  const std::string traces = test::test_data("../cases/lms-rays").string();
  const ProgramOutcome outcome = run_alces(folder, "replay '" + traces + "' --out map");
  CHECK_THAT(outcome.err,
             Contains("profiles have more rays than rays_per_profile: the rest is left out; rays of a "
                      "profile 541"));
  const nlohmann::json drive = report_of(folder, "map")["drive"];
  CHECK(drive["counters"]["assembler"]["rays_without_room"].get<int>() > 10000);
}

TEST_CASE("with room for all of its rays none is left out") {
  if (!test::has_test_data("../cases/lms-rays")) return;
  const TemporaryFolder folder;
  const std::string traces = test::test_data("../cases/lms-rays").string();
  std::string config = content_of(std::filesystem::path(traces) / "vehicle.toml");
  const std::string key = "rays_per_profile = 181";
  REQUIRE(config.find(key) != std::string::npos);
  config.replace(config.find(key), key.size(), "rays_per_profile = 541");
  std::ofstream(folder / "wide.toml") << config;
  REQUIRE(run_alces(folder, "replay '" + traces + "' --config wide.toml --out map").status == 0);
  CHECK(report_of(folder, "map")["drive"]["counters"]["assembler"]["rays_without_room"] == 0);
}

TEST_CASE("as traces of other programs the drive gives the same poses") {
  const TemporaryFolder& folder = short_drive();
  REQUIRE(run_alces(folder, "convert drive.mcap traces").status == 0);
  REQUIRE(run_alces(folder, "replay drive.mcap --out of_recording").status == 0);
  const ProgramOutcome outcome = run_alces(folder, "replay traces --out of_traces");
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  CHECK(content_of(folder / "of_recording/trajectory.tum") ==
        content_of(folder / "of_traces/trajectory.tum"));
}

TEST_CASE("traces of candump and gpiomon alone replay: lines are named as the configuration names them") {
  const TemporaryFolder& folder = short_drive();
  REQUIRE(run_alces(folder, "convert drive.mcap others").status == 0);
  CHECK_THAT(content_of(folder / "others/gpio.txt"), Contains("gpiochip0 17"));
  std::filesystem::remove(folder / "others/events.txt");
  REQUIRE(run_alces(folder, "replay drive.mcap --out recorded").status == 0);
  const ProgramOutcome outcome = run_alces(folder, "replay others --out of_others");
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  const Trajectory recorded = read_trajectory(folder / "recorded/trajectory.tum");
  const Trajectory others = read_trajectory(folder / "of_others/trajectory.tum");
  REQUIRE(others.size() + 1 >= recorded.size());
  for (std::size_t i = 0; i < std::min(others.size(), recorded.size()); ++i) {
    CAPTURE(i);
    CHECK(same_pose(others.poses[i], recorded.poses[i], 0.1));
  }
}

TEST_CASE("a laser alone replays through its driver, though there is no head whose angle would make scans") {
  const TemporaryFolder& folder = short_drive();
  REQUIRE(run_alces(folder, "convert drive.mcap whole").status == 0);
  std::filesystem::create_directory(folder / "alone");
  for (const char* name : {"laser_a.bin", "laser_a.times", "vehicle.toml"})
    std::filesystem::copy_file(folder / "whole" / name, folder / "alone" / name);
  const ProgramOutcome outcome = run_alces(folder, "replay alone --out of_laser");
  INFO(outcome.out << outcome.err);
  CHECK(outcome.status == 3);
  CHECK_THAT(outcome.err, Contains("none of the scans could be mapped") &&
                              Contains("nothing of a CAN bus is in the drive"));
  const std::string said = outcome.out + outcome.err;
  const std::size_t at = said.find("laser_a.profiles: ");
  REQUIRE(at != std::string::npos);
  CHECK(std::stoi(said.substr(at + 18)) > 500);  // 75 a second
  CHECK_THAT(said, !Contains("motor."));
}

TEST_CASE("a recording that was cut off maps as far as it goes, and says so") {
  const TemporaryFolder& folder = short_drive();
  const std::string whole = content_of(folder / "drive.mcap");
  folder.write("cut.mcap", std::string_view(whole).substr(0, whole.size() * 3 / 5));
  const ProgramOutcome outcome = run_alces(folder, "replay cut.mcap --out cut");
  INFO(outcome.err);
  CHECK(outcome.status == 0);
  const std::size_t scans = read_trajectory(folder / "cut/trajectory.tum").size();
  CHECK(scans >= 3);
  CHECK(scans < 12);
  CHECK_FALSE(report_of(folder, "cut")["warnings"].empty());
}

TEST_CASE("a fault on the way is reported, and the drive goes on") {
  const TemporaryFolder folder;
  const ProgramOutcome made =
      run_alces(folder, "simulate --scans 12 --seed 3 --out drive.mcap --fault laser_unplugged@10+2");
  INFO(made.err);
  REQUIRE(made.status == 0);
  CHECK_THAT(made.err, Contains("laser a"));
  REQUIRE(run_alces(folder, "replay drive.mcap --out map").status == 0);
  const nlohmann::json drive = report_of(folder, "map")["drive"];
  CHECK(drive["counters"]["assembler"]["scans_incomplete"].get<int>() > 2);
  CHECK(drive["scans"]["handed_on"].get<int>() >= 6);
}

TEST_CASE("what simulate and replay cannot do they say in one sentence") {
  const TemporaryFolder& folder = short_drive();
  const auto check = [&](const std::string& arguments, int status, const std::string& names) {
    check_refusal(folder, arguments, status, names);
  };
  check("simulate --scans 5", 2, "--out");
  check("simulate --scans 5 --out x.mcap --fault earthquake@3", 2, "earthquake");
  check("simulate --scans 5 --out x.mcap --fault bus_off", 2, "@SECONDS");
  check("simulate --scans 5 --out x.mcap --fault bus_off@soon", 2, "soon");
  check("simulate --scans 5 --out nowhere/x.mcap", 5, "nowhere/x.mcap");
  check("simulate --scans 5 --out x.mcap --config missing.toml", 3, "missing.toml");
  check("replay missing.mcap --out map", 3, "missing.mcap");
  folder.write("text.mcap", "this is no recording");
  check("replay text.mcap --out map", 3, "text.mcap");
  folder.write("bare/can0.log", "(0000000010.000100) can0 701#00\n");
  check("replay bare --out map", 3, "--config");
  folder.write("wrong.toml", "[scanner]\nlasers = \"two\"\n");
  check("replay drive.mcap --out map --config wrong.toml", 3, "wrong.toml:2");
  check("replay drive.mcap --out map --memory 1KiB", 4, "memory");
}

TEST_CASE("a fault's text has a name, a time, and perhaps a duration and a number") {
  const sim::Injection injection = parse_fault("bus_load@10.5+20=90");
  CHECK(injection.fault == sim::Fault::bus_load);
  CHECK(injection.at_ns == 10'500'000'000);
  CHECK(injection.duration_ns == 20'000'000'000);
  CHECK(injection.argument == 90);
  CHECK_THROWS_AS(parse_fault("bus_load@-1"), UsageError);
  CHECK_THROWS_AS(parse_fault("bus_load@nan"), UsageError);
}

}  // namespace
}  // namespace alces::offline
