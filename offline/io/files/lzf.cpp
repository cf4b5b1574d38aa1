#include "lzf.h"

extern "C" {
#include <lzf.h>
}

#include <limits>

namespace alces::offline {

bool lzf_decompress(std::string_view compressed, std::span<char> out) {
  constexpr std::size_t most = std::numeric_limits<unsigned int>::max();
  if (compressed.size() > most || out.size() > most) return false;
  if (compressed.empty()) return out.empty();  // LibLZF would read a first byte that is not there
  const unsigned int filled =
      ::lzf_decompress(compressed.data(), static_cast<unsigned int>(compressed.size()), out.data(),
                       static_cast<unsigned int>(out.size()));
  return filled != 0 && filled == out.size();
}

}  // namespace alces::offline
