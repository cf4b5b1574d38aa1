// Where a recording's bytes go, one after the other, and come back from when its index is made.
#pragma once

#include <cstdint>
#include <span>

namespace alces {

class ByteSink {
 public:
  /// Appends all of the bytes, or none: after false the sink holds what it held before, and the same or other
  /// bytes may be tried again later (a full disk that somebody makes room on).
  [[nodiscard]] virtual bool write(std::span<const std::uint8_t> bytes) = 0;
  /// Fills `bytes` with what was written from this position on, at the end of a file; may wait until it has
  /// arrived. False: it cannot be had, or this sink cannot do it.
  [[nodiscard]] virtual bool read_back(std::uint64_t position, std::span<std::uint8_t> bytes) {
    static_cast<void>(position);
    static_cast<void>(bytes);
    return false;
  }

 protected:
  ~ByteSink() = default;
};

}  // namespace alces
