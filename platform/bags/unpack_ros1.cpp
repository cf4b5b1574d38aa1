#include "unpack_ros1.h"

#ifdef ALCES_HAS_BZIP2
#include <bzlib.h>
#endif
#ifdef ALCES_HAS_LZ4
#include <lz4frame.h>
#endif

#include <algorithm>

namespace alces::bags {
namespace {

constexpr std::size_t step_bytes = std::size_t{1} << 20;

/// Room for the next bytes behind `filled`; empty: there are `size` of them.
std::span<std::uint8_t> more_room(std::vector<std::uint8_t>& bytes, std::size_t filled, std::size_t size) {
  if (filled == bytes.size()) bytes.resize(std::min(size, filled + step_bytes));
  return std::span(bytes).subspan(filled);
}

#ifdef ALCES_HAS_BZIP2
std::size_t unpack_bz2(std::span<const std::uint8_t> packed, std::size_t size,
                       std::vector<std::uint8_t>& unpacked) {
  std::vector<char> in(packed.begin(), packed.end());  // the library wants it writable
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return 0;
  stream.next_in = in.data();
  stream.avail_in = static_cast<unsigned>(in.size());
  std::size_t filled = 0;
  int result = BZ_OK;
  while (result == BZ_OK && filled < size) {
    const std::span<std::uint8_t> room = more_room(unpacked, filled, size);
    stream.next_out = reinterpret_cast<char*>(room.data());
    stream.avail_out = static_cast<unsigned>(room.size());
    const unsigned left = stream.avail_in;
    result = BZ2_bzDecompress(&stream);
    const std::size_t got = room.size() - stream.avail_out;
    if (got == 0 && left == stream.avail_in) break;  // it was cut
    filled += got;
  }
  BZ2_bzDecompressEnd(&stream);
  return filled;
}
#endif

#ifdef ALCES_HAS_LZ4
std::size_t unpack_lz4(std::span<const std::uint8_t> packed, std::size_t size,
                       std::vector<std::uint8_t>& unpacked) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0U) return 0;
  std::size_t filled = 0;
  std::size_t taken = 0;
  while (filled < size) {
    const std::span<std::uint8_t> room = more_room(unpacked, filled, size);
    std::size_t got = room.size();
    std::size_t used = packed.size() - taken;
    const std::size_t hint =
        LZ4F_decompress(context, room.data(), &got, packed.data() + taken, &used, nullptr);
    if (LZ4F_isError(hint) != 0U) break;
    filled += got;
    taken += used;
    if (hint == 0 || (got == 0 && used == 0)) break;  // its end, or it was cut
  }
  LZ4F_freeDecompressionContext(context);
  return filled;
}
#endif

}  // namespace

bool can_unpack_ros1(std::string_view compression) {
#ifdef ALCES_HAS_BZIP2
  if (compression == "bz2") return true;
#endif
#ifdef ALCES_HAS_LZ4
  if (compression == "lz4") return true;
#endif
  static_cast<void>(compression);
  return false;
}

bool unpack_ros1(std::string_view compression, std::span<const std::uint8_t> packed, std::size_t size,
                 std::vector<std::uint8_t>& unpacked) {
  unpacked.clear();
  std::size_t filled = 0;
#ifdef ALCES_HAS_BZIP2
  if (compression == "bz2") filled = unpack_bz2(packed, size, unpacked);
#endif
#ifdef ALCES_HAS_LZ4
  if (compression == "lz4") filled = unpack_lz4(packed, size, unpacked);
#endif
  static_cast<void>(compression);
  static_cast<void>(packed);
  unpacked.resize(filled);
  return filled == size;
}

}  // namespace alces::bags
