#include "alces_platform/recording/mcap_reader.h"

#include <algorithm>
#include <cstring>

#include "unpack_chunk.h"

namespace alces::mcap {
namespace {

constexpr std::size_t read_step_bytes = std::size_t{1} << 16;
constexpr std::size_t head_copy_within_bytes = std::size_t{4} << 20;  ///< behind the first chunk

/// The fixed part of a chunk with this compression; what comes before the records.
struct ChunkHeader {
  std::uint64_t uncompressed_bytes = 0;
  std::uint32_t crc = 0;
  std::string_view compression;
  std::uint64_t records_bytes = 0;
  std::size_t header_bytes = 0;
  bool is_there = false;
};

ChunkHeader parse_chunk_header(std::span<const std::uint8_t> content) {
  ByteReader in(content);
  ChunkHeader header;
  static_cast<void>(in.u64());  // times
  static_cast<void>(in.u64());
  header.uncompressed_bytes = in.u64();
  header.crc = in.u32();
  header.compression = in.string();
  header.records_bytes = in.u64();
  header.header_bytes = in.position();
  header.is_there = !in.failed();
  return header;
}

/// Its records end where it does, or (records may get new fields at their end) they at least have the right
/// CRC.
bool is_chunk_of_this_length(std::span<const std::uint8_t> content) {
  const ChunkHeader header = parse_chunk_header(content);
  if (!header.is_there || header.records_bytes > content.size() - header.header_bytes) return false;
  if (header.records_bytes == content.size() - header.header_bytes) return true;
  return header.crc != 0 && header.compression.empty() &&
         header.crc ==
             crc32(content.subspan(header.header_bytes, static_cast<std::size_t>(header.records_bytes)));
}

bool is_index_of_this_length(std::span<const std::uint8_t> content) {
  ByteReader in(content);
  static_cast<void>(in.u16());
  const std::uint32_t entries_bytes = in.u32();
  return !in.failed() && entries_bytes == in.left();
}

/// The whole of a copy's record, with the right CRC.
bool is_head_copy(std::span<const std::uint8_t> content) {
  ByteReader in(content);
  const std::uint32_t crc = in.u32();
  const std::span<const std::uint8_t> head = in.bytes(in.left());
  return head.size() >= magic.size() && std::equal(magic.begin(), magic.end(), head.begin()) &&
         crc == crc32(head);
}

bool is_known(std::uint8_t opcode) {
  return (opcode >= static_cast<std::uint8_t>(Opcode::header) &&
          opcode <= static_cast<std::uint8_t>(Opcode::data_end)) ||
         opcode == static_cast<std::uint8_t>(Opcode::index_page) ||
         opcode == static_cast<std::uint8_t>(Opcode::head_copy);
}

bool is_of_head(std::uint8_t opcode) {
  switch (static_cast<Opcode>(opcode)) {
    case Opcode::header:
    case Opcode::schema:
    case Opcode::channel:
    case Opcode::attachment:
    case Opcode::metadata:
      return true;
    default:
      return false;
  }
}

std::string quoted(std::string_view text) {
  std::string quoted(1, '\'');
  quoted += text.substr(0, 40);
  quoted += '\'';
  return quoted;
}

}  // namespace

/// Up to `size` bytes from the current position; fewer: the file ends there. The buffer grows as bytes
/// arrive, so an absurd length costs nothing.
Reader::Bytes Reader::peek(std::size_t size) {
  while (!source_ended_ && buffer_.size() - begin_ < size) {
    if (begin_ > 0 && begin_ == buffer_.size()) {
      buffer_.clear();
      begin_ = 0;
    } else if (begin_ > buffer_.size() / 2) {
      buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
      begin_ = 0;
    }
    const std::size_t filled = buffer_.size();
    const std::size_t missing = size - (filled - begin_);
    const std::size_t step = std::clamp(missing, read_step_bytes, std::size_t{1} << 22);
    buffer_.resize(filled + step);
    const std::size_t got = source_.read(std::span(buffer_).subspan(filled));
    buffer_.resize(filled + got);
    if (got < step) source_ended_ = true;
  }
  return Bytes(buffer_).subspan(begin_, std::min(size, buffer_.size() - begin_));
}

void Reader::consume(std::size_t size) {
  const Bytes bytes = Bytes(buffer_).subspan(begin_, size);
  Crc32& crc = in_data_ ? data_crc_ : summary_crc_;
  if (checked_.size > 0 && checked_.begin + checked_.size <= size) {
    crc.add(bytes.first(checked_.begin));
    crc.add_known(checked_.crc, checked_.size);
    crc.add(bytes.subspan(checked_.begin + checked_.size));
  } else {
    crc.add(bytes);
  }
  checked_ = {};
  begin_ += size;
  counters_.bytes += size;
}

void Reader::problem(std::uint64_t at, const std::string& what) {
  ++problem_count_;
  if (problems_.size() < most_problems) problems_.push_back("byte " + std::to_string(at) + ": " + what);
}

bool Reader::open() {
  const bool is_head_read = read_head_by_copy();
  const Bytes begin = is_head_read ? Bytes() : peek(magic.size());
  if (!is_head_read && !std::ranges::equal(begin, magic)) {
    const bool is_beginning = std::equal(begin.begin(), begin.end(), magic.begin());
    problem(0, is_beginning ? "the file ends within its first 8 bytes; nothing was recorded"
                            : "this is no MCAP file (its first bytes are others)");
    done_ = true;
    return false;
  }
  if (!is_head_read) consume(magic.size());
  while (chunk_.empty() && !loose_message_ && read_record()) {
  }
  return true;
}

bool Reader::read_head_by_copy() {
  for (std::size_t size = read_step_bytes; size <= head_copy_within_bytes; size *= 4) {
    const Bytes window = peek(size);  // in steps, so that a small file costs little
    if (read_head_by_copy(window)) return true;
    if (window.size() < size) break;
  }
  return false;
}

bool Reader::read_head_by_copy(Bytes window) {
  for (auto from = window.begin();;) {
    const auto found = std::search(from, window.end(), magic.begin(), magic.end());
    if (found == window.end()) return false;
    from = found + 1;
    const auto at = static_cast<std::size_t>(found - window.begin());
    if (at < head_copy_prefix_bytes) continue;
    const Bytes record = window.subspan(at - head_copy_prefix_bytes);
    const std::uint64_t length = ByteReader(record.subspan(1)).u64();
    if (record[0] != static_cast<std::uint8_t>(Opcode::head_copy) ||
        length > record.size() - record_header_bytes ||
        !is_head_copy(record.subspan(record_header_bytes, static_cast<std::size_t>(length))))
      continue;
    const Bytes head =
        record.subspan(head_copy_prefix_bytes, static_cast<std::size_t>(length) - sizeof(std::uint32_t));
    if (head.size() > at - head_copy_prefix_bytes) continue;
    ByteReader records(head.subspan(magic.size()));
    while (records.left() > 0 && !records.failed()) {
      const std::uint8_t opcode = records.u8();
      const Bytes content = records.bytes(records.u64());
      if (!records.failed() && is_of_head(opcode)) read_content(static_cast<Opcode>(opcode), content);
    }
    if (!std::ranges::equal(window.first(head.size()), head))
      problem(0, "the file's first bytes are damaged; what they say is read from their copy");
    consume(head.size());
    return true;
  }
}

bool Reader::next(ReadMessage& message) {
  for (;;) {
    if (loose_message_) {
      message = *loose_message_;
      loose_message_.reset();
      return true;
    }
    while (!chunk_.empty()) {
      if (read_in_chunk(message)) return true;
    }
    if (!read_record()) return false;
  }
}

bool Reader::read_record() {
  if (done_) return false;
  consume(pending_);
  pending_ = 0;
  chunk_is_cut_ = false;

  const Bytes header = peek(record_header_bytes);
  if (header.size() < record_header_bytes) return end_here(header, 0);
  ByteReader in(header);
  const std::uint8_t opcode = in.u8();
  const std::uint64_t length = in.u64();
  if (opcode == 0) return resynchronise("no record begins here");
  if (length > maximum_record_bytes) return resynchronise("a record of absurd length");

  const std::size_t whole = record_header_bytes + static_cast<std::size_t>(length);
  const Bytes record = peek(whole);
  if (record.size() < whole) return end_here(record, length);

  const Bytes content = record.subspan(record_header_bytes);
  // The long records say their length twice: one that differs must not swallow what comes after it.
  if (opcode == static_cast<std::uint8_t>(Opcode::chunk) && !is_chunk_of_this_length(content))
    return resynchronise("a chunk whose lengths do not fit");
  if (opcode == static_cast<std::uint8_t>(Opcode::message_index) && !is_index_of_this_length(content))
    return resynchronise("a message index whose lengths do not fit");
  if (opcode == static_cast<std::uint8_t>(Opcode::head_copy) && !is_head_copy(content))
    return resynchronise("a copy of the file's first bytes that is damaged");

  pending_ = whole;
  if (!is_known(opcode)) {
    ++counters_.records_unknown;
    return true;
  }
  read_content(static_cast<Opcode>(opcode), content);
  return !done_;
}

/// The file ends within a record: cut, unless the length is damaged and something that makes sense comes
/// later.
bool Reader::end_here(Bytes rest, std::uint64_t length) {
  const std::uint64_t from = position();
  if (rest.empty()) {
    problem(from, in_data_ ? "the recording was cut here, it has no end; what came before is whole"
                           : "the summary was cut here; no message is missing");
    done_ = true;
    return false;
  }
  if (rest.size() >= record_header_bytes && rest[0] == static_cast<std::uint8_t>(Opcode::chunk)) {
    const Bytes content = rest.subspan(record_header_bytes);
    const ChunkHeader chunk = parse_chunk_header(content);
    if (chunk.is_there && chunk.compression.empty() && chunk.header_bytes + chunk.records_bytes == length) {
      counters_.bytes_cut = rest.size();
      problem(from, "the recording was cut within a chunk; the whole messages of it are read, unverified");
      ++counters_.chunks;
      chunk_ = content.subspan(chunk.header_bytes);
      chunk_is_cut_ = true;
      done_ = true;
      return !chunk_.empty();
    }
  }
  if (find_chunk()) {
    ++counters_.records_corrupt;
    problem(from, "a record longer than the file; " + std::to_string(position() - from) +
                      " bytes are passed over, to the next chunk");
    return true;
  }
  counters_.bytes_skipped -= position() - from;
  counters_.bytes_cut = position() - from;
  problem(from, "the recording was cut within a record, of which " + std::to_string(counters_.bytes_cut) +
                    " bytes are there");
  done_ = true;
  return false;
}

/// The record at the current position makes no sense: on to the next chunk that does.
bool Reader::resynchronise(const char* what) {
  const std::uint64_t from = position();
  ++counters_.records_corrupt;
  const bool found = find_chunk();
  problem(from, std::string(what) + "; " + std::to_string(position() - from) +
                    " bytes are passed over, to the " + (found ? "next chunk" : "end"));
  done_ = !found;
  return found;
}

/// Passes over at least one byte, up to a chunk with the right CRC; without one, to the end.
bool Reader::find_chunk() {
  constexpr std::size_t least = record_header_bytes + plain_chunk_header_bytes;
  const auto pass_over = [this](std::size_t size) {
    consume(size);
    counters_.bytes_skipped += size;
  };
  std::size_t skip = 1;
  for (;;) {
    const Bytes ahead = peek(skip + read_step_bytes);
    if (ahead.size() < skip + least) break;
    const auto last = ahead.end() - static_cast<std::ptrdiff_t>(least) + 1;
    const auto candidate = std::find(ahead.begin() + static_cast<std::ptrdiff_t>(skip), last,
                                     static_cast<std::uint8_t>(Opcode::chunk));
    skip = static_cast<std::size_t>(candidate - ahead.begin());
    if (candidate == last) {
      pass_over(skip);
      skip = 0;
      continue;
    }
    if (looks_like_chunk(ahead.subspan(skip))) {
      const std::size_t whole =
          record_header_bytes + static_cast<std::size_t>(ByteReader(ahead.subspan(skip + 1)).u64());
      const Bytes chunk = peek(skip + whole);
      if (chunk.size() == skip + whole) {
        const Bytes content = chunk.subspan(skip + record_header_bytes);
        const ChunkHeader header = parse_chunk_header(content);
        const Bytes records = content.subspan(header.header_bytes);
        const bool is_packed = !header.compression.empty();
        if (is_packed && !unpack(header.compression, records, header.uncompressed_bytes, unpacked_)) {
          ++skip;
          continue;
        }
        if (header.crc == crc32(is_packed ? Bytes(unpacked_) : records)) {
          pass_over(skip);
          return true;
        }
      }
    }
    ++skip;
  }
  for (;;) {
    const std::size_t rest = peek(read_step_bytes).size();
    if (rest == 0) return false;
    pass_over(rest);
  }
}

bool Reader::looks_like_chunk(Bytes record_and_more) {
  const std::uint64_t length = ByteReader(record_and_more.subspan(1)).u64();
  const ChunkHeader header = parse_chunk_header(record_and_more.subspan(record_header_bytes));
  const bool is_plain = header.compression.empty() && header.records_bytes == header.uncompressed_bytes;
  return header.is_there && (is_plain || can_unpack(header.compression)) && length <= maximum_record_bytes &&
         header.crc != 0 && header.header_bytes + header.records_bytes == length;
}

void Reader::read_content(Opcode opcode, Bytes content) {
  switch (opcode) {
    case Opcode::header: {
      ByteReader in(content);
      profile_ = in.string();
      library_ = in.string();
      return;
    }
    case Opcode::schema:
      read_schema(content);
      return;
    case Opcode::channel:
      read_channel(content);
      return;
    case Opcode::message: {
      ReadMessage message;
      if (read_message(content, message)) loose_message_ = message;
      return;
    }
    case Opcode::chunk:
      read_chunk(content);
      return;
    case Opcode::attachment:
      read_attachment(content);
      return;
    case Opcode::metadata:
      read_metadata(content);
      return;
    case Opcode::data_end:
      read_data_end(content);
      return;
    case Opcode::footer:
      read_footer(content);
      return;
    case Opcode::statistics:
      statistics_messages_ = ByteReader(content).u64();
      return;
    case Opcode::index_page:
    case Opcode::message_index:
    case Opcode::chunk_index:
    case Opcode::attachment_index:
    case Opcode::metadata_index:
    case Opcode::summary_offset:
    case Opcode::head_copy:
      return;  // for those who jump; we walk
  }
}

void Reader::read_chunk(Bytes content) {
  ++counters_.chunks;
  const ChunkHeader header = parse_chunk_header(content);
  Bytes records = content.subspan(header.header_bytes, static_cast<std::size_t>(header.records_bytes));
  if (!header.compression.empty()) {
    ++counters_.chunks_compressed;
    if (!can_unpack(header.compression)) {
      problem(position(),
              "a chunk compressed with " + quoted(header.compression) +
                  ", which is not supported; its messages are missing ('mcap decompress' makes a file "
                  "that can be read)");
      return;
    }
    if (!unpack(header.compression, records, header.uncompressed_bytes, unpacked_)) {
      ++counters_.chunks_corrupt;
      problem(position(), "a chunk compressed with " + quoted(header.compression) +
                              " that is damaged; its messages are missing");
      return;
    }
    records = unpacked_;
  }
  const std::uint32_t crc = header.crc != 0 ? crc32(records) : 0;
  if (header.crc != 0 && header.compression.empty())
    checked_ = {record_header_bytes + header.header_bytes, records.size(), crc};
  if (header.crc != crc) {
    ++counters_.chunks_corrupt;
    problem(position(), "a chunk whose CRC is wrong; its messages are missing");
    return;
  }
  chunk_ = records;
  chunk_end_ =
      position() + record_header_bytes + header.header_bytes + static_cast<std::size_t>(header.records_bytes);
}

bool Reader::read_in_chunk(ReadMessage& message) {
  ByteReader in(chunk_);
  const std::uint8_t opcode = in.u8();
  const std::uint64_t length = in.u64();
  const Bytes content = in.bytes(length);
  if (in.failed() || opcode == 0) {
    if (!chunk_is_cut_) {
      ++counters_.chunks_corrupt;
      problem(chunk_end_ - std::min<std::uint64_t>(chunk_.size(), chunk_end_),
              "a record reaches over the end of its chunk; the rest of it is missing");
    }
    chunk_ = {};
    return false;
  }
  chunk_ = chunk_.subspan(in.position());
  switch (static_cast<Opcode>(opcode)) {
    case Opcode::schema:
      read_schema(content);
      return false;
    case Opcode::channel:
      read_channel(content);
      return false;
    case Opcode::message:
      return read_message(content, message);
    default:
      ++counters_.records_unknown;
      return false;
  }
}

bool Reader::read_message(Bytes content, ReadMessage& message) {
  ByteReader in(content);
  message.channel = in.u16();
  message.sequence = in.u32();
  message.log_time_ns = in.u64();
  message.publish_time_ns = in.u64();
  message.data = in.bytes(in.left());
  if (content.size() < message_header_bytes) {
    ++counters_.records_corrupt;
    problem(position(), "a message shorter than its header");
    return false;
  }
  if (!channels_.contains(message.channel)) {
    if (counters_.messages_without_channel++ == 0)
      problem(position(),
              "a message of channel " + std::to_string(message.channel) + ", which was not announced");
    return false;
  }
  ++counters_.messages;
  if (chunk_is_cut_) ++counters_.messages_unverified;
  return true;
}

void Reader::read_schema(Bytes content) {
  ByteReader in(content);
  const std::uint16_t id = in.u16();
  ReadSchema schema;
  schema.name = in.string();
  schema.encoding = in.string();
  schema.definition = in.string();
  if (in.failed() || id == 0) {
    ++counters_.records_corrupt;
    problem(position(), "a schema record that is too short");
    return;
  }
  schemas_.try_emplace(id, std::move(schema));
}

void Reader::read_channel(Bytes content) {
  ByteReader in(content);
  const std::uint16_t id = in.u16();
  const std::uint16_t schema = in.u16();
  ReadChannel channel;
  channel.topic = in.string();
  channel.message_encoding = in.string();
  if (in.failed()) {
    ++counters_.records_corrupt;
    problem(position(), "a channel record that is too short");
    return;
  }
  if (const auto found = schemas_.find(schema); found != schemas_.end()) channel.schema = found->second.name;
  channels_.try_emplace(id, std::move(channel));
}

void Reader::read_attachment(Bytes content) {
  ByteReader in(content);
  static_cast<void>(in.u64());
  static_cast<void>(in.u64());
  const std::string name(in.string());
  static_cast<void>(in.string());
  const Bytes data = in.bytes(in.u64());
  const std::size_t covered = in.position();
  const std::uint32_t crc = in.u32();
  if (in.failed() || (crc != 0 && crc != crc32(content.first(covered)))) {
    ++counters_.records_corrupt;
    problem(position(), "an attachment that is damaged; it is passed over");
    return;
  }
  attachments_[name] = std::string(reinterpret_cast<const char*>(data.data()), data.size());
}

void Reader::read_metadata(Bytes content) {
  ByteReader in(content);
  const std::string name(in.string());
  ByteReader entries(in.bytes(in.u32()));
  std::map<std::string, std::string> values;
  while (!entries.failed() && entries.left() > 0) {
    const std::string key(entries.string());
    values[key] = entries.string();
  }
  if (in.failed() || entries.failed()) {
    ++counters_.records_corrupt;
    problem(position(), "a metadata record that is too short");
    return;
  }
  metadata_[name] = std::move(values);
}

void Reader::read_data_end(Bytes content) {
  if (!in_data_) return;
  ByteReader in(content);
  const std::uint32_t crc = in.u32();
  // Where something was passed over, that was said already.
  if (crc != 0 && crc != data_crc_.value() && problem_count_ == 0)
    problem(position(), "the CRC over all data is wrong, that of each chunk is right; an index is damaged");
  consume(pending_);
  pending_ = 0;
  in_data_ = false;
  summary_start_ = position();
}

void Reader::read_footer(Bytes content) {
  if (content.size() > footer_bytes) {  // a chunk, say, whose opcode is damaged: the file goes on behind it
    ++counters_.records_corrupt;
    problem(position(), "a record that calls itself the footer, and is too long for one; passed over");
    return;
  }
  ByteReader in(content);
  const std::uint64_t summary_start = in.u64();
  const std::uint64_t offsets_start = in.u64();
  const std::uint32_t crc = in.u32();
  if (in.failed()) {
    ++counters_.records_corrupt;
    problem(position(), "a footer that is too short");
  } else if (in_data_) {
    problem(position(), "the footer comes without a data end; something is missing before it");
  } else if (summary_start != 0 && crc != 0) {
    Crc32 all = summary_crc_;
    all.add(Bytes(buffer_).subspan(begin_, record_header_bytes + footer_bytes - sizeof crc));
    if (summary_start != summary_start_ || offsets_start < summary_start || crc != all.value())
      problem(position(), "the summary's CRC is wrong; the messages are not touched by that");
  }
  // When chunks are missing, the count differs for a reason that was said already.
  if (statistics_messages_ && *statistics_messages_ != counters_.messages && problem_count_ == 0)
    problem(position(), "the summary counts " + std::to_string(*statistics_messages_) +
                            " messages, the file has " + std::to_string(counters_.messages));
  consume(pending_);
  pending_ = 0;
  if (!std::ranges::equal(peek(magic.size()), magic)) {
    problem(position(), "the file does not end as an MCAP file does");
  } else {
    consume(magic.size());
    if (const std::size_t rest = peek(1).size(); rest > 0)
      problem(position(), "something follows behind the file's end; it is not read");
  }
  ended_ = true;
  done_ = true;
}

}  // namespace alces::mcap
