// A drive as one MCAP file: every event as it came, the results, diagnostics, the configuration. No heap: all
// memory is one block. channels.h lists the topics.
//
// A chunk is written when it is full, or flush_interval_ns after its first message. A file cut off by a power
// loss is readable to its last whole chunk. When the sink takes nothing (disk full), chunks are kept as long
// as they fit memory, then given up and counted; recording goes on with a whole chunk as soon as there is
// room. Both are said once, through the NoticePort.
//
// Bytes in the file: 47 a message and its index entry, and the message itself: tick 12, edge 20, CAN frame
// 36, FD frame 36 and its data, bytes 20 and the data, pose 76 and its transform 92, cloud 113 and 12 a
// point, path 28 and 72 a pose. The head has about 12 KiB and is there twice, the summary about 12 KiB.
// Memory: mcap_writer.h; with the defaults 1.7 MB. Time: O(bytes); when a chunk is written, the sink's.
//
// One thread at a time. The order of calls is the order in the file.
#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "alces/arena.h"
#include "alces_drivers/notice_rate_limiter.h"
#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/scanner/event.h"
#include "alces_platform/recording/byte_sink.h"
#include "alces_platform/recording/cdr.h"
#include "alces_platform/recording/channels.h"
#include "alces_platform/recording/mcap_writer.h"
#include "alces_platform/recording/records.h"

namespace alces {

enum class RecordingStatus : std::uint8_t { ok, block_too_small, block_misaligned, bad_config };
[[nodiscard]] const char* to_string(RecordingStatus status);

struct RecordingConfig {
  std::size_t chunk_bytes = std::size_t{1} << 20;  ///< 4 KiB to 64 MiB; the largest message fits in one
  std::uint32_t messages_per_chunk = 8192;         ///< 16 to 65535
  std::uint32_t chunk_capacity = 4096;             ///< rows of the index in memory; see mcap_writer.h
  std::int64_t flush_interval_ns = 500'000'000;
  std::uint8_t can_bus_count = 1;  ///< up to recording::maximum_can_buses
  std::string_view configuration;  ///< attached as vehicle.toml; outlives the writer. Replay needs it
  std::int64_t utc_offset_ns = 0;  ///< UTC - CLOCK_MONOTONIC when recording begins; 0: not known
  std::int64_t begin_stamp_ns = 0;
};

class RecordingWriter final : public EventSink {
 public:
  [[nodiscard]] static std::size_t memory_required(const RecordingConfig& config);

  /// Lays a writer out in `block` (64-byte aligned), which must outlive it, as must sink and notices (null:
  /// nobody listens). Null, and `status` says why. The first bytes are written with the first chunk.
  [[nodiscard]] static RecordingWriter* create(std::span<std::byte> block, const RecordingConfig& config,
                                               ByteSink& sink, NoticePort* notices, RecordingStatus& status);

  /// Any kind; its stamp may run against the order. Events of buses and channels that the recording does not
  /// have are counted, not written.
  void on_event(const Event& event) override;

  /// What follows is handed on at this time, where no events say so. A time before the last one changes
  /// nothing.
  void advance_to(std::int64_t now_ns);

  void write_scan_info(const ScanRecord& scan);
  /// False, and counted: larger than a chunk.
  bool write_cloud(const CloudRecord& cloud);
  /// Twice: as a pose, and as a transform between the frames "map" and "body", by which viewers place the
  /// cloud of the same stamp.
  void write_pose(const PoseRecord& pose);
  /// A path longer than a chunk is thinned: every second pose, every fourth, ...; the last is always there.
  /// Counted.
  void write_path(const PathRecord& path);
  void write_loop(const LoopRecord& loop);
  void write_edge(const GraphEdgeRecord& edge);
  void write_diagnostics(const DiagnosticRecord& diagnostic);
  void write_notice(const Notice& notice);

