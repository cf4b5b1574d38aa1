#include "alces_platform/recording/mcap_writer.h"

#include <algorithm>
#include <array>

#include "alces_platform/recording/mcap_format.h"

namespace alces::mcap {
namespace {

constexpr std::size_t chunk_prefix_bytes = record_header_bytes + plain_chunk_header_bytes;
constexpr std::size_t index_header_bytes = record_header_bytes + 2 + 4;
constexpr std::size_t index_entry_bytes = 8 + 8;
constexpr std::size_t row_begin_bytes = 8 + 8 + 8 + 8 + 4;

template <typename Fill>
void record(ByteWriter& out, Opcode opcode, Fill fill) {
  out.u8(static_cast<std::uint8_t>(opcode));
  const std::size_t length = out.position();
  out.u64(0);
  fill();
  out.patch(length, std::uint64_t{out.position() - length - 8});
}

/// An array or map: 32 bits that count its bytes.
template <typename Fill>
void sized(ByteWriter& out, Fill fill) {
  const std::size_t size = out.position();
  out.u32(0);
  fill();
  out.patch(size, static_cast<std::uint32_t>(out.position() - size - 4));
}

std::size_t index_bytes(std::size_t messages) {
  return messages == 0 ? 0 : index_header_bytes + messages * index_entry_bytes;
}

}  // namespace

Writer::Writer(Arena& arena, const WriterConfig& config, ByteSink* sink) : config_(config), sink_(sink) {
  ByteWriter dry({});
  write_head(dry);
  const std::size_t channels = config.channels.size();
  scratch_ =
      arena.allocate<std::uint8_t>(std::max<std::size_t>(head_copy_prefix_bytes + dry.position(), 16384));
  chunk_ =
      arena.allocate<std::uint8_t>(chunk_prefix_bytes + config.chunk_bytes + channels * index_header_bytes +
                                   std::size_t{config.messages_per_chunk} * index_entry_bytes);
  entries_ = arena.allocate<Entry>(config.messages_per_chunk);
  counts_ = arena.allocate<std::uint16_t>(channels);
  cursors_ = arena.allocate<std::size_t>(channels);
  sequences_ = arena.allocate<std::uint32_t>(channels);
  totals_ = arena.allocate<std::uint64_t>(channels);
  page_ = arena.allocate<std::uint8_t>(page_bytes());
  pages_ = arena.allocate<std::uint64_t>(config.page_capacity);
}

std::span<std::uint8_t> Writer::begin_message() {
  const std::size_t header = record_header_bytes + message_header_bytes;
  if (entry_count_ == entries_.size() || config_.chunk_bytes - used_bytes_ < header) return {};
  return chunk_.subspan(chunk_prefix_bytes + used_bytes_ + header,
                        config_.chunk_bytes - used_bytes_ - header);
}

void Writer::commit_message(std::uint16_t channel, std::uint64_t log_time_ns, std::uint64_t publish_time_ns,
                            std::size_t size) {
  ByteWriter out(
      chunk_.subspan(chunk_prefix_bytes + used_bytes_, record_header_bytes + message_header_bytes));
  out.u8(static_cast<std::uint8_t>(Opcode::message));
  out.u64(message_header_bytes + size);
  out.u16(static_cast<std::uint16_t>(channel + 1));
  out.u32(sequences_[channel]++);
  out.u64(log_time_ns);
  out.u64(publish_time_ns);
  entries_[entry_count_++] = {log_time_ns, static_cast<std::uint32_t>(used_bytes_), channel};
  ++counts_[channel];
  used_bytes_ += record_header_bytes + message_header_bytes + size;
}

bool Writer::flush() {
  if (entry_count_ == 0) return true;
  if (!ensure_head() || !turn_page()) return false;

  ByteWriter prefix(chunk_.first(chunk_prefix_bytes));
  const std::uint64_t begin_ns = entries_[0].log_time_ns;
  const std::uint64_t end_ns = entries_[entry_count_ - 1].log_time_ns;
  prefix.u8(static_cast<std::uint8_t>(Opcode::chunk));
  prefix.u64(plain_chunk_header_bytes + used_bytes_);
  prefix.u64(begin_ns);
  prefix.u64(end_ns);
  prefix.u64(used_bytes_);
  const std::uint32_t records_crc = crc32(chunk_.subspan(chunk_prefix_bytes, used_bytes_));
  prefix.u32(records_crc);
  prefix.string("");
  prefix.u64(used_bytes_);
  const std::size_t indexes_bytes = append_message_indexes();

  const std::uint64_t offset = counters_.bytes_written;
  if (!put(chunk_.first(chunk_prefix_bytes + used_bytes_ + indexes_bytes))) return false;
  data_crc_.add(prefix.written());
  data_crc_.add_known(records_crc, used_bytes_);
  data_crc_.add(chunk_.subspan(chunk_prefix_bytes + used_bytes_, indexes_bytes));

  add_row({offset, begin_ns, end_ns, used_bytes_, static_cast<std::uint32_t>(indexes_bytes)});
  if (counters_.chunks_written == 0) begin_ns_ = begin_ns;
  end_ns_ = end_ns;
  ++counters_.chunks_written;
  counters_.messages_written += entry_count_;
  for (std::size_t channel = 0; channel < counts_.size(); ++channel) totals_[channel] += counts_[channel];
  start_chunk();
  append_head_copy();
  return true;
}

void Writer::discard() {
  if (entry_count_ == 0) return;
  ++counters_.chunks_lost;
  counters_.messages_lost += entry_count_;
  counters_.bytes_lost += used_bytes_;
  start_chunk();
}

void Writer::start_chunk() {
  used_bytes_ = 0;
  entry_count_ = 0;
  std::ranges::fill(counts_, std::uint16_t{0});
}

std::size_t Writer::row_bytes() const {
  return row_begin_bytes + 2 * config_.channels.size();
}

std::size_t Writer::page_bytes() const {
  return record_header_bytes + config_.chunk_capacity * row_bytes();
}

void Writer::add_row(const ChunkInfo& info) {
  if (row_count_ == config_.chunk_capacity) {
    ++counters_.chunks_not_indexed;
    return;
  }
  ByteWriter row(page_.subspan(record_header_bytes + row_count_ * row_bytes(), row_bytes()));
  row.u64(info.offset);
  row.u64(info.begin_ns);
  row.u64(info.end_ns);
  row.u64(info.records_bytes);
  row.u32(info.index_bytes);
  for (const std::uint16_t count : counts_) row.u16(count);
  ++row_count_;
}

/// A full page goes to the file, as long as its place can be remembered. False: the sink did not take it.
bool Writer::turn_page() {
  if (row_count_ < config_.chunk_capacity || page_count_ == pages_.size()) return true;
  ByteWriter header(page_);
  header.u8(static_cast<std::uint8_t>(Opcode::index_page));
  header.u64(page_bytes() - record_header_bytes);
  const std::uint64_t offset = counters_.bytes_written;
  if (!append(page_)) return false;
  pages_[page_count_++] = offset;
  row_count_ = 0;
  return true;
}

/// Behind the records, a record for each channel that has messages in the chunk. Returns their bytes.
std::size_t Writer::append_message_indexes() {
  const std::span<std::uint8_t> room = chunk_.subspan(chunk_prefix_bytes + used_bytes_);
  std::size_t at = 0;
  for (std::size_t channel = 0; channel < counts_.size(); ++channel) {
    if (counts_[channel] == 0) continue;
    const std::size_t entries = counts_[channel] * index_entry_bytes;
    ByteWriter out(room.subspan(at, index_header_bytes));
    out.u8(static_cast<std::uint8_t>(Opcode::message_index));
    out.u64(2 + 4 + entries);
    out.u16(static_cast<std::uint16_t>(channel + 1));
    out.u32(static_cast<std::uint32_t>(entries));
    cursors_[channel] = at + index_header_bytes;
    at += index_header_bytes + entries;
  }
  for (const Entry& entry : entries_.first(entry_count_)) {
    ByteWriter out(room.subspan(cursors_[entry.channel], index_entry_bytes));
    out.u64(entry.log_time_ns);
    out.u64(entry.offset);
    cursors_[entry.channel] += index_entry_bytes;
  }
  return at;
}

bool Writer::append(std::span<const std::uint8_t> bytes) {
  if (!put(bytes)) return false;
  data_crc_.add(bytes);
  return true;
}

/// Without its share of the file's CRC.
bool Writer::put(std::span<const std::uint8_t> bytes) {
  if (!sink_->write(bytes)) {
    ++counters_.write_failures;
    return false;
  }
  counters_.bytes_written += bytes.size();
  return true;
}

bool Writer::ensure_head() {
  if (head_written_) return true;
  ByteWriter head(scratch_);
  write_head(head);
  head_written_ = append(head.written());
  return head_written_;
}

/// A sink that does not take it is asked again behind the next chunk.
void Writer::append_head_copy() {
  if (is_head_copied_) return;
  const Place metadata = metadata_;  // the summary's indexes lead to the first ones
  const Place attachment = attachment_;
  ByteWriter head(scratch_.subspan(head_copy_prefix_bytes));
  write_head(head);
  metadata_ = metadata;
  attachment_ = attachment;
  ByteWriter prefix(scratch_);
  prefix.u8(static_cast<std::uint8_t>(Opcode::head_copy));
  prefix.u64(sizeof(std::uint32_t) + head.position());
  prefix.u32(crc32(head.written()));
  is_head_copied_ = append(scratch_.first(head_copy_prefix_bytes + head.position()));
}

void Writer::write_head(ByteWriter& out) {
  out.bytes(magic);
  record(out, Opcode::header, [&] {
    out.string(config_.profile);
    out.string(config_.library);
  });
  metadata_.offset = out.position();
  record(out, Opcode::metadata, [&] {
    out.string(config_.metadata_name);
    sized(out, [&] {
      for (const KeyValue& entry : config_.metadata) {
        out.string(entry.key);
        out.string(entry.value);
      }
    });
  });
  metadata_.length = out.position() - metadata_.offset;
  if (!config_.attachment_name.empty()) {
    attachment_.offset = out.position();
    record(out, Opcode::attachment, [&] {
      const std::size_t begin = out.position();
      out.u64(config_.attachment_time_ns);
      out.u64(0);  // when it was made is not known
      out.string(config_.attachment_name);
      out.string(config_.attachment_media_type);
      out.u64(config_.attachment.size());
      out.raw(config_.attachment.data(), config_.attachment.size());
      const std::span<const std::uint8_t> so_far = out.written();
      out.u32(so_far.empty() ? 0 : crc32(so_far.subspan(begin)));
    });
    attachment_.length = out.position() - attachment_.offset;
  }
  write_schemas(out);
  for (std::size_t channel = 0; channel < config_.channels.size(); ++channel) write_channel(out, channel);
}

void Writer::write_schemas(ByteWriter& out) const {
  for (std::size_t schema = 0; schema < config_.schemas.size(); ++schema) write_schema(out, schema);
}

void Writer::write_schema(ByteWriter& out, std::size_t schema) const {
  record(out, Opcode::schema, [&] {
    out.u16(static_cast<std::uint16_t>(schema + 1));
    out.string(config_.schemas[schema].name);
    out.string(config_.schema_encoding);
    out.string(config_.schemas[schema].definition);
  });
}

void Writer::write_channel(ByteWriter& out, std::size_t channel) const {
  record(out, Opcode::channel, [&] {
    out.u16(static_cast<std::uint16_t>(channel + 1));
    out.u16(static_cast<std::uint16_t>(config_.channels[channel].schema + 1));
    out.string(config_.channels[channel].topic);
    out.string(config_.message_encoding);
    sized(out, [&] {
      out.string("offered_qos_profiles");  // the ros2 profile asks for it; empty: the player's default
      out.string("");
    });
  });
}

void Writer::write_statistics(ByteWriter& out) const {
  record(out, Opcode::statistics, [&] {
    out.u64(counters_.messages_written);
    out.u16(static_cast<std::uint16_t>(config_.schemas.size()));
    out.u32(static_cast<std::uint32_t>(config_.channels.size()));
    out.u32(config_.attachment_name.empty() ? 0 : 1);
    out.u32(1);  // metadata
    out.u32(static_cast<std::uint32_t>(counters_.chunks_written));
    out.u64(begin_ns_);
    out.u64(end_ns_);
    sized(out, [&] {
      for (std::size_t channel = 0; channel < totals_.size(); ++channel) {
        out.u16(static_cast<std::uint16_t>(channel + 1));
        out.u64(totals_[channel]);
      }
    });
  });
}

void Writer::write_chunk_index(ByteWriter& out, std::span<const std::uint8_t> row) {
  ByteReader in(row);
  ChunkInfo info;
  info.offset = in.u64();
  info.begin_ns = in.u64();
  info.end_ns = in.u64();
  info.records_bytes = in.u64();
  info.index_bytes = in.u32();
  record(out, Opcode::chunk_index, [&] {
    const std::uint64_t chunk_length = chunk_prefix_bytes + info.records_bytes;
    out.u64(info.begin_ns);
    out.u64(info.end_ns);
    out.u64(info.offset);
    out.u64(chunk_length);
    sized(out, [&] {
      std::uint64_t at = info.offset + chunk_length;
      for (std::uint16_t channel = 1; in.left() > 0; ++channel) {
        const std::uint16_t count = in.u16();
        if (count == 0) continue;
        out.u16(channel);
        out.u64(at);
        at += index_bytes(count);
      }
    });
    out.u64(info.index_bytes);
    out.string("");
    out.u64(info.records_bytes);
    out.u64(info.records_bytes);
  });
}

/// The records behind the data section: through the scratch buffer, with their CRC, in groups of one opcode.
class Writer::Summary {
 public:
  explicit Summary(Writer& writer) : writer_(writer), start_(writer.counters_.bytes_written) {}

