// The events of a recording as an EventSource, its own ticks among them: a replay hands on what the drive
// handed on.
#pragma once

#include <filesystem>
#include <string>

#include "alces_platform/recording/recording_reader.h"
#include "alces_platform/replay/event_source.h"

namespace alces::replay {

class RecordingSource final : public EventSource {
 public:
  /// TraceError when the file cannot be opened or is no recording.
  explicit RecordingSource(const std::filesystem::path& file);

  /// TraceError when a read fails: that is not the end.
  [[nodiscard]] bool next(Event& event) override;
  [[nodiscard]] std::string name() const override { return name_; }
  /// The reader's, and how many messages are missing or malformed.
  [[nodiscard]] TraceProblems problems() const override;
  [[nodiscard]] std::uint64_t bytes_read() const override { return reader_.file().counters().bytes; }
  [[nodiscard]] const RecordingReader& reader() const { return reader_; }

 private:
  std::string name_;
  FileSource file_;
  RecordingReader reader_;
};

}  // namespace alces::replay
