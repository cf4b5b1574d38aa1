// Chunks as other programs compress them: zstd and lz4, by their own libraries.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace alces::mcap {

/// Larger chunks are refused: whoever says so has a damaged file, or wants our memory.
inline constexpr std::uint64_t largest_unpacked_bytes = std::uint64_t{1} << 30;

/// Whether there is a library for "zstd" or "lz4"; false for any other name.
[[nodiscard]] bool can_unpack(std::string_view compression);

/// Replaces `unpacked`. False: the bytes are damaged, or do not unpack to `size` bytes.
[[nodiscard]] bool unpack(std::string_view compression, std::span<const std::uint8_t> packed,
                          std::uint64_t size, std::vector<std::uint8_t>& unpacked);

}  // namespace alces::mcap
