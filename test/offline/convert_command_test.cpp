// alces convert as a script sees it: files, exit status, one sentence on stderr.
#include <catch2/catch.hpp>

#include "run_alces.h"

namespace alces::offline {
namespace {

using Outcome = ProgramOutcome;

Outcome convert(const TemporaryFolder& folder, const std::string& arguments) {
  return run_alces(folder, "convert " + arguments);
}

/// A foreign drive of three traces, on one clock.
void write_traces(const TemporaryFolder& folder) {
  folder.write("traces/candump-2015-07-10_081732.log",
               "(0000000010.000100) can0 701#00\n(0000000010.020000) can0 123##1AABB\n"
               "(0000000010.030000) can1 12345678#R2\n");
  folder.write("traces/gpio.txt",
               "event:  RISING EDGE offset: 1 timestamp: [      10.010000001]\n"
               "event: FALLING EDGE offset: 1 timestamp: [      10.015000001]\n");
  folder.write("traces/laser_a.bin", std::string("\x02\x80\x00\xff\x0a", 5));
  folder.write("traces/laser_a.times", "10012345678 2\n10025000000 3\n");
  folder.write("traces/vehicle.toml", "[laser_a]\nmake = \"LMS 291\"\n");
}

TEST_CASE("foreign traces become a recording, and that the traces of can-utils and libgpiod") {
  const TemporaryFolder folder;
  write_traces(folder);
  const Outcome forth = convert(folder, "traces drive.mcap");
  INFO(forth.err);
  CHECK(forth.status == 0);
  CHECK(forth.err.empty());
  CHECK_THAT(forth.out, Catch::Contains("traces -> drive.mcap: 10 events"));  // 7, and 3 ticks in 30 ms
  CHECK_FALSE(std::filesystem::exists(folder / "drive.mcap.part"));

  const Outcome back = convert(folder, "drive.mcap back --gpiomon 1");
  CHECK(back.status == 0);
  CHECK(back.err.empty());
  CHECK(content_of(folder / "back/can0.log") ==
        "(0000000010.000100) can0 701#00 R\n(0000000010.020000) can0 123##1AABB R\n");
  CHECK(content_of(folder / "back/can1.log") == "(0000000010.030000) can1 12345678#R2 R\n");
  CHECK(content_of(folder / "back/gpio.txt") == content_of(folder / "traces/gpio.txt"));
  CHECK(content_of(folder / "back/laser_a.bin") == content_of(folder / "traces/laser_a.bin"));
  CHECK(content_of(folder / "back/laser_a.times") == content_of(folder / "traces/laser_a.times"));
  CHECK(content_of(folder / "back/vehicle.toml") == content_of(folder / "traces/vehicle.toml"));
}

TEST_CASE("a configuration of an earlier version comes out by today's names, with the same values") {
  const TemporaryFolder folder;
  folder.write("old.toml", "[belief]\nminimum_overlap = 0.25\n[sharing]\nrule = \"paper\"\n");
  const Outcome outcome = convert(folder, "old.toml new.toml");
  INFO(outcome.err);
  CHECK(outcome.status == 0);
  const std::string text = content_of(folder / "new.toml");
  CHECK_THAT(text, Catch::Contains("[loop_verification]\nminimum_overlap = 0.25"));
  CHECK_THAT(text, Catch::Contains("[loop_correction]") && !Catch::Contains("[belief]"));
  REQUIRE(convert(folder, "new.toml again.toml").status == 0);
  CHECK(content_of(folder / "again.toml") == text);
  folder.write("vehicle.toml", "[belief]\nminimum_overlap = 0.25\n[gps]\nline_baud = 9600\n");
  CHECK_THAT(convert(folder, "vehicle.toml newer.toml").out, Catch::Contains("a vehicle's configuration"));
  CHECK_THAT(content_of(folder / "newer.toml"), Catch::Contains("line_baud = 9600"));
  folder.write("none.toml", "[nonsense]\na = 1\n");
  CHECK(convert(folder, "none.toml out.toml").status == 3);
  CHECK_FALSE(std::filesystem::exists(folder / "out.toml"));
}

TEST_CASE("a recording goes to traces and back without a byte changed") {
  const TemporaryFolder folder;
  write_traces(folder);
  REQUIRE(convert(folder, "traces first.mcap").status == 0);
  REQUIRE(convert(folder, "first.mcap folder").status == 0);
  REQUIRE(convert(folder, "folder second.mcap").status == 0);
  CHECK(content_of(folder / "first.mcap") == content_of(folder / "second.mcap"));
  CHECK(content_of(folder / "first.mcap").size() > 1000);
  REQUIRE(convert(folder, "first.mcap third.mcap").status == 0);
  CHECK(content_of(folder / "first.mcap") == content_of(folder / "third.mcap"));
}

TEST_CASE("an older folder of traces is replaced, not mixed") {
  const TemporaryFolder folder;
  write_traces(folder);
  folder.write("out/can3.log", "(1.0) can3 123#\n");
  folder.write("out/notes.md", "mine\n");
  REQUIRE(convert(folder, "traces out").status == 0);
  CHECK_FALSE(std::filesystem::exists(folder / "out/can3.log"));
  CHECK(std::filesystem::exists(folder / "out/notes.md"));
}

TEST_CASE("single traces go both ways") {
  const TemporaryFolder folder;
  write_traces(folder);
  REQUIRE(convert(folder, "traces drive.mcap").status == 0);
  const Outcome log = convert(folder, "drive.mcap all.log");
  CHECK(log.status == 0);
  CHECK_THAT(log.out, Catch::Contains("3 events, 4 of other kinds left out"));
  CHECK(convert(folder, "drive.mcap laser_a_only.bin").status == 0);
  CHECK(content_of(folder / "laser_a_only.bin").size() == 5);
  folder.write("screen.txt", "  can0  181   [2]  21 04\n  can0  181   [2]  22 04\n");
  CHECK(convert(folder, "screen.txt screen.mcap").status == 0);
}

TEST_CASE("a recording that was cut becomes a whole one, with a warning that names the byte") {
  const TemporaryFolder folder;
  std::ostringstream log;
  for (int i = 1000; i < 3000; ++i) log << "(0000000010." << i << "00) can0 181#2104\n";
  folder.write("can0.log", log.str());
  REQUIRE(convert(folder, "can0.log drive.mcap").status == 0);
  const std::string whole = content_of(folder / "drive.mcap");
  folder.write("cut.mcap", whole.substr(0, whole.size() / 2));
  const Outcome outcome = convert(folder, "cut.mcap repaired.mcap");
  INFO(outcome.err);
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.err, Catch::Contains("cut.mcap: byte ") && Catch::Contains("cut within a chunk"));
  const Outcome again = convert(folder, "repaired.mcap repaired.log");
  CHECK(again.err.empty());
  const std::string frames = content_of(folder / "repaired.log");
  CHECK(std::count(frames.begin(), frames.end(), '\n') > 500);
}

TEST_CASE(
    "wrong calls are status 2, wrong input 3, output that cannot be written 5, each says so in one "
    "sentence") {
  const TemporaryFolder folder;
  write_traces(folder);
  folder.write("empty/notes.md", "");
  folder.write("noise.log", "no frame\n");
  folder.write("noise.mcap", "no recording\n");
  folder.write("blocked", "a file");
  REQUIRE(convert(folder, "traces drive.mcap").status == 0);
  for (const char* arguments : {"traces", "drive.mcap drive.mcap", "traces out.mcap --clock-offset gpio.txt",
                                "traces out.mcap --clock-offset gpio.txt=soon", "traces out.mcap --gpiomon 3",
                                "traces out.mcap --baud 0", "traces out.mcap --stamps never"}) {
    const Outcome outcome = convert(folder, arguments);
    INFO(arguments << ": " << outcome.err);
    CHECK(outcome.status == 2);
    CHECK_THAT(outcome.err, Catch::Contains("--help'"));
  }
  for (const char* arguments :
       {"nowhere out.mcap", "empty out.mcap", "noise.mcap out.mcap", "noise.mcap out", "drive.mcap out.xyz",
        "traces out.mcap --clock-offset typo.txt=1", "traces out.mcap --clock-offset gpio.txt=1e9"}) {
    const Outcome outcome = convert(folder, arguments);
    INFO(arguments << ": " << outcome.err);
    CHECK(outcome.status == 3);
    CHECK(is_one_sentence(outcome.err));
    CHECK_FALSE(std::filesystem::exists(folder / "out.mcap"));
  }
  CHECK(convert(folder, "noise.log out.mcap").status == 3);
  for (const char* arguments :
       {"traces /proc/out.mcap", "traces blocked/out.mcap", "traces blocked", "drive.mcap what.bin"}) {
    const Outcome outcome = convert(folder, arguments);
    INFO(arguments << ": " << outcome.err);
    CHECK(outcome.status == 5);
    CHECK(is_one_sentence(outcome.err));
  }
}

TEST_CASE("clocks that differ are related by an offset, or by their starts") {
  const TemporaryFolder folder;
  folder.write("traces/can0.log", "(1436509052.000000) can0 181#11\n(1436509053.000000) can0 181#12\n");
  folder.write("traces/gpio.txt", "1608.000000000\trising\tgpiochip0 0\n");
  CHECK(convert(folder, "traces out.mcap").status == 3);
  CHECK(convert(folder, "traces out.mcap --clock-offset can0.log=-1436507444").status == 0);
  CHECK(convert(folder, "traces out.mcap --align-starts").status == 0);
}

}  // namespace
}  // namespace alces::offline
