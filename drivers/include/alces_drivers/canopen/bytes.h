// CANopen's byte order on the wire: little-endian (CiA 301, 7.1.4).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace alces::canopen {

/// The first `size` (at most 4) of the bytes as an unsigned number; bytes that are not there count as 0.
[[nodiscard]] constexpr std::uint32_t load(std::span<const std::uint8_t> bytes, std::size_t size) {
  std::uint32_t value = 0;
  for (std::size_t byte = 0; byte < size && byte < bytes.size() && byte < 4; ++byte) {
    value |= std::uint32_t{bytes[byte]} << (8 * byte);
  }
  return value;
}

/// Writes the lowest `size` (at most 4) bytes of the value.
constexpr void store(std::uint32_t value, std::span<std::uint8_t> bytes, std::size_t size) {
  for (std::size_t byte = 0; byte < size && byte < bytes.size() && byte < 4; ++byte) {
    bytes[byte] = static_cast<std::uint8_t>(value >> (8 * byte));
  }
}

}  // namespace alces::canopen
