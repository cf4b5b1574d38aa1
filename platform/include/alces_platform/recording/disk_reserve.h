// Leaves room on the disk that a recording is written to: for the system, for maps, for whoever makes room.
//
// A write that would leave less than the reserve is refused, as a full disk refuses it, and taken again once
// there is more room. Asks the file system before each write (statvfs, some microseconds): recordings write
// whole chunks.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string>

#include "alces_platform/recording/byte_sink.h"

namespace alces {

class DiskReserve final : public ByteSink {
 public:
  explicit DiskReserve(ByteSink& below) : below_(below) {}

  /// Before the first write. `path`: a file or folder on that disk. `bytes` stay free, but never more than a
  /// twentieth of the disk; 0: none.
  void keep_free(const std::string& path, std::uint64_t bytes);
  /// From any thread: the recording ends, its last writes may take of the reserve.
  void release() { is_released_.store(true, std::memory_order_relaxed); }

  [[nodiscard]] bool write(std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] bool read_back(std::uint64_t position, std::span<std::uint8_t> bytes) override {
    return below_.read_back(position, bytes);
  }

 private:
  [[nodiscard]] bool leaves_enough(std::uint64_t bytes) const;

  ByteSink& below_;
  std::string path_;
  std::uint64_t reserve_bytes_ = 0;
  std::atomic<bool> is_released_{false};
};

}  // namespace alces
