#include "alces_platform/recording/disk_reserve.h"

#include <sys/statvfs.h>

#include <algorithm>

namespace alces {

void DiskReserve::keep_free(const std::string& path, std::uint64_t bytes) {
  path_ = path;
  reserve_bytes_ = bytes;
}

bool DiskReserve::write(std::span<const std::uint8_t> bytes) {
  return leaves_enough(bytes.size()) && below_.write(bytes);
}

bool DiskReserve::leaves_enough(std::uint64_t bytes) const {
  if (reserve_bytes_ == 0 || is_released_.load(std::memory_order_relaxed)) return true;
  struct statvfs disk {};
  if (statvfs(path_.c_str(), &disk) != 0) return true;  // the write itself will say what is wrong
  const std::uint64_t block_bytes = disk.f_frsize;
  const std::uint64_t reserve_bytes = std::min(reserve_bytes_, disk.f_blocks * block_bytes / 20);
  return disk.f_bavail * block_bytes >= reserve_bytes + bytes;
}

}  // namespace alces
