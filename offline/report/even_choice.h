// A fixed choice of a share of many things, by their number, without pattern.
#pragma once

#include <cstdint>

namespace alces::offline {

/// True for about `fraction` of all indices; those of a smaller fraction are among those of a larger one.
/// (SplitMix64's finaliser, Steele et al. 2014.)
[[nodiscard]] inline bool is_chosen(std::uint64_t index, double fraction) {
  std::uint64_t mixed = index + 0x9E3779B97F4A7C15ULL;
  mixed = (mixed ^ mixed >> 30) * 0xBF58476D1CE4E5B9ULL;
  mixed = (mixed ^ mixed >> 27) * 0x94D049BB133111EBULL;
  mixed ^= mixed >> 31;
  return static_cast<double>(mixed >> 11) < fraction * 9007199254740992.0;  // 2^53
}

}  // namespace alces::offline
