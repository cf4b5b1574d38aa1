// MCAP files, front to back, whatever state they are in (https://mcap.dev/spec). Uses the heap.
//
// No summary is needed. A file that was cut is read to the last whole message before the cut, inside an
// unfinished chunk too. A chunk whose CRC is wrong is passed over and counted. Where a record makes no sense,
// reading goes on at the next thing that looks like a chunk and has the right CRC. Unknown records are passed
// over, lengths are believed only as far as there are bytes. Chunks that zstd or lz4 packed are unpacked;
// others are passed over and counted. This project packs none.
//
// Memory: the largest record, at most maximum_record_bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "alces_platform/recording/byte_source.h"
#include "alces_platform/recording/byte_writer.h"
#include "alces_platform/recording/crc32.h"
#include "alces_platform/recording/mcap_format.h"

namespace alces::mcap {

struct ReadSchema {
  std::string name;
  std::string encoding;
  std::string definition;
};

struct ReadChannel {
  std::string topic;
  std::string message_encoding;
  std::string schema;  ///< name; empty: none
};

struct ReadMessage {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::span<const std::uint8_t> data;  ///< valid until the next call
};

class Reader {
 public:
  static constexpr std::uint64_t maximum_record_bytes = std::uint64_t{256} << 20;
  static constexpr std::size_t most_problems = 20;

  explicit Reader(ByteSource& source) : source_(source) {}

  /// Reads the magic bytes and everything before the first message. False: this is no MCAP file; problems()
  /// says so.
  bool open();
  /// The next message, in the file's order. False: no more.
  bool next(ReadMessage& message);

  [[nodiscard]] const std::map<std::uint16_t, ReadChannel>& channels() const { return channels_; }
  [[nodiscard]] const std::map<std::uint16_t, ReadSchema>& schemas() const { return schemas_; }
  [[nodiscard]] const std::string& profile() const { return profile_; }
  [[nodiscard]] const std::string& library() const { return library_; }
  /// By name; those before the first message are there after open().
  [[nodiscard]] const std::map<std::string, std::map<std::string, std::string>>& metadata() const {
    return metadata_;
  }
  [[nodiscard]] const std::map<std::string, std::string>& attachments() const { return attachments_; }

  /// After the last message: data end, summary and footer were there, their CRCs right, and nothing was
  /// passed over.
  [[nodiscard]] bool is_whole() const { return ended_ && problem_count_ == 0; }
  /// Sentences that name the byte, the first most_problems of problem_count().
  [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }
  [[nodiscard]] std::uint64_t problem_count() const { return problem_count_; }

  struct Counters {
    std::uint64_t bytes = 0;
    std::uint64_t messages = 0;
    std::uint64_t messages_unverified = 0;  ///< from a chunk that was cut: no CRC vouches for them
    std::uint64_t messages_without_channel = 0;
    std::uint64_t chunks = 0;
    std::uint64_t chunks_corrupt = 0;     ///< CRC wrong or records that overlap: passed over
    std::uint64_t chunks_compressed = 0;  ///< passed over
    std::uint64_t records_unknown = 0;    ///< passed over
    std::uint64_t records_corrupt = 0;
    std::uint64_t bytes_skipped = 0;  ///< on the way to the next thing that makes sense
    std::uint64_t bytes_cut = 0;      ///< of the record that the file ends in

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("bytes", bytes);
      visit("messages", messages);
      visit("messages_unverified", messages_unverified);
      visit("messages_without_channel", messages_without_channel);
      visit("chunks", chunks);
      visit("chunks_corrupt", chunks_corrupt);
      visit("chunks_compressed", chunks_compressed);
      visit("records_unknown", records_unknown);
      visit("records_corrupt", records_corrupt);
      visit("bytes_skipped", bytes_skipped);
      visit("bytes_cut", bytes_cut);
    }
  };
  /// errno of a read that failed: what was read is not all that the file holds. 0: none did.
  [[nodiscard]] int read_error() const { return source_.error_number(); }
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  using Bytes = std::span<const std::uint8_t>;

  [[nodiscard]] Bytes peek(std::size_t size);
  void consume(std::size_t size);
  [[nodiscard]] std::uint64_t position() const { return counters_.bytes; }

  /// One record of the file itself. False: the end.
  bool read_record();
  bool end_here(Bytes rest, std::uint64_t length);
  bool resynchronise(const char* what);
  bool find_chunk();
  /// Reads the head by its copy, where that lies near the beginning and its CRC is right, and passes over the
  /// head itself. False: there is none.
  bool read_head_by_copy();
  bool read_head_by_copy(Bytes window);
  [[nodiscard]] static bool looks_like_chunk(Bytes record_and_more);
  void read_content(Opcode opcode, Bytes content);
  void read_chunk(Bytes content);
  /// One record of the current chunk. True: it is a message.
  bool read_in_chunk(ReadMessage& message);
  bool read_message(Bytes content, ReadMessage& message);
  void read_schema(Bytes content);
  void read_channel(Bytes content);
  void read_attachment(Bytes content);
  void read_metadata(Bytes content);
  void read_data_end(Bytes content);
  void read_footer(Bytes content);
  void problem(std::uint64_t at, const std::string& what);

  ByteSource& source_;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;    ///< of what is not consumed yet
  std::size_t pending_ = 0;  ///< bytes of the record just read, consumed when the next one is asked for
  /// Of these, `size` behind the first `begin`: their CRC, where a chunk's own was checked.
  struct Checked {
    std::size_t begin = 0;
    std::size_t size = 0;
    std::uint32_t crc = 0;
  };
  Checked checked_;
  bool source_ended_ = false;

  std::vector<std::uint8_t> unpacked_;  ///< of the current chunk, where it is compressed
  Bytes chunk_;                         ///< records of the current chunk that are still to be read
  std::uint64_t chunk_end_ = 0;         ///< position in the file behind them
  bool chunk_is_cut_ = false;
  std::optional<ReadMessage> loose_message_;  ///< one outside of chunks

  bool in_data_ = true;  ///< data end has not been there
  bool ended_ = false;
  bool done_ = false;
  Crc32 data_crc_;
  Crc32 summary_crc_;
  std::uint64_t summary_start_ = 0;
  std::optional<std::uint64_t> statistics_messages_;

  std::string profile_;
  std::string library_;
  std::map<std::uint16_t, ReadSchema> schemas_;
  std::map<std::uint16_t, ReadChannel> channels_;
  std::map<std::string, std::map<std::string, std::string>> metadata_;
  std::map<std::string, std::string> attachments_;
  std::vector<std::string> problems_;
  std::uint64_t problem_count_ = 0;
  Counters counters_;
};

}  // namespace alces::mcap
