// Numbers as bytes, lowest first, whatever the processor.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace alces {

template <typename Integer>
[[nodiscard]] Integer little_endian(const std::byte* bytes) {
  Integer value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i)
    value = static_cast<Integer>(value | static_cast<Integer>(std::to_integer<Integer>(bytes[i]) << (8 * i)));
  return value;
}

[[nodiscard]] inline float little_endian_float(const std::byte* bytes) {
  return std::bit_cast<float>(little_endian<std::uint32_t>(bytes));
}

/// Fills a buffer from its front; the caller knows that there is room.
class LittleEndianWriter {
 public:
  explicit LittleEndianWriter(std::byte* at) : at_(at) {}
  template <typename Integer>
  void put(Integer value) {
    for (std::size_t i = 0; i < sizeof(Integer); ++i)
      *at_++ = static_cast<std::byte>(value >> (8 * i) & 0xFF);
  }
  void put_float(float value) { put(std::bit_cast<std::uint32_t>(value)); }
  void put(std::span<const std::byte> bytes) {
    for (const std::byte byte : bytes) *at_++ = byte;
  }
  [[nodiscard]] std::byte* at() const { return at_; }

 private:
  std::byte* at_;
};

}  // namespace alces
