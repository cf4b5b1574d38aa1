// A signal in a CAN frame, as DBC files describe it: physical = raw * factor + offset.
//
// Intel (little-endian): start_bit is the least significant bit, bit b is bit b % 8 of byte b / 8. Motorola
// (big-endian): start_bit is the most significant bit in the same numbering; the signal runs down to bit 0 of
// its byte and on from bit 7 of the next byte.
#pragma once

#include <cstdint>
#include <span>

namespace alces::sim {

struct Signal {
  std::uint8_t start_bit = 0;
  std::uint8_t length_bits = 16;
  bool is_big_endian = false;
  bool is_signed = true;
  double factor = 1;
  double offset = 0;
};

/// Rounds to the nearest raw value; what does not fit becomes the largest or smallest that does (a real
/// sensor saturates). False, and nothing written: the signal does not lie within the data, or has no sense
/// (length not 1..64, factor 0). NaN is written as raw 0.
[[nodiscard]] bool put_signal(const Signal& signal, double physical, std::span<std::uint8_t> data);

}  // namespace alces::sim
