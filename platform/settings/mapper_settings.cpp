#include "alces_platform/settings/mapper_settings.h"

#include "mapper_check.h"
#include "text_file.h"
#include "toml_reader.h"
#include "toml_writer.h"

namespace alces::settings {

MapperConfig default_mapper_settings(const MapperConfig& preset) {
  MapperConfig config = preset;
  config.scan_capacity = 0;
  config.pool_bytes = 0;
  config.voxel.cell_capacity = usual_cell_capacity;
  return config;
}

void check_mapper(const MapperConfig& config, const TomlReader& reader) {
  reader.require(config.voxel.maximum_range_m > config.voxel.minimum_range_m, "voxel", "maximum_range_m",
                 "voxel.maximum_range_m must be larger than voxel.minimum_range_m");
  reader.require(config.detector.radius_cap_m >= config.detector.radius_m, "detector", "radius_cap_m",
                 "detector.radius_cap_m must be at least detector.radius_m");
  const std::uint32_t around_loop = 2 * config.scans_around_first + 1 + config.scans_before_last + 1;
  reader.require(
      around_loop <= Icp::maximum_model_scans, "loop_match", "scans_around_first",
      fmt::format("2 * loop_match.scans_around_first + loop_match.scans_before_last + 2 is {}, at most {} "
                  "scans are looked at together",
                  around_loop, Icp::maximum_model_scans));
  const std::uint32_t together = std::max(config.model_scans + 1, around_loop);
  reader.require(
      config.cache_slots >= together, "memory", "cache_slots",
      fmt::format("memory.cache_slots must be at least {}, as many scans are looked at together", together));
}

void read_mapper_settings(const std::filesystem::path& file, MapperConfig& config) {
  const toml::table root = parse_toml(text_of(file), file.string());
  TomlReader reader(root, file.string(), "docs/examples/map.toml");
  MapperConfig read = config;
  visit_mapper(read, reader);
  reader.refuse_unknown();
  check_mapper(read, reader);
  config = read;
}

std::string to_toml(const MapperConfig& config) {
  TomlWriter writer;
  visit_mapper(config, writer);
  return writer.document;
}

}  // namespace alces::settings
