// The numbers of a mapper as people write them: a TOML file with a table a part, keys named as in the
// library, units in the names. docs/examples/map.toml holds all of them at their defaults.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "alces/mapper.h"

namespace alces::offline {

enum class FrontEnd {
  standard,  ///< "default"
  paper,     ///< as published
};

/// The program's defaults: the library's, with room for the fullest scans, and with scan_capacity and
/// pool_bytes 0, which is "as many as there are scans" and "what is left of the memory".
[[nodiscard]] MapperConfig default_settings(FrontEnd front_end);

/// Overwrites those values of `config` that the file names. InputError, with the line, for unknown tables and
/// keys, wrong types, and values out of their range or at odds with each other.
void read_settings(const std::filesystem::path& file, MapperConfig& config);

/// A whole TOML file with comments, such that read_settings() gives the same configuration.
[[nodiscard]] std::string to_toml(const MapperConfig& config);

/// The same as tables in tables, for run.json.
[[nodiscard]] nlohmann::json to_json(const MapperConfig& config);

}  // namespace alces::offline
