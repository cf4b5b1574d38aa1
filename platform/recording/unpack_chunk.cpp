#include "unpack_chunk.h"

#ifdef ALCES_HAS_ZSTD
#include <zstd.h>
#endif
#ifdef ALCES_HAS_LZ4
#include <lz4frame.h>
#endif

#include <algorithm>
#include <cstddef>

namespace alces::mcap {
namespace {

#ifdef ALCES_HAS_ZSTD
bool unpack_zstd(std::span<const std::uint8_t> packed, std::vector<std::uint8_t>& unpacked) {
  const std::size_t size = ZSTD_decompress(unpacked.data(), unpacked.size(), packed.data(), packed.size());
  return ZSTD_isError(size) == 0U && size == unpacked.size();
}
#endif

#ifdef ALCES_HAS_LZ4
bool unpack_lz4(std::span<const std::uint8_t> packed, std::vector<std::uint8_t>& unpacked) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0U) return false;
  std::size_t filled = 0;
  std::size_t taken = 0;
  std::size_t hint = 1;  // bytes that it still wants; 0: the frame is whole
  while (hint != 0 && taken < packed.size()) {
    std::size_t room = unpacked.size() - filled;
    std::size_t left = packed.size() - taken;
    hint = LZ4F_decompress(context, unpacked.data() + filled, &room, packed.data() + taken, &left, nullptr);
    if (LZ4F_isError(hint) != 0U || (room == 0 && left == 0)) {
      hint = 1;
      break;
    }
    filled += room;
    taken += left;
  }
  LZ4F_freeDecompressionContext(context);
  return hint == 0 && filled == unpacked.size();
}
#endif

}  // namespace

bool can_unpack(std::string_view compression) {
#ifdef ALCES_HAS_ZSTD
  if (compression == "zstd") return true;
#endif
#ifdef ALCES_HAS_LZ4
  if (compression == "lz4") return true;
#endif
  static_cast<void>(compression);
  return false;
}

bool unpack(std::string_view compression, std::span<const std::uint8_t> packed, std::uint64_t size,
            std::vector<std::uint8_t>& unpacked) {
  // no packer makes a hundred thousand bytes out of one: an absurd size is not allocated for
  constexpr std::uint64_t largest_expansion = 100'000;
  if (size > largest_unpacked_bytes || size / largest_expansion > packed.size()) return false;
  unpacked.resize(static_cast<std::size_t>(size));
#ifdef ALCES_HAS_ZSTD
  if (compression == "zstd") return unpack_zstd(packed, unpacked);
#endif
#ifdef ALCES_HAS_LZ4
  if (compression == "lz4") return unpack_lz4(packed, unpacked);
#endif
  static_cast<void>(compression);
  return false;
}

}  // namespace alces::mcap
