// "did you mean": of some words the one that a mistyped word was probably meant to be.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace alces::offline {

/// The candidate with the fewest letters added, left out, changed, or swapped with the next one; empty where
/// even that is more than a third of the word. O(candidates * length^2).
[[nodiscard]] std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace alces::offline
