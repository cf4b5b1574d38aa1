// Chunks as ROS 1 packs them: bz2 and lz4 (its frame format), by their own libraries.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace alces::bags {

/// Whether there is a library for "bz2" or "lz4".
[[nodiscard]] bool can_unpack_ros1(std::string_view compression);

/// Replaces `unpacked` by what can be unpacked, `size` bytes at most; it grows as they arrive. False: that is
/// not `size` bytes.
[[nodiscard]] bool unpack_ros1(std::string_view compression, std::span<const std::uint8_t> packed,
                               std::size_t size, std::vector<std::uint8_t>& unpacked);

}  // namespace alces::bags
