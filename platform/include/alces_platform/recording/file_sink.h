// A file as a ByteSink: no heap, no buffer of its own (a recording hands over whole chunks).
//
// A write that ends half way (disk full) is taken back: the file is cut to the last whole write, so that it
// never ends in half a record, and the next write starts there. After each write the kernel is asked to begin
// putting it on the disk (sync_file_range), without waiting for it. What a power loss leaves is then up to
// the file system's commit interval (ext4: 5 s) for the length of the file; sync() waits for all of it, and
// sync_data() and sync_folder() do so from any other thread.
#pragma once

#include <cstdint>
#include <span>

#include "alces_platform/recording/byte_sink.h"

namespace alces {

class FileSink final : public ByteSink {
 public:
  FileSink() = default;
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;
  ~FileSink();

  enum class Existing : std::uint8_t { replace, refuse };

  /// Creates the file, or empties it (or refuses to: EEXIST); a regular file only, and one that no other
  /// process writes (EBUSY). False: error_number() says why.
  [[nodiscard]] bool open(const char* path, Existing existing = Existing::replace);
  [[nodiscard]] bool write(std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] bool read_back(std::uint64_t position, std::span<std::uint8_t> bytes) override;
  /// Waits until everything is on the disk. May take seconds: not from the thread that acquires.
  [[nodiscard]] bool sync();
  /// False when the last of it could not be written. The destructor closes too, and cannot tell.
  [[nodiscard]] bool close();

  [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }
  [[nodiscard]] int descriptor() const { return descriptor_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Of the last call that failed (errno); 0 when none did.
  [[nodiscard]] int error_number() const { return error_number_; }

 private:
  int descriptor_ = -1;
  int error_number_ = 0;
  std::uint64_t size_ = 0;  ///< of whole writes
};

/// Waits until what was written to an open file is on the disk, its length included. 0, or errno.
[[nodiscard]] int sync_data(int descriptor);
/// Waits until the names of the files in a folder are. A file system that cannot do it counts as done.
[[nodiscard]] int sync_folder(const char* folder);

}  // namespace alces
