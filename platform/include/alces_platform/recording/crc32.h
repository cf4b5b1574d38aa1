// CRC-32 as zlib, PNG and MCAP use it, by zlib: neither heap nor initialisation.
// Polynomial 0x04C11DB7 reflected, start and end value inverted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace alces {

class Crc32 {
 public:
  void add(std::span<const std::uint8_t> bytes);
  /// So many bytes whose own CRC is known: without going over them again.
  void add_known(std::uint32_t crc, std::size_t size);
  [[nodiscard]] std::uint32_t value() const { return value_; }

 private:
  std::uint32_t value_ = 0;
};

[[nodiscard]] std::uint32_t crc32(std::span<const std::uint8_t> bytes);

}  // namespace alces
