// A recording (MCAP) written on the desk, that appears under its name only when it is whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "alces/arena.h"
#include "alces_platform/recording/file_sink.h"
#include "alces_platform/recording/recording_writer.h"

namespace alces::offline {

/// Settings without a power loss to fear: few, large chunks. `configuration` outlives the writer.
[[nodiscard]] RecordingConfig desk_recording_config(const std::string& configuration,
                                                    std::int64_t utc_offset_ns, std::uint8_t can_bus_count);

class RecordingFile {
 public:
  /// OutputError.
  RecordingFile(const std::filesystem::path& file, const RecordingConfig& config);
  RecordingFile(const RecordingFile&) = delete;
  RecordingFile& operator=(const RecordingFile&) = delete;
  /// Without commit() nothing is left behind.
  ~RecordingFile();

  [[nodiscard]] RecordingWriter& writer() { return *writer_; }
  /// OutputError.
  void commit();

 private:
  struct alignas(Arena::alignment) Line {
    std::byte bytes[Arena::alignment];
  };
  [[noreturn]] void fail() const;

  std::filesystem::path file_;
  std::string part_;
  FileSink sink_;
  std::vector<Line> block_;
  RecordingWriter* writer_ = nullptr;
  bool is_committed_ = false;
};

}  // namespace alces::offline
