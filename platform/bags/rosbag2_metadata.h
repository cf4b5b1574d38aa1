// What metadata.yaml of a rosbag2 folder says that its files do not.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace alces::bags {

struct Rosbag2Metadata {
  std::vector<std::string> files;  ///< in their order
  std::string compression_format;  ///< "zstd"
  std::string compression_mode;    ///< "file", "message" or empty
};

/// False: `what` says what is wrong with it, and what is done without it.
[[nodiscard]] bool read_rosbag2_metadata(const std::filesystem::path& file, Rosbag2Metadata& metadata,
                                         std::string& what);

}  // namespace alces::bags
