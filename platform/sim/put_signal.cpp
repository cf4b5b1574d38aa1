#include "alces_platform/sim/put_signal.h"

#include <algorithm>
#include <cmath>

namespace alces::sim {

bool put_signal(const Signal& signal, double physical, std::span<std::uint8_t> data) {
  const int length = signal.length_bits;
  if (length < 1 || length > 64 || signal.factor == 0) return false;
  // The place of the least significant bit, counted along the way the signal runs.
  const int data_bits = static_cast<int>(data.size()) * 8;
  const int from_top = (signal.start_bit / 8) * 8 + (7 - signal.start_bit % 8);  // Motorola: bits before it
  if ((signal.is_big_endian ? from_top : signal.start_bit) + length > data_bits) return false;

  const double raw = std::round((physical - signal.offset) / signal.factor);
  std::uint64_t bits = 0;
  if (signal.is_signed) {
    const double limit = std::ldexp(1.0, length - 1);
    if (raw >= limit)
      bits = static_cast<std::uint64_t>((std::uint64_t{1} << (length - 1)) - 1);
    else if (raw < -limit)
      bits = std::uint64_t{1} << (length - 1);
    else if (!std::isnan(raw))
      bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(raw));
  } else {
    const std::uint64_t highest = length == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << length) - 1;
    if (raw >= std::ldexp(1.0, length))
      bits = highest;
    else if (raw > 0)
      bits = static_cast<std::uint64_t>(raw);
  }
  for (int bit = 0; bit < length; ++bit) {
    int place = signal.start_bit + bit;
    if (signal.is_big_endian) {
      const int down = from_top + (length - 1 - bit);
      place = (down / 8) * 8 + (7 - down % 8);
    }
    std::uint8_t& byte = data[static_cast<std::size_t>(place / 8)];
    const auto mask = static_cast<std::uint8_t>(1U << (place % 8));
    const bool is_set = ((bits >> bit) & 1U) != 0;
    byte = static_cast<std::uint8_t>(is_set ? byte | mask : byte & ~mask);
  }
  return true;
}

}  // namespace alces::sim
