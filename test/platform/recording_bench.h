// A recording in memory, for tests.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "alces_platform/recording/recording_reader.h"
#include "alces_platform/recording/recording_writer.h"
#include "recording/sample_drive.h"

namespace alces {

/// Takes whole writes up to a capacity that the test may change: a disk.
class MemorySink final : public ByteSink {
 public:
  [[nodiscard]] bool write(std::span<const std::uint8_t> piece) override {
    if (bytes.size() + piece.size() > capacity) return false;
    bytes.insert(bytes.end(), piece.begin(), piece.end());
    return true;
  }
  [[nodiscard]] bool read_back(std::uint64_t position, std::span<std::uint8_t> piece) override {
    if (!reads_back || piece.size() > bytes.size() || position > bytes.size() - piece.size()) return false;
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(position), piece.size(), piece.begin());
    return true;
  }
  std::vector<std::uint8_t> bytes;
  std::size_t capacity = SIZE_MAX;
  bool reads_back = true;
};

class HeardNotices final : public NoticePort {
 public:
  void raise(const Notice& notice) override { notices.push_back(notice); }
  std::vector<Notice> notices;
};

/// A writer with its block.
class RecordingBench {
 public:
  explicit RecordingBench(RecordingConfig config = small())
      : block_(RecordingWriter::memory_required(config) + 64) {
    std::byte* begin = block_.data();
    begin += (64 - reinterpret_cast<std::uintptr_t>(begin) % 64) % 64;
    writer = RecordingWriter::create({begin, block_.size() - 64}, config, sink, &heard, status);
  }

  /// Small chunks, so that a small file has several.
  static RecordingConfig small() {
    RecordingConfig config;
    config.chunk_bytes = 4096;
    config.messages_per_chunk = 64;
    config.chunk_capacity = 64;
    config.can_bus_count = 2;
    config.configuration = sample::configuration;
    config.utc_offset_ns = sample::utc_offset_ns;
    config.begin_stamp_ns = sample::begin_ns;
    return config;
  }

  MemorySink sink;
  HeardNotices heard;
  RecordingStatus status{};
  RecordingWriter* writer = nullptr;

 private:
  std::vector<std::byte> block_;
};

inline std::vector<std::uint8_t> sample_recording(std::uint32_t events) {
  RecordingBench bench;
  sample::record(*bench.writer, events);
  if (!bench.writer->finish()) return {};
  return bench.sink.bytes;
}

/// All that a reader gets out of a file.
struct ReadBack {
  bool opened = false;
  bool is_whole = false;
  std::vector<sample::OwnedEvent> events;
  std::vector<std::string> problems;
  RecordingReader::Counters counters;
  mcap::Reader::Counters file;
  std::string configuration;
};

inline ReadBack read_back(std::span<const std::uint8_t> bytes) {
  MemorySource source(bytes);
  RecordingReader reader(source);
  ReadBack read;
  read.opened = reader.open();
  read.configuration = reader.configuration();
  Event event;
  while (reader.next_event(event)) {
    sample::OwnedEvent& owned = read.events.emplace_back();
    owned.bytes.assign(event.bytes.begin(), event.bytes.end());
    owned.event = event;
    owned.event.bytes = owned.bytes;
  }
  // the vector may have moved them meanwhile
  for (sample::OwnedEvent& owned : read.events) owned.event.bytes = owned.bytes;
  read.is_whole = reader.is_whole();
  read.problems = reader.problems();
  read.counters = reader.counters();
  read.file = reader.file().counters();
  return read;
}

}  // namespace alces
