#include "alces_offline/lzf.h"

#include <algorithm>

namespace alces::offline {

bool lzf_decompress(std::string_view compressed, std::span<char> out) {
  std::size_t in = 0;
  std::size_t filled = 0;
  const auto next = [&] { return static_cast<std::size_t>(static_cast<unsigned char>(compressed[in++])); };
  while (in < compressed.size()) {
    const std::size_t control = next();
    if (control < 32) {  // 000LLLLL: L + 1 literals
      const std::size_t length = control + 1;
      if (length > compressed.size() - in || length > out.size() - filled) return false;
      std::copy_n(compressed.data() + in, length, out.data() + filled);
      in += length;
      filled += length;
    } else {  // LLLooooo [LLLLLLLL] oooooooo: L + 2 bytes from o + 1 bytes back
      std::size_t length = control >> 5;
      if (length == 7) {
        if (in == compressed.size()) return false;
        length += next();
      }
      if (in == compressed.size()) return false;
      const std::size_t distance = ((control & 31) << 8 | next()) + 1;
      length += 2;
      if (distance > filled || length > out.size() - filled) return false;
      // byte by byte: source and destination may overlap, which repeats a pattern
      for (const std::size_t stop = filled + length; filled < stop; ++filled)
        out[filled] = out[filled - distance];
    }
  }
  return filled == out.size();
}

}  // namespace alces::offline