  /// One line of diagnostics with all counters of a part: of any struct with visit(visitor(name, count)).
  template <class Counters>
  void write_counters(std::int64_t stamp_ns, std::string_view name, const Counters& counters) {
    put(recording::Topic::diagnostics, stamp_ns, [&](CdrWriter& cdr) {
      begin_diagnostic(cdr, {stamp_ns, DiagnosticLevel::ok, name, "counters", {}});
      const std::size_t place = cdr.count_later();
      std::uint32_t count = 0;
      counters.visit([&](std::string_view key, std::uint64_t value) {
        std::array<char, 24> digits{};
        const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
        cdr.string(key);
        cdr.string({digits.data(), static_cast<std::size_t>(end - digits.data())});
        ++count;
      });
      cdr.count(place, count);
    });
  }

  /// What is in memory, to the sink. False: it did not take it; it stays.
  bool flush();
  /// Ends the file. False: the sink did not take all of it; what it holds is readable. Nothing may follow.
  bool finish();

  struct Counters {
    std::uint64_t events = 0;
    std::uint64_t events_unknown = 0;      ///< of a bus, channel or kind that the recording does not have
    std::uint64_t messages_too_large = 0;  ///< larger than a chunk
    std::uint64_t paths_thinned = 0;
    std::uint64_t stamps_negative = 0;  ///< written as 0
    std::uint64_t frames_too_long = 0;  ///< more than 64 bytes: cut

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("events", events);
      visit("events_unknown", events_unknown);
      visit("messages_too_large", messages_too_large);
      visit("paths_thinned", paths_thinned);
      visit("stamps_negative", stamps_negative);
      visit("frames_too_long", frames_too_long);
    }
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }
  /// Chunks, bytes, and what was lost.
  [[nodiscard]] const mcap::Writer::Counters& file_counters() const { return mcap_.counters(); }
  /// The sink takes nothing at the moment.
  [[nodiscard]] bool is_stalled() const { return is_stalled_; }

 private:
  enum class NoticeKind : std::uint8_t { too_large, thinned, not_indexed, too_long, count };
  friend class Arena;
  RecordingWriter(Arena& arena, const RecordingConfig& config, ByteSink* sink, NoticePort* notices);

  [[nodiscard]] static mcap::WriterConfig file_config(const RecordingConfig& config,
                                                      std::span<const mcap::KeyValue> metadata);

  /// `fill` writes the message; it is called again when the chunk had no room for it.
  template <class Fill>
  bool put(recording::Topic topic, std::int64_t stamp_ns, Fill&& fill) {
    return put_on(static_cast<std::uint16_t>(topic), stamp_ns, fill);
  }
  template <class Fill>
  bool put_on(std::uint16_t channel, std::int64_t stamp_ns, Fill&& fill) {
    for (;;) {
      const std::span<std::uint8_t> room = mcap_.begin_message();
      CdrWriter cdr(room);
      fill(cdr);
      if (!cdr.overflowed()) {
        commit(channel, stamp_ns, cdr.size());
        return true;
      }
      if (mcap_.messages_in_chunk() == 0) break;
      make_room();
    }
    ++counters_.messages_too_large;
    say(NoticeKind::too_large, "messages are larger than a chunk and are left out; so far",
        counters_.messages_too_large);
    return false;
  }

  void commit(std::uint16_t channel, std::int64_t stamp_ns, std::size_t size);
  void retry_later();
  void make_room();
  bool try_flush(bool gives_up);
  void advance(const Event& event);
  void put_frame(const Event& event);
  void put_bytes(const Event& event, bool is_sent);
  static void begin_diagnostic(CdrWriter& cdr, const DiagnosticRecord& diagnostic);
  void say(Severity severity, const char* text, std::int64_t value);
  /// Of a capacity that was exceeded, at its first and then ever more seldom.
  void say(NoticeKind kind, const char* text, std::uint64_t count);
  void say_not_indexed(std::uint64_t before);

  RecordingConfig config_;
  std::array<char, 24> utc_offset_text_{};
  std::array<mcap::KeyValue, 3> metadata_;
  mcap::Writer mcap_;
  NoticePort* notices_;
  std::optional<NoticeRateLimiter<NoticeKind>> capacity_notices_;  ///< not there when there is nobody to tell
  std::int64_t now_ns_ = 0;                                        ///< when the newest message was handed on
  bool has_now_ = false;
  std::int64_t retry_ns_ = 0;  ///< a stalled sink is asked again then
  bool is_stalled_ = false;
  std::uint64_t lost_before_stall_ = 0;
  Counters counters_;
};

}  // namespace alces
