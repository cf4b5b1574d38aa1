// Where reduced scans go that do not fit the point pool: a port that the platform implements (a file on
// the vehicle, RAM in a test). Records are written once, in order, and read back whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace alces {

class ScanArchive {
 public:
  /// Stores `bytes` as record `scan`. Called once a scan, ascending. False: it could not be stored.
  [[nodiscard]] virtual bool write(std::uint32_t scan, std::span<const std::byte> bytes) = 0;

  /// Fills `bytes` with the whole of record `scan`; the size is the one it was written with. False:
  /// unreadable.
  [[nodiscard]] virtual bool read(std::uint32_t scan, std::span<std::byte> bytes) = 0;

 protected:
  ~ScanArchive() = default;  // the mapper never owns an archive
};

}  // namespace alces
