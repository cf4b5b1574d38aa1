// An MCAP file, written front to back without a heap (https://mcap.dev/spec): magic, header, one metadata
// record, one attachment, all schemas and channels; then chunks, each with its message indexes; at the end
// data end, summary, footer. Every CRC that the format knows is there. Chunks are not compressed: a
// microcontroller could write them.
//
// The head (all before the first chunk) stands once more behind the first chunk, with a CRC of its own:
// without it no message could be read, and nothing else in the file says it before its end.
//
// A chunk goes to the sink in one piece or not at all, so that the file always ends behind a whole chunk.
// When the sink takes none (disk full) the chunk waits and is tried again; when it is full it is given up and
// counted, and the next one takes its place. Sequence numbers go on, so a reader sees what is missing.
//
// The summary indexes every chunk, however many there are. Its rows are kept in memory until they are
// chunk_capacity; then they go into the file, as a page: a record of the opcode 0x80, which MCAP leaves to
// applications and readers pass over. At the end the pages are read back, and the summary is made of them.
//
// Memory: chunk_bytes + 32 * messages_per_chunk + chunk_capacity * (36 + 2 * channels) + 8 * page_capacity,
// and the head's size. Time: O(bytes); one CRC, which is the chunk's and goes into the file's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "alces/arena.h"
#include "alces_platform/recording/byte_sink.h"
#include "alces_platform/recording/byte_writer.h"
#include "alces_platform/recording/crc32.h"

namespace alces::mcap {

struct Schema {  ///< its id is its place in the list, from 1
  std::string_view name;
  std::string_view definition;
};

struct Channel {  ///< its id is its place in the list, from 1
  std::string_view topic;
  std::uint16_t schema = 0;  ///< place in the list of schemas, from 0
};

struct KeyValue {
  std::string_view key;
  std::string_view value;
};

struct WriterConfig {
  std::size_t chunk_bytes = std::size_t{1} << 20;  ///< of records; a message must fit
  std::uint32_t messages_per_chunk = 8192;         ///< at most 65535
  std::uint32_t chunk_capacity = 4096;             ///< rows of the index that memory holds: a page of it
  /// When there are more pages, or they cannot be read back, the summary indexes nothing (a partial index
  /// would hide messages), and readers go through the file from the front.
  std::uint32_t page_capacity = 4096;

  std::string_view profile;
  std::string_view library;
  std::string_view schema_encoding;
  std::string_view message_encoding;
  std::span<const Schema> schemas;    ///< lists and texts outlive the writer
  std::span<const Channel> channels;  ///< fewer than 65535
  std::string_view metadata_name;
  std::span<const KeyValue> metadata;
  std::string_view attachment_name;  ///< empty: no attachment
  std::string_view attachment_media_type;
  std::string_view attachment;
  std::uint64_t attachment_time_ns = 0;
};

class Writer {
 public:
  /// The sink may be null while the arena counts. Nothing is written yet.
  Writer(Arena& arena, const WriterConfig& config, ByteSink* sink);

  /// Where the next message's data may be put; empty when the chunk has no room for one.
  [[nodiscard]] std::span<std::uint8_t> begin_message();
  /// It is there, `size` bytes of it. log_time_ns does not decrease.
  void commit_message(std::uint16_t channel, std::uint64_t log_time_ns, std::uint64_t publish_time_ns,
                      std::size_t size);

  [[nodiscard]] std::uint32_t messages_in_chunk() const { return entry_count_; }
  [[nodiscard]] std::size_t bytes_in_chunk() const { return used_bytes_; }
  [[nodiscard]] std::uint64_t chunk_begin_ns() const {
    return entry_count_ == 0 ? 0 : entries_[0].log_time_ns;
  }

  /// Writes the chunk. False: the sink did not take it; it stays, and may grow, to be tried again.
  [[nodiscard]] bool flush();
  /// Gives the chunk up, counted as lost.
  void discard();
  /// The last chunk, data end, summary, footer. False: the sink did not take all of it; what it holds is
  /// readable.
  [[nodiscard]] bool finish();

