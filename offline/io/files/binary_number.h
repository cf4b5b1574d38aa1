// Numbers as PCD and PLY store them.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace alces::offline {

enum class NumberType { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };

[[nodiscard]] constexpr std::size_t size_of(NumberType type) {
  switch (type) {
    case NumberType::i8:
    case NumberType::u8:
      return 1;
    case NumberType::i16:
    case NumberType::u16:
      return 2;
    case NumberType::i32:
    case NumberType::u32:
    case NumberType::f32:
      return 4;
    case NumberType::i64:
    case NumberType::u64:
    case NumberType::f64:
      break;
  }
  return 8;
}

template <typename T>
[[nodiscard]] T load(const char* at, std::endian order) {
  std::array<char, sizeof(T)> bytes{};
  std::memcpy(bytes.data(), at, sizeof(T));
  if (order != std::endian::native) std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<T>(bytes);
}

/// The number at `at`, which need not be aligned.
[[nodiscard]] inline double load_number(const char* at, NumberType type, std::endian order) {
  switch (type) {
    case NumberType::i8:
      return load<std::int8_t>(at, order);
    case NumberType::u8:
      return load<std::uint8_t>(at, order);
    case NumberType::i16:
      return load<std::int16_t>(at, order);
    case NumberType::u16:
      return load<std::uint16_t>(at, order);
    case NumberType::i32:
      return load<std::int32_t>(at, order);
    case NumberType::u32:
      return load<std::uint32_t>(at, order);
    case NumberType::i64:
      return static_cast<double>(load<std::int64_t>(at, order));
    case NumberType::u64:
      return static_cast<double>(load<std::uint64_t>(at, order));
    case NumberType::f32:
      return static_cast<double>(load<float>(at, order));
    case NumberType::f64:
      break;
  }
  return load<double>(at, order);
}

}  // namespace alces::offline