  /// `write(out)` appends one record.
  template <typename Write>
  void add(Opcode opcode, Write write) {
    ByteWriter out(writer_.scratch_.subspan(used_bytes_));
    write(out);
    if (out.overflowed()) {
      spill();
      out = ByteWriter(writer_.scratch_);
      write(out);
    }
    if (group_count_ == 0 || groups_[group_count_ - 1].opcode != opcode)
      groups_[group_count_++] = {opcode, position(), 0};
    groups_[group_count_ - 1].length += out.position();
    used_bytes_ += out.position();
  }

  [[nodiscard]] bool finish() {
    const std::uint64_t offsets_start = position();
    const std::size_t group_count = group_count_;
    for (std::size_t group = 0; group < group_count; ++group) {
      add(Opcode::summary_offset, [&](ByteWriter& out) {
        record(out, Opcode::summary_offset, [&] {
          out.u8(static_cast<std::uint8_t>(groups_[group].opcode));
          out.u64(groups_[group].offset);
          out.u64(groups_[group].length);
        });
      });
    }
    spill();
    ByteWriter footer(writer_.scratch_);
    footer.u8(static_cast<std::uint8_t>(Opcode::footer));
    footer.u64(footer_bytes);
    footer.u64(start_);
    footer.u64(offsets_start);
    crc_.add(footer.written());
    footer.u32(crc_.value());
    footer.bytes(magic);
    return ok_ && writer_.append(footer.written());
  }

