#include "recording_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <system_error>

#include "alces_drivers/stamp.h"
#include "offline/io/files/error.h"

namespace alces::offline {

RecordingConfig desk_recording_config(const std::string& configuration, std::int64_t utc_offset_ns,
                                      std::uint8_t can_bus_count) {
  RecordingConfig config;
  config.chunk_bytes = std::size_t{16} << 20;  // the largest message of any recording we write
  config.messages_per_chunk = 65535;
  config.flush_interval_ns = 5 * ns_per_s;
  config.can_bus_count = std::min(can_bus_count, recording::maximum_can_buses);
  config.configuration = configuration;
  config.utc_offset_ns = utc_offset_ns;
  return config;
}

RecordingFile::RecordingFile(const std::filesystem::path& file, const RecordingConfig& config)
    : file_(file), part_(file.string() + ".part") {
  if (!sink_.open(part_.c_str())) fail();
  block_.resize(RecordingWriter::memory_required(config) / sizeof(Line) + 1);
  RecordingStatus status{};
  writer_ =
      RecordingWriter::create(std::as_writable_bytes(std::span(block_)), config, sink_, nullptr, status);
  if (writer_ == nullptr) throw Error(to_string(status), 4);
}

RecordingFile::~RecordingFile() {
  std::error_code ignored;
  if (!is_committed_) std::filesystem::remove(part_, ignored);
}

void RecordingFile::commit() {
  if (!writer_->finish() || writer_->file_counters().chunks_lost > 0 || sink_.error_number() != 0 ||
      !sink_.sync() || !sink_.close())
    fail();
  std::error_code error;
  std::filesystem::rename(part_, file_, error);
  if (error) throw OutputError(file_, fmt::format("cannot be written ({})", error.message()));
  is_committed_ = true;
}

void RecordingFile::fail() const {
  throw OutputError(file_, fmt::format("cannot be written ({})", std::strerror(sink_.error_number())));
}

}  // namespace alces::offline
