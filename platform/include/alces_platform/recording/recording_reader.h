// A recording, front to back: the events exactly as they were recorded, in the order in which they were
// handed on, the results between them, and the configuration. Reads what is there of a file that was cut or
// damaged (mcap_reader.h). Uses the heap.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "alces_drivers/scanner/event.h"
#include "alces_platform/recording/cdr.h"
#include "alces_platform/recording/mcap_reader.h"
#include "alces_platform/recording/records.h"

namespace alces {

/// A message of a topic that is not ours, or whose type is another.
struct ForeignRecord {};

struct RecordedMessage {
  std::uint16_t channel = 0;      ///< of the file
  std::uint64_t bytes = 0;        ///< as it was encoded
  std::int64_t handed_on_ns = 0;  ///< when it was handed on: never decreases
  std::variant<Event, ScanRecord, CloudRecord, PoseRecord, PathRecord, LoopRecord, GraphEdgeRecord,
               DiagnosticRecord, TransformRecord, ForeignRecord>
      content;
};

class RecordingReader {
 public:
  explicit RecordingReader(ByteSource& source) : mcap_(source) {}

  /// False: this is no recording; problems() says why.
  bool open();
  /// The next message; its texts and spans are valid until the next call. False: no more.
  bool next(RecordedMessage& message);
  /// The next event; results are passed over.
  bool next_event(Event& event);

  /// The text of vehicle.toml; empty when the recording has none.
  [[nodiscard]] std::string configuration() const;
  /// UTC - CLOCK_MONOTONIC when the recording began; 0: not known.
  [[nodiscard]] std::int64_t utc_offset_ns() const;
  /// How many CAN buses have topics.
  [[nodiscard]] std::uint8_t can_bus_count() const;

  [[nodiscard]] bool is_whole() const { return mcap_.is_whole() && counters_.messages_malformed == 0; }
  [[nodiscard]] const std::vector<std::string>& problems() const { return mcap_.problems(); }
  [[nodiscard]] std::uint64_t problem_count() const { return mcap_.problem_count(); }
  [[nodiscard]] const mcap::Reader& file() const { return mcap_; }

  struct Counters {
    std::uint64_t events = 0;
    std::uint64_t results = 0;
    std::uint64_t foreign = 0;
    std::uint64_t messages_malformed = 0;  ///< do not decode as their type: passed over
    std::uint64_t messages_missing = 0;    ///< by the gaps in the sequence numbers

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("events", events);
      visit("results", results);
      visit("foreign", foreign);
      visit("messages_malformed", messages_malformed);
      visit("messages_missing", messages_missing);
    }
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  [[nodiscard]] int topic_of(std::uint16_t channel);
  [[nodiscard]] bool decode(int topic, const mcap::ReadMessage& raw, RecordedMessage& message);
  [[nodiscard]] ScanRecord decode_scan(CdrReader& cdr, std::int64_t stamp_ns) const;
  [[nodiscard]] CloudRecord decode_cloud(CdrReader& cdr, std::int64_t stamp_ns);
  [[nodiscard]] PathRecord decode_path(CdrReader& cdr, std::int64_t stamp_ns);
  [[nodiscard]] DiagnosticRecord decode_diagnostic(CdrReader& cdr, std::int64_t stamp_ns);

  mcap::Reader mcap_;
  std::map<std::uint16_t, int> topics_;  ///< our place of it, by the file's channel; -1: foreign
  std::map<std::uint16_t, std::uint32_t> next_sequence_;
  std::vector<Point> points_;
  std::vector<Pose> poses_;
  std::vector<std::int64_t> stamps_ns_;
  std::vector<DiagnosticValue> values_;
  Counters counters_;
};

/// What is in a file, for people.
struct RecordingSummary {
  struct Topic {
    std::string name;
    std::string type;
    std::uint64_t messages = 0;
    std::uint64_t bytes = 0;
  };
  std::vector<Topic> topics;  ///< those that have messages, in the order of the file's channels
  std::uint64_t bytes = 0;
  std::uint64_t messages = 0;
  std::uint64_t messages_missing = 0;
  std::int64_t begin_ns = 0;  ///< of our own topics
  std::int64_t end_ns = 0;
  std::int64_t utc_offset_ns = 0;
  bool has_configuration = false;
  bool is_recording = false;  ///< it is an MCAP file
  bool is_whole = false;
  int read_error = 0;  ///< errno; the figures are then of a part of the file
  std::vector<std::string> problems;
};
[[nodiscard]] RecordingSummary summarise_recording(ByteSource& source);

}  // namespace alces
