// The numbers of a mapper as people write them: a TOML file with a table a part, keys named as in the
// library, units in the names. docs/examples/map.toml holds all of them at their defaults.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "alces/mapper.h"

namespace alces::settings {

/// Cells enough for the scans of a 2D laser on a turning head; the fullest of HANNOVER1 has 19,538 of 10 cm.
inline constexpr std::uint32_t usual_cell_capacity = 32768;

/// The programs' defaults: the library's, with usual_cell_capacity, and with scan_capacity and
/// pool_bytes 0, which is "as many as there are" and "what is left of the memory".
[[nodiscard]] MapperConfig default_mapper_settings(const MapperConfig& preset = MapperConfig::standard());

/// Overwrites those values of `config` that the file names. Error, with the line, for unknown tables and
/// keys, wrong types, and values out of their range or at odds with each other.
void read_mapper_settings(const std::filesystem::path& file, MapperConfig& config);

/// A whole TOML file with comments, such that read_mapper_settings() gives the same configuration.
[[nodiscard]] std::string to_toml(const MapperConfig& config);

}  // namespace alces::settings