  struct Counters {
    std::uint64_t messages_written = 0;
    std::uint64_t messages_lost = 0;  ///< in chunks that were given up
    std::uint64_t chunks_written = 0;
    std::uint64_t chunks_lost = 0;
    std::uint64_t chunks_not_indexed = 0;  ///< more pages than page_capacity, or one that is not read back
    std::uint64_t bytes_written = 0;
    std::uint64_t bytes_lost = 0;
    std::uint64_t write_failures = 0;  ///< the sink said no

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("messages_written", messages_written);
      visit("messages_lost", messages_lost);
      visit("chunks_written", chunks_written);
      visit("chunks_lost", chunks_lost);
      visit("chunks_not_indexed", chunks_not_indexed);
      visit("bytes_written", bytes_written);
      visit("bytes_lost", bytes_lost);
      visit("write_failures", write_failures);
    }
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  struct Entry {
    std::uint64_t log_time_ns = 0;
    std::uint32_t offset = 0;  ///< of the message record in the chunk's records
    std::uint16_t channel = 0;
  };
  /// A chunk's row of the index: these, then its messages in each channel, 16 bits each.
  struct ChunkInfo {
    std::uint64_t offset = 0;
    std::uint64_t begin_ns = 0;
    std::uint64_t end_ns = 0;
    std::uint64_t records_bytes = 0;
    std::uint32_t index_bytes = 0;
  };
  struct Place {
    std::uint64_t offset = 0;
    std::uint64_t length = 0;
  };

  class Summary;

  void write_head(ByteWriter& out);
  void write_schemas(ByteWriter& out) const;
  void write_schema(ByteWriter& out, std::size_t schema) const;
  void write_channel(ByteWriter& out, std::size_t channel) const;
  void write_statistics(ByteWriter& out) const;
  static void write_chunk_index(ByteWriter& out, std::span<const std::uint8_t> row);
  [[nodiscard]] std::size_t row_bytes() const;
  [[nodiscard]] std::size_t page_bytes() const;
  void add_row(const ChunkInfo& info);
  [[nodiscard]] bool turn_page();
  [[nodiscard]] bool are_pages_there();
  [[nodiscard]] bool add_chunk_indexes(Summary& summary);
  [[nodiscard]] std::size_t append_message_indexes();
  [[nodiscard]] bool append(std::span<const std::uint8_t> bytes);
  [[nodiscard]] bool put(std::span<const std::uint8_t> bytes);
  [[nodiscard]] bool ensure_head();
  void append_head_copy();
  void start_chunk();

  WriterConfig config_;
  ByteSink* sink_;
  std::span<std::uint8_t> scratch_;  ///< the head; later the summary, piece by piece
  std::span<std::uint8_t> chunk_;    ///< record header, chunk header, records; then its message indexes
  std::span<Entry> entries_;         ///< of the messages in the chunk
  std::span<std::uint16_t> counts_;  ///< messages in the chunk, a channel
  std::span<std::size_t> cursors_;   ///< where a channel's next index entry goes
  std::span<std::uint32_t> sequences_;
  std::span<std::uint64_t> totals_;  ///< messages written, a channel
  std::span<std::uint8_t> page_;     ///< of the index, as it will stand in the file: record header, rows
  std::span<std::uint64_t> pages_;   ///< where those stand that were full

  std::size_t used_bytes_ = 0;  ///< of the chunk's records
  std::uint32_t entry_count_ = 0;
  std::uint32_t row_count_ = 0;   ///< of the page in memory
  std::uint32_t page_count_ = 0;  ///< of those in the file
  bool head_written_ = false;
  bool is_head_copied_ = false;
  bool finished_ = false;
  Place metadata_;
  Place attachment_;
  std::uint64_t begin_ns_ = 0;
  std::uint64_t end_ns_ = 0;
  Crc32 data_crc_;
  Counters counters_;
};

}  // namespace alces::mcap
