// Random numbers that are the same on every machine and standard library: splitmix64, and distributions
// written out. Two draws never stand in one list of arguments in parentheses: their order would be the
// compiler's. In braces it is the reader's.
#pragma once

#include <cstdint>

namespace alces::sim {

/// A good 64-bit hash of a 64-bit number (the finaliser of splitmix64).
[[nodiscard]] constexpr std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

[[nodiscard]] constexpr std::uint64_t mix(std::uint64_t a, std::uint64_t b) {
  return mix(mix(a) ^ b);
}
[[nodiscard]] constexpr std::uint64_t mix(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  return mix(mix(a, b) ^ c);
}

class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) : state_(mix(seed)) {}

  constexpr std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15u;
    return mix(state_);
  }

  /// In [0, 1).
  constexpr double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  constexpr double uniform(double low, double high) { return low + (high - low) * uniform(); }
  constexpr bool chance(double probability) { return uniform() < probability; }

  /// In [low, high], both included.
  constexpr int integer(int low, int high) {
    return low + static_cast<int>(uniform() * static_cast<double>(high - low + 1));
  }

  /// Standard deviation 1; the sum of four uniform numbers, so it never leaves +-3.5.
  constexpr double normal() {
    const std::uint64_t bits = next();
    double sum = -2.0;
    for (unsigned part = 0; part < 4; ++part)
      sum += (static_cast<double>((bits >> (16 * part)) & 0xffff) + 0.5) * 0x1p-16;
    return sum * 1.7320508075688772;
  }

 private:
  std::uint64_t state_;
};

}  // namespace alces::sim
