#include "zstd_source.h"

#ifdef ALCES_HAS_ZSTD
#include <zstd.h>
#endif

#include "alces_platform/bags/bag_reader.h"

namespace alces::bags {

#ifdef ALCES_HAS_ZSTD

struct ZstdSource::Stream {
  ZSTD_DStream* context = ZSTD_createDStream();
  ~Stream() { ZSTD_freeDStream(context); }
};

bool has_zstd() {
  return true;
}

ZstdSource::ZstdSource(ByteSource& packed)
    : packed_(packed), stream_(std::make_unique<Stream>()), buffer_(ZSTD_DStreamInSize()) {
  // a window beyond this is nobody's bag
  ZSTD_DCtx_setParameter(stream_->context, ZSTD_d_windowLogMax, 27);
}

std::size_t ZstdSource::read(std::span<std::uint8_t> room) {
  ZSTD_outBuffer out = {room.data(), room.size(), 0};
  while (out.pos < out.size && !is_over_) {
    if (begin_ == end_) {
      begin_ = 0;
      end_ = packed_.read(buffer_);
      packed_bytes_ += end_;
    }
    const bool is_end = end_ < buffer_.size();
    ZSTD_inBuffer in = {buffer_.data(), end_, begin_};
    const std::size_t before = out.pos;
    const std::size_t hint = ZSTD_decompressStream(stream_->context, &out, &in);
    const bool has_moved = in.pos > begin_ || out.pos > before;
    begin_ = in.pos;
    // damaged, cut, or at the end: the reader of what is inside says which
    is_over_ = ZSTD_isError(hint) != 0U || (!has_moved && is_end);
  }
  return out.pos;
}

bool unzstd(std::span<const std::uint8_t> packed, std::vector<std::uint8_t>& unpacked) {
  const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN ||
      size > BagReader::largest_message_bytes || size / 100'000 > packed.size())
    return false;
  unpacked.resize(static_cast<std::size_t>(size));
  return ZSTD_decompress(unpacked.data(), unpacked.size(), packed.data(), packed.size()) == size;
}

#else

struct ZstdSource::Stream {};

bool has_zstd() {
  return false;
}

ZstdSource::ZstdSource(ByteSource& packed) : packed_(packed) {}

std::size_t ZstdSource::read(std::span<std::uint8_t> /*room*/) {
  return 0;
}

bool unzstd(std::span<const std::uint8_t> /*packed*/, std::vector<std::uint8_t>& /*unpacked*/) {
  return false;
}

#endif

ZstdSource::~ZstdSource() = default;

}  // namespace alces::bags
