// Where a recording's bytes go, one after the other.
#pragma once

#include <cstdint>
#include <span>

namespace alces {

class ByteSink {
 public:
  /// Appends all of the bytes, or none: after false the sink holds what it held before, and the same or other
  /// bytes may be tried again later (a full disk that somebody makes room on).
  [[nodiscard]] virtual bool write(std::span<const std::uint8_t> bytes) = 0;

 protected:
  ~ByteSink() = default;
};

}  // namespace alces
