// `alces convert old.toml new.toml`: a configuration as this version writes it.
#pragma once

#include <filesystem>
#include <string>

namespace alces::offline {

/// Reads a vehicle's or a mapper's configuration, also of an earlier version, and writes all of its keys by
/// their present names with their comments. A file that names a wire or a part of the scanner is a vehicle's.
/// Returns which of the two it was. InputError: not a configuration; OutputError.
std::string convert_settings(const std::filesystem::path& in, const std::filesystem::path& out);

}  // namespace alces::offline
