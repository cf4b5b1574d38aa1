// A recording of alcesd or alces is an MCAP file, too, and no bag: it is replayed through the drivers.
#pragma once

#include <filesystem>

namespace alces::offline {

/// False where it cannot be read.
[[nodiscard]] bool is_own_recording(const std::filesystem::path& file);

}  // namespace alces::offline