 private:
  struct Group {
    Opcode opcode{};
    std::uint64_t offset = 0;
    std::uint64_t length = 0;
  };

  [[nodiscard]] std::uint64_t position() const { return spilled_bytes_ + start_ + used_bytes_; }

  void spill() {
    const std::span<const std::uint8_t> bytes = writer_.scratch_.first(used_bytes_);
    crc_.add(bytes);
    if (ok_ && !bytes.empty()) ok_ = writer_.append(bytes);
    spilled_bytes_ += used_bytes_;
    used_bytes_ = 0;
  }

  Writer& writer_;
  std::uint64_t start_;
  std::uint64_t spilled_bytes_ = 0;
  std::size_t used_bytes_ = 0;
  std::array<Group, 8> groups_{};
  std::size_t group_count_ = 0;
  Crc32 crc_;
  bool ok_ = true;
};

/// Before the summary begins: half an index could not be taken back.
bool Writer::are_pages_there() {
  for (const std::uint64_t page : pages_.first(page_count_)) {
    std::array<std::uint8_t, record_header_bytes> header{};
    if (!sink_->read_back(page, header)) return false;
    ByteReader in(header);
    if (in.u8() != static_cast<std::uint8_t>(Opcode::index_page) ||
        in.u64() != page_bytes() - record_header_bytes)
      return false;
  }
  return true;
}

/// False: a page that was there cannot be read any more.
bool Writer::add_chunk_indexes(Summary& summary) {
  const auto add = [&](std::span<const std::uint8_t> rows) {
    for (; !rows.empty(); rows = rows.subspan(row_bytes()))
      summary.add(Opcode::chunk_index,
                  [&](ByteWriter& out) { write_chunk_index(out, rows.first(row_bytes())); });
  };
  const std::size_t room = chunk_.size() / row_bytes() * row_bytes();  // no chunk is in it any more
  for (const std::uint64_t page : pages_.first(page_count_)) {
    const std::size_t rows_bytes = page_bytes() - record_header_bytes;
    for (std::size_t at = 0; at < rows_bytes; at += room) {
      const std::span<std::uint8_t> rows = chunk_.first(std::min(room, rows_bytes - at));
      if (!sink_->read_back(page + record_header_bytes + at, rows)) return false;
      add(rows);
    }
  }
  add(page_.subspan(record_header_bytes, row_count_ * row_bytes()));
  return true;
}

bool Writer::finish() {
  if (finished_) return true;
  if (!flush()) {
    discard();
    return false;
  }
  if (!ensure_head()) return false;

  ByteWriter data_end(scratch_);
  record(data_end, Opcode::data_end, [&] { data_end.u32(data_crc_.value()); });
  if (!append(data_end.written())) return false;

  Summary summary(*this);
  for (std::size_t schema = 0; schema < config_.schemas.size(); ++schema)
    summary.add(Opcode::schema, [&](ByteWriter& out) { write_schema(out, schema); });
  for (std::size_t channel = 0; channel < config_.channels.size(); ++channel)
    summary.add(Opcode::channel, [&](ByteWriter& out) { write_channel(out, channel); });
  summary.add(Opcode::statistics, [&](ByteWriter& out) { write_statistics(out); });
  if (counters_.chunks_not_indexed == 0 && !are_pages_there())
    counters_.chunks_not_indexed = counters_.chunks_written;
  if (counters_.chunks_not_indexed == 0 && !add_chunk_indexes(summary)) return false;
  if (!config_.attachment_name.empty()) {
    summary.add(Opcode::attachment_index, [&](ByteWriter& out) {
      record(out, Opcode::attachment_index, [&] {
        out.u64(attachment_.offset);
        out.u64(attachment_.length);
        out.u64(config_.attachment_time_ns);
        out.u64(0);
        out.u64(config_.attachment.size());
        out.string(config_.attachment_name);
        out.string(config_.attachment_media_type);
      });
    });
  }
  summary.add(Opcode::metadata_index, [&](ByteWriter& out) {
    record(out, Opcode::metadata_index, [&] {
      out.u64(metadata_.offset);
      out.u64(metadata_.length);
      out.string(config_.metadata_name);
    });
  });
  finished_ = summary.finish();
  return finished_;
}

}  // namespace alces::mcap
