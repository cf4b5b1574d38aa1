// LZF, the compression inside PCD's binary_compressed, unpacked by Marc Lehmann's LibLZF.
#pragma once

#include <span>
#include <string_view>

namespace alces::offline {

/// A compressed byte stands for fewer than this many.
inline constexpr std::size_t lzf_largest_expansion = 88;

/// False when `compressed` is damaged or does not fill `out` exactly; at most 4 GiB, as PCD itself.
[[nodiscard]] bool lzf_decompress(std::string_view compressed, std::span<char> out);

}  // namespace alces::offline
