// A file that zstd packed as a whole, as rosbag2 does (compression_mode FILE), unpacked as it is read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "alces_platform/recording/byte_source.h"

namespace alces::bags {

class ZstdSource final : public ByteSource {
 public:
  explicit ZstdSource(ByteSource& packed);
  ZstdSource(const ZstdSource&) = delete;
  ZstdSource& operator=(const ZstdSource&) = delete;
  ~ZstdSource();

  [[nodiscard]] std::size_t read(std::span<std::uint8_t> room) override;
  [[nodiscard]] int error_number() const override { return packed_.error_number(); }
  [[nodiscard]] std::uint64_t packed_bytes_read() const { return packed_bytes_; }

 private:
  struct Stream;
  ByteSource& packed_;
  std::unique_ptr<Stream> stream_;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::uint64_t packed_bytes_ = 0;
  bool is_over_ = false;
};

/// Whether there is a library for it.
[[nodiscard]] bool has_zstd();

/// One message that zstd packed by itself (rosbag2's compression_mode MESSAGE). False: damaged, or absurdly
/// large.
[[nodiscard]] bool unzstd(std::span<const std::uint8_t> packed, std::vector<std::uint8_t>& unpacked);

}  // namespace alces::bags
