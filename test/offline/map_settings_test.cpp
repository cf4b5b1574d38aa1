#include <catch2/catch.hpp>
#include <string>

#include "offline/io/files/byte_size.h"
#include "offline/io/files/error.h"
#include "offline/map/mapper_settings.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

const std::string example = ALCES_EXAMPLES "/map.toml";

/// What the program would say to this file.
std::string complaint(const std::string& toml) {
  const TemporaryFolder folder;
  MapperConfig config = default_settings(FrontEnd::standard);
  try {
    read_settings(folder.write("map.toml", toml), config);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("the example configuration is the defaults, every key of them") {
  const std::string text = content_of(example);
  INFO("to write it again: alces map --print-config > docs/examples/map.toml");
  CHECK(text == to_toml(default_settings(FrontEnd::standard)));
  MapperConfig config = MapperConfig::paper();
  read_settings(example, config);
  config.detector.use_gps = false;
  CHECK(to_json(config) == to_json(default_settings(FrontEnd::standard)));
}

TEST_CASE("settings survive being written and read") {
  MapperConfig config = default_settings(FrontEnd::paper);
  config.voxel.cell_size_m = 0.123456F;
  config.voxel.representative = CellRepresentative::center;
  config.scan_match.maximum_iterations = 77;
  config.loop_verification.maximum_rms_m = 1e-5;
  config.close_loops = false;
  const TemporaryFolder folder;
  MapperConfig read = default_settings(FrontEnd::standard);
  read_settings(folder.write("map.toml", to_toml(config)), read);
  CHECK(to_json(read) == to_json(config));
  CHECK(read.voxel.cell_size_m == config.voxel.cell_size_m);
  CHECK(read.voxel.representative == CellRepresentative::center);
  CHECK(read.scan_match.metric == IcpMetric::point_to_point);
  CHECK_FALSE(read.close_loops);
}

TEST_CASE("a file changes what it names and nothing else") {
  const TemporaryFolder folder;
  MapperConfig config = default_settings(FrontEnd::standard);
  read_settings(folder.write("map.toml", "[voxel]\ncell_size_m = 1  # a whole number will do\n"), config);
  MapperConfig expected = default_settings(FrontEnd::standard);
  expected.voxel.cell_size_m = 1;
  CHECK(to_json(config) == to_json(expected));
}

TEST_CASE("what earlier versions called a table is read for ever, and only one of the two names at a time") {
  const TemporaryFolder folder;
  MapperConfig config = default_settings(FrontEnd::standard);
  read_settings(folder.write("old.toml",
                             "[belief]\nminimum_overlap = 0.25\n[step_belief]\nminimum_fit = 0.5\n"
                             "[sharing]\nrule = \"paper\"\n"),
                config);
  CHECK(config.loop_verification.minimum_overlap == 0.25);
  CHECK(config.step_verification.minimum_fit == 0.5);
  CHECK(config.correction_rule == CorrectionRule::paper);
  CHECK_THAT(complaint("[belief]\nminimum_overlap = 2\n"), Contains(":2: loop_verification.minimum_overlap"));
  CHECK_THAT(complaint("[belief]\nminimum_overlap = 0.2\n[loop_verification]\nminimum_fit = 0\n"),
             Contains(":1: belief is what earlier versions called loop_verification"));
}

TEST_CASE("wrong settings are named with file and line") {
  CHECK_THAT(complaint("[voxel]\n\ncell_size = 0.1\n"), Contains("map.toml:3: there is no voxel.cell_size"));
  CHECK_THAT(complaint("\n[voxels]\n"), Contains("map.toml:2: there is no table [voxels]"));
  CHECK_THAT(complaint("cell_size_m = 0.1\n"), Contains("map.toml:1: there is no table [cell_size_m]"));
  CHECK_THAT(complaint("voxel = 3\n"), Contains("map.toml:1: voxel is a table"));
  CHECK_THAT(complaint("[voxel]\ncell_size_m = \"0.1\"\n"),
             Contains("map.toml:2: voxel.cell_size_m is a number"));
  CHECK_THAT(complaint("[voxel]\ncell_size_m = true\n"),
             Contains("map.toml:2: voxel.cell_size_m is a number"));
  CHECK_THAT(complaint("[memory]\ncache_slots = 16.5\n"),
             Contains("map.toml:2: memory.cache_slots is a whole number"));
  CHECK_THAT(complaint("[trigger]\nclose_loops = 1\n"),
             Contains("map.toml:2: trigger.close_loops is true or false"));
  CHECK_THAT(complaint("[sharing]\nrule = \"fair\"\n"),
             Contains("map.toml:2") && Contains("\"trails\", \"paper\""));
}

TEST_CASE("settings out of their range are refused") {
  CHECK_THAT(complaint("[voxel]\ncell_size_m = 0\n"),
             Contains("map.toml:2: voxel.cell_size_m must lie between"));
  CHECK_THAT(complaint("[voxel]\ncell_size_m = nan\n"), Contains("must lie between"));
  CHECK_THAT(complaint("[voxel]\ncell_size_m = inf\n"), Contains("must lie between"));
  CHECK_THAT(complaint("[memory]\nscan_capacity = -1\n"), Contains("must lie between"));
  CHECK_THAT(complaint("[memory]\nscan_capacity = 4294967297\n"), Contains("must lie between"));
}

TEST_CASE("settings that do not go together are refused") {
  CHECK_THAT(complaint("[voxel]\nminimum_range_m = 200\nmaximum_range_m = 100\n"), Contains("map.toml:3"));
  CHECK_THAT(complaint("[detector]\nradius_m = 1000\nradius_cap_m = 10\n"), Contains("map.toml:3"));
  CHECK_THAT(complaint("[memory]\ncache_slots = 2\n"),
             Contains("map.toml:2: memory.cache_slots must be at least"));
  CHECK_THAT(complaint("[loop_match]\nscans_around_first = 7\nscans_before_last = 14\n"),
             Contains("map.toml:2"));
}

TEST_CASE("a file that is no TOML, or no file") {
  CHECK_THAT(complaint("[voxel]\ncell_size_m 0.1\n"), Contains("map.toml:2: is no TOML"));
  MapperConfig config;
  CHECK_THROWS_AS(read_settings("/nonexistent.toml", config), InputError);
  CHECK_THROWS_AS(read_settings("/tmp", config), InputError);
}

TEST_CASE("sizes as people write them") {
  CHECK(parse_byte_size("64MiB") == std::size_t{64} << 20);
  CHECK(parse_byte_size("16 mib") == std::size_t{16} << 20);
  CHECK(parse_byte_size("1.5KiB") == 1536);
  CHECK(parse_byte_size("2GB") == 2'000'000'000);
  CHECK(parse_byte_size("4096") == 4096);
  for (const char* wrong : {"", "MiB", "-1MiB", "64 megs", "1e99", "nan", "inf", "64MiBs"}) {
    INFO(wrong);
    CHECK_FALSE(parse_byte_size(wrong).has_value());
  }
  CHECK(format_byte_size(512) == "512 B");
  CHECK(format_byte_size(std::size_t{16} << 20) == "16.0 MiB");
}
