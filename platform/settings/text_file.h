#pragma once

#include <filesystem>
#include <string>

namespace alces::settings {

/// All of a configuration file. Error: it is none, cannot be read, or is far too large for one.
[[nodiscard]] std::string text_of(const std::filesystem::path& file);

}  // namespace alces::settings
