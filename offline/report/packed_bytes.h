// Bytes as they travel inside a page: deflated (zlib's format, RFC 1950, which browsers inflate with
// DecompressionStream("deflate")), then in base64 (RFC 4648).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace alces::offline {

[[nodiscard]] std::string deflate_bytes(std::span<const std::uint8_t> bytes, int level = 6);
[[nodiscard]] std::string base64(std::string_view bytes);
[[nodiscard]] constexpr std::size_t base64_size(std::size_t bytes) {
  return (bytes + 2) / 3 * 4;
}

}  // namespace alces::offline
