// A recording of alcesd or alces is an MCAP file, too, and no bag: it is replayed through the drivers.
#pragma once

#include <filesystem>

namespace alces::offline {

/// False where it cannot be read.
[[nodiscard]] bool is_own_recording(const std::filesystem::path& file);

/// A bag that is there and no recording of our own. An MCAP file that says nothing, as one that was cut at
/// its begin, counts as a recording.
[[nodiscard]] bool is_ros_bag(const std::filesystem::path& file_or_folder);

}  // namespace alces::offline
