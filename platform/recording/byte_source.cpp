#include "alces_platform/recording/byte_source.h"

#include <sys/types.h>

#include <algorithm>
#include <cerrno>

namespace alces {

static_assert(sizeof(off_t) == 8, "files end at 2 GiB: build with _FILE_OFFSET_BITS=64");

std::size_t MemorySource::read(std::span<std::uint8_t> room) {
  const std::size_t size = std::min(room.size(), bytes_.size());
  std::ranges::copy(bytes_.first(size), room.begin());
  bytes_ = bytes_.subspan(size);
  return size;
}

FileSource::FileSource(const char* path) : file_(std::fopen(path, "rbe")) {
  if (file_ == nullptr) error_number_ = errno;
}

FileSource::~FileSource() {
  if (file_ != nullptr) std::fclose(file_);
}

std::size_t FileSource::read(std::span<std::uint8_t> room) {
  if (file_ == nullptr) return 0;
  std::size_t size = 0;
  while (size < room.size()) {
    errno = 0;
    size += std::fread(room.data() + size, 1, room.size() - size, file_);
    if (size == room.size() || std::ferror(file_) == 0) break;
    if (errno != EINTR) {
      error_number_ = errno != 0 ? errno : EIO;
      break;
    }
    std::clearerr(file_);
  }
  return size;
}

}  // namespace alces
