// Files in every state: cut anywhere, damaged anywhere, absurd, foreign.
#if __has_include(<lz4frame.h>) && __has_include(<zstd.h>)
#include <lz4frame.h>
#include <zstd.h>
#define ALCES_CAN_PACK
#endif

#include <algorithm>
#include <catch2/catch.hpp>
#include <cerrno>
#include <cstring>

#include "recording_bench.h"

namespace alces {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint32_t event_count = 300;

/// Every event read was recorded, and they are in order. Returns false when one is not.
bool are_recorded_in_order(const ReadBack& read) {
  std::uint32_t i = 0;
  for (const sample::OwnedEvent& owned : read.events) {
    while (i < event_count && !sample::same(owned.event, sample::event_at(i).event)) ++i;
    if (i == event_count) return false;
    ++i;
  }
  return true;
}

std::size_t record_length(const Bytes& bytes, std::size_t at) {
  std::uint64_t length = 0;
  std::memcpy(&length, bytes.data() + at + 1, sizeof length);
  return 9 + static_cast<std::size_t>(length);
}

/// Where the records of the file begin.
std::vector<std::size_t> records(const Bytes& bytes, std::uint8_t opcode) {
  std::vector<std::size_t> found;
  for (std::size_t at = 8; at + 9 < bytes.size(); at += record_length(bytes, at)) {
    if (bytes[at] == opcode) found.push_back(at);
  }
  return found;
}

TEST_CASE("cut at any byte, a recording gives its events up to the cut") {
  const Bytes whole = sample_recording(120);
  const std::vector<std::size_t> chunks = records(whole, 6);
  REQUIRE(chunks.size() > 2);
  std::size_t events_before = 0;
  std::size_t wrong = 0;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const ReadBack read = read_back(std::span(whole).first(size));
    const bool is_prefix =
        read.events.size() >= events_before && read.counters.messages_missing == 0 &&
        (read.events.empty() ||
         sample::same(read.events.back().event,
                      sample::event_at(static_cast<std::uint32_t>(read.events.size() - 1)).event));
    if (!is_prefix || read.is_whole || read.problems.empty() || read.opened != (size >= 8)) ++wrong;
    events_before = read.events.size();
  }
  CHECK(wrong == 0);
  CHECK(events_before == 120);
}

TEST_CASE("cut inside a chunk, its whole messages are read and called unverified") {
  const Bytes whole = sample_recording(event_count);
  const std::size_t chunk = records(whole, 6)[2];
  const std::size_t cut = chunk + record_length(whole, chunk) / 2;
  const ReadBack read = read_back(std::span(whole).first(cut));
  CHECK(read.file.messages_unverified > 5);
  REQUIRE(read.problems.size() == 1);
  CHECK_THAT(read.problems[0],
             Catch::StartsWith("byte " + std::to_string(chunk) + ": ") && Catch::Contains("cut"));
}

TEST_CASE("with any byte damaged nothing is read that was not recorded, and the damage is said") {
  const Bytes whole = sample_recording(event_count);
  const std::size_t first_chunk = records(whole, 6)[0];
  std::size_t unnoticed = 0;
  std::size_t false_events = 0;
  std::size_t fewest = event_count;
  for (std::size_t at = first_chunk; at < whole.size(); at += 7) {
    Bytes damaged = whole;
    damaged[at] ^= static_cast<std::uint8_t>(1U << (at % 8));
    const ReadBack read = read_back(damaged);
    if (read.is_whole) ++unnoticed;
    if (!are_recorded_in_order(read)) ++false_events;
    fewest = std::min(fewest, read.events.size());
  }
  CHECK(unnoticed == 0);
  CHECK(false_events == 0);
  CHECK(fewest > event_count / 2);  // one chunk at most, of several
}

/// As it was read from the whole recording, but for the damage that is said.
bool is_all_there(const ReadBack& read, std::uint32_t events) {
  if (!read.opened || read.is_whole || read.events.size() != events) return false;
  for (std::uint32_t i = 0; i < events; ++i)
    if (!sample::same(read.events[i].event, sample::event_at(i).event)) return false;
  return true;
}

TEST_CASE("with any byte of the head damaged, its copy behind the first chunk says what it said") {
  const Bytes whole = sample_recording(40);
  const std::string configuration = read_back(whole).configuration;
  REQUIRE_FALSE(configuration.empty());
  const std::size_t first_chunk = records(whole, 6)[0];
  std::size_t lost = 0;
  for (std::size_t at = 0; at < first_chunk; at += 11) {
    Bytes damaged = whole;
    damaged[at] ^= 0x41;
    const ReadBack read = read_back(damaged);
    if (!is_all_there(read, 40) || read.configuration != configuration) ++lost;
  }
  CHECK(lost == 0);
}

TEST_CASE("a recording whose whole head is gone is read by its copy") {
  const Bytes whole = sample_recording(event_count);
  const std::size_t first_chunk = records(whole, 6)[0];
  Bytes damaged = whole;
  std::fill_n(damaged.begin(), first_chunk, std::uint8_t{0});
  const ReadBack read = read_back(damaged);
  CHECK(is_all_there(read, event_count));
  CHECK(read.configuration == read_back(whole).configuration);
  REQUIRE_FALSE(read.problems.empty());
  CHECK_THAT(read.problems[0], Catch::Contains("what they say is read from their copy"));

  SECTION("without its first chunk, too, it is read from the second on") {
    std::fill_n(damaged.begin(), records(whole, 0x81)[0], std::uint8_t{0});
    const ReadBack rest = read_back(damaged);
    CHECK(rest.events.size() > event_count / 2);
    CHECK(are_recorded_in_order(rest));
  }
  SECTION("where the copy is damaged instead, the head is what counts") {
    Bytes other = whole;
    other[records(whole, 0x81)[0] + 100] ^= 1;
    CHECK(is_all_there(read_back(other), event_count));
  }
}

TEST_CASE("a copy of the head that cannot be is passed over, and the head counts") {
  const Bytes whole = sample_recording(40);
  const std::size_t copy = records(whole, 0x81)[0];
  for (const std::size_t length : {0UL, 3UL, 12UL, std::size_t{1} << 40}) {
    Bytes damaged = whole;
    const std::uint64_t written = length;
    std::memcpy(damaged.data() + copy + 1, &written, sizeof written);
    CHECK(read_back(damaged).configuration == read_back(whole).configuration);
  }
}

TEST_CASE("a chunk with a wrong CRC is passed over, counted and told with its byte") {
  Bytes bytes = sample_recording(event_count);
  const std::size_t chunk = records(bytes, 6)[1];
  bytes[chunk + 200] ^= 1;
  const ReadBack read = read_back(bytes);
  CHECK(read.file.chunks_corrupt == 1);
  CHECK(read.counters.messages_missing > 10);
  CHECK(read.events.size() < event_count);
  CHECK(sample::same(read.events.back().event, sample::event_at(event_count - 1).event));
  REQUIRE(read.problems.size() == 1);
  CHECK_THAT(read.problems[0],
             Catch::StartsWith("byte " + std::to_string(chunk) + ": a chunk whose CRC is wrong"));
}

TEST_CASE("after a damaged length, reading goes on at the next chunk") {
  Bytes bytes = sample_recording(event_count);
  const std::vector<std::size_t> chunks = records(bytes, 6);
  SECTION("absurdly large") {
    bytes[chunks[1] + 8] = 0x7f;
  }
  SECTION("larger than the file") {
    bytes[chunks[1] + 3] = 0x10;
  }
  SECTION("a hole of zeros, as a power loss may leave") {
    std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(chunks[1]),
              bytes.begin() + static_cast<std::ptrdiff_t>(chunks[1] + 300), std::uint8_t{0});
  }
  const ReadBack read = read_back(bytes);
  CHECK_FALSE(read.is_whole);
  CHECK(read.file.records_corrupt == 1);
  CHECK(read.file.bytes_skipped >= record_length(bytes, chunks[2]) / 2);
  CHECK(read.events.size() > event_count / 2);
  CHECK(are_recorded_in_order(read));
  CHECK(sample::same(read.events.back().event, sample::event_at(event_count - 1).event));
}

TEST_CASE("a file that ends in zeros is read up to them") {
  const Bytes whole = sample_recording(event_count);
  const std::size_t chunk = records(whole, 6)[3];
  Bytes bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(chunk));
  const std::size_t events = read_back(bytes).events.size();
  bytes.resize(bytes.size() + 100'000);
  const ReadBack read = read_back(bytes);
  CHECK(read.events.size() == events);
  CHECK(events > 10);
  CHECK(read.file.bytes_skipped == 100'000);
  CHECK_FALSE(read.is_whole);
}

TEST_CASE("unknown records are passed over") {
  const Bytes whole = sample_recording(event_count);
  const std::size_t chunk = records(whole, 6)[1];
  for (const int opcode : {0x10, 0x7f, 0x90, 0xff}) {
    Bytes bytes = whole;
    const Bytes unknown = {static_cast<std::uint8_t>(opcode), 3, 0, 0, 0, 0, 0, 0, 0, 'a', 'b', 'c'};
    bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(chunk), unknown.begin(), unknown.end());
    const ReadBack read = read_back(bytes);
    CHECK(read.events.size() == event_count);
    CHECK(read.file.records_unknown == 1);
  }
}

TEST_CASE("what is no recording is refused in a sentence") {
  for (const std::string text : {"", "MCAP", "not a recording at all", "\x89MCAP1\r\n"}) {
    const ReadBack read =
        read_back(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
    CHECK_FALSE(read.opened);
    CHECK_FALSE(read.is_whole);
    CHECK(read.events.empty());
    CHECK(read.problems.size() == 1);
  }
}

/// A container around hand-made records.
class HandMade {
 public:
  HandMade() {
    bytes_.assign(mcap::magic.begin(), mcap::magic.end());
    record(1, [](ByteWriter& out) {
      out.string("ros2");
      out.string("by hand");
    });
  }
  template <typename Fill>
  HandMade& record(std::uint8_t opcode, Fill fill) {
    Bytes content(1 << 16);
    ByteWriter out(content);
    fill(out);
    bytes_.push_back(opcode);
    const std::uint64_t length = out.position();
    const auto* raw = reinterpret_cast<const std::uint8_t*>(&length);
    bytes_.insert(bytes_.end(), raw, raw + 8);
    bytes_.insert(bytes_.end(), content.begin(), content.begin() + static_cast<std::ptrdiff_t>(length));
    return *this;
  }
  HandMade& tick_channel(std::string_view schema = "alces_msgs/msg/Tick") {
    record(3, [&](ByteWriter& out) {
      out.u16(1);
      out.string(schema);
      out.string("ros2msg");
      out.string("");
    });
    return record(4, [](ByteWriter& out) {
      out.u16(5);
      out.u16(1);
      out.string("/alces/tick");
      out.string("cdr");
      out.u32(0);
    });
  }
  HandMade& message(std::uint16_t channel, std::uint64_t stamp_ns, const Bytes& data) {
    return record(5, [&](ByteWriter& out) {
      out.u16(channel);
      out.u32(sequence_++);
      out.u64(stamp_ns);
      out.u64(stamp_ns);
      out.bytes(data);
    });
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
  std::uint32_t sequence_ = 0;
};

const Bytes tick_data = {0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0};

TEST_CASE("messages outside of chunks are read") {
  HandMade file;
  file.tick_channel().message(5, 77, tick_data).message(5, 78, tick_data);
  const ReadBack read = read_back(file.bytes());
  REQUIRE(read.events.size() == 2);
  CHECK(read.events[1].event.stamp_ns == 78);
}

TEST_CASE("a classical CAN frame that says it has more than eight bytes is malformed") {
  const auto channels = recording::channels(1);
  const auto& can = channels[static_cast<std::size_t>(recording::Topic::can_rx)];
  HandMade file;
  file.record(3, [&](ByteWriter& out) {
    out.u16(1);
    out.string(recording::schemas()[can.schema].name);
    out.string("ros2msg");
    out.string("");
  });
  file.record(4, [&](ByteWriter& out) {
    out.u16(5);
    out.u16(1);
    out.string(can.topic);
    out.string("cdr");
    out.u32(0);
  });
  for (const std::uint8_t size : {std::uint8_t{8}, std::uint8_t{9}, std::uint8_t{64}, std::uint8_t{255}}) {
    Bytes room(200);
    CdrWriter cdr(room);
    cdr.header(77, "");
    cdr.number(std::uint32_t{0x181});
    cdr.boolean(false);
    cdr.boolean(false);
    cdr.boolean(false);
    cdr.number(size);
    const std::array<std::uint8_t, 8> data{1, 2, 3, 4, 5, 6, 7, 8};
    cdr.byte_array(data);
    room.resize(cdr.size());
    file.message(5, 77, room);
  }
  const ReadBack read = read_back(file.bytes());
  REQUIRE(read.events.size() == 1);
  CHECK(read.events[0].event.frame.size == 8);
  CHECK(read.events[0].event.frame.data[7] == 8);
  CHECK(read.counters.messages_malformed == 3);
}

TEST_CASE("a message too short for its type, or in another encapsulation, is counted as malformed") {
  HandMade file;
  file.tick_channel();
  file.message(5, 1, {})
      .message(5, 2, {0, 1, 0, 0, 1, 0, 0})
      .message(5, 3, {0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0});
  file.message(5, 4, tick_data);
  const ReadBack read = read_back(file.bytes());
  CHECK(read.events.size() == 1);
  CHECK(read.counters.messages_malformed == 3);
}

TEST_CASE(
    "messages of channels that were not announced are counted, those of foreign types are passed on as "
    "such") {
  HandMade unannounced;
  unannounced.message(5, 1, tick_data).message(6, 1, tick_data);
  const ReadBack none = read_back(unannounced.bytes());
  CHECK(none.events.empty());
  CHECK(none.file.messages_without_channel == 2);

  HandMade foreign;
  foreign.tick_channel("std_msgs/msg/Header").message(5, 1, tick_data);
  const ReadBack read = read_back(foreign.bytes());
  CHECK(read.events.empty());
  CHECK(read.counters.foreign == 1);
}

/// A chunk of one tick at 77 ns, packed, whose header says `size` for its records.
HandMade packed_chunk(std::string_view compression, const Bytes& packed, std::uint64_t size,
                      std::uint32_t crc) {
  HandMade file;
  file.tick_channel().record(6, [&](ByteWriter& out) {
    out.u64(77);
    out.u64(77);
    out.u64(size);
    out.u32(crc);
    out.string(compression);
    out.u64(packed.size());
    out.bytes(packed);
  });
  return file;
}

#ifdef ALCES_CAN_PACK
Bytes tick_message() {
  HandMade file;
  const std::size_t begin = file.bytes().size();
  file.message(5, 77, tick_data);
  return {file.bytes().begin() + static_cast<std::ptrdiff_t>(begin), file.bytes().end()};
}

Bytes packed_with_zstd(const Bytes& plain) {
  Bytes packed(ZSTD_compressBound(plain.size()));
  packed.resize(ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), 3));
  return packed;
}

Bytes packed_with_lz4(const Bytes& plain) {
  Bytes packed(LZ4F_compressFrameBound(plain.size(), nullptr));
  packed.resize(LZ4F_compressFrame(packed.data(), packed.size(), plain.data(), plain.size(), nullptr));
  return packed;
}

TEST_CASE("chunks that zstd and lz4 packed are read like others") {
  const Bytes plain = tick_message();
  const std::uint32_t crc = crc32(plain);
  for (const auto& [compression, packed] :
       {std::pair{"zstd", packed_with_zstd(plain)}, std::pair{"lz4", packed_with_lz4(plain)}}) {
    CAPTURE(compression);
    const ReadBack read = read_back(packed_chunk(compression, packed, plain.size(), crc).bytes());
    CHECK(read.file.chunks_compressed == 1);
    CHECK(read.file.chunks_corrupt == 0);
    REQUIRE(read.events.size() == 1);
    CHECK(read.events[0].event.stamp_ns == 77);

    for (std::size_t at = 0; at < packed.size(); ++at) {  // damaged anywhere: told, or the same
      Bytes damaged = packed;
      damaged[at] ^= 0x20;
      const ReadBack back = read_back(packed_chunk(compression, damaged, plain.size(), crc).bytes());
      CHECK(back.events.size() + back.file.chunks_corrupt == 1);
    }
    Bytes cut = packed;
    cut.resize(packed.size() / 2);
    CHECK(read_back(packed_chunk(compression, cut, plain.size(), crc).bytes()).file.chunks_corrupt == 1);
    const ReadBack absurd = read_back(packed_chunk(compression, packed, UINT64_MAX / 2, crc).bytes());
    CHECK(absurd.events.empty());
    CHECK_THAT(absurd.problems.at(0), Catch::Contains("damaged"));
  }
}
#endif

TEST_CASE("a chunk that nobody can unpack is refused by name") {
  const ReadBack read = read_back(packed_chunk("brotli", {1, 2, 3, 4}, 100, 0).bytes());
  CHECK(read.file.chunks_compressed == 1);
  REQUIRE_FALSE(read.problems.empty());
  CHECK_THAT(read.problems[0], Catch::Contains("'brotli'") && Catch::Contains("mcap decompress"));
}

/// Bytes until a disk fails.
class FailingSource final : public ByteSource {
 public:
  explicit FailingSource(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> room) override {
    const std::size_t got = bytes_.read(room);
    if (got < room.size()) error_number_ = EIO;
    return got;
  }
  [[nodiscard]] int error_number() const override { return error_number_; }

 private:
  MemorySource bytes_;
  int error_number_ = 0;
};

TEST_CASE("a read that fails is an error and no end") {
  const Bytes whole = sample_recording(event_count);
  FailingSource source({whole.data(), whole.size() / 2});
  const RecordingSummary summary = summarise_recording(source);
  CHECK(summary.read_error == EIO);
  CHECK_FALSE(summary.is_whole);
}

TEST_CASE("a topic of somebody else on another clock says nothing of the drive's time") {
  HandMade file;
  file.tick_channel().record(3, [](ByteWriter& out) {
    out.u16(2);
    out.string("std_msgs/msg/Header");
    out.string("ros2msg");
    out.string("");
  });
  file.record(4, [](ByteWriter& out) {
    out.u16(6);
    out.u16(2);
    out.string("/theirs");
    out.string("cdr");
    out.u32(0);
  });
  file.message(6, 5, tick_data).message(5, 1'000'000'000, tick_data).message(5, 3'000'000'000, tick_data);
  file.message(6, 1'700'000'000'000'000'000, tick_data);
  MemorySource source(file.bytes());
  const RecordingSummary summary = summarise_recording(source);
  CHECK(summary.messages == 4);
  CHECK(summary.begin_ns == 1'000'000'000);
  CHECK(summary.end_ns == 3'000'000'000);
}

TEST_CASE("counts inside a message that its bytes cannot hold are refused without asking for memory") {
  HandMade file;
  file.record(3, [](ByteWriter& out) {
    out.u16(1);
    out.string("nav_msgs/msg/Path");
    out.string("ros2msg");
    out.string("");
  });
  file.record(4, [](ByteWriter& out) {
    out.u16(5);
    out.u16(1);
    out.string("/alces/path");
    out.string("cdr");
    out.u32(0);
  });
  Bytes data(64);
  CdrWriter cdr(data);
  cdr.header(1, "map");
  cdr.number(std::uint32_t{0xffffffff});
  file.message(5, 1, data);
  const ReadBack read = read_back(file.bytes());
  CHECK(read.counters.messages_malformed == 1);
}

TEST_CASE("transforms of other programs, or of other frames, are foreign and no damage") {
  HandMade file;
  file.record(3, [](ByteWriter& out) {
    out.u16(1);
    out.string("tf2_msgs/msg/TFMessage");
    out.string("ros2msg");
    out.string("");
  });
  file.record(4, [](ByteWriter& out) {
    out.u16(5);
    out.u16(1);
    out.string("/tf");
    out.string("cdr");
    out.u32(0);
  });
  const auto message = [&](std::uint32_t count, const char* frame, const char* child) {
    Bytes data(400);
    CdrWriter cdr(data);
    cdr.number(count);
    for (std::uint32_t i = 0; i < count; ++i) {
      cdr.header(7, frame);
      cdr.string(child);
      cdr.pose({});
    }
    data.resize(cdr.size());
    file.message(5, 7, data);
  };
  message(1, "map", "body");
  message(1, "odom", "body");
  message(1, "map", "base_link");
  message(2, "map", "body");
  message(0, "", "");
  const ReadBack read = read_back(file.bytes());
  CHECK(read.counters.results == 1);
  CHECK(read.counters.foreign == 4);
  CHECK(read.counters.messages_malformed == 0);
}

TEST_CASE("a summary counts messages by topic and says whether the file is whole") {
  const Bytes whole = sample_recording(event_count);
  MemorySource source(whole);
  const RecordingSummary summary = summarise_recording(source);
  CHECK(summary.is_recording);
  CHECK(summary.is_whole);
  CHECK(summary.has_configuration);
  CHECK(summary.bytes == whole.size());
  CHECK(summary.utc_offset_ns == sample::utc_offset_ns);
  CHECK(summary.begin_ns == sample::begin_ns);
  CHECK(summary.end_ns > summary.begin_ns);
  std::uint64_t sum = 0;
  std::uint64_t ticks_and_stops = 0;
  for (const RecordingSummary::Topic& topic : summary.topics) {
    sum += topic.messages;
    if (topic.name == "/alces/tick") {
      CHECK(topic.type == "alces_msgs/msg/Tick");
      CHECK(topic.bytes == 12 * topic.messages);
    }
    for (const char* name : {"/alces/tick", "/alces/stop", "/alces/orders", "/alces/syncs"}) {
      if (topic.name == name) ticks_and_stops += topic.messages;
    }
  }
  CHECK(sum == summary.messages);
  CHECK(ticks_and_stops == (event_count + 12) / 13);

  const std::span<const std::uint8_t> bytes(whole);
  MemorySource half(bytes.first(whole.size() / 2));
  const RecordingSummary cut = summarise_recording(half);
  CHECK(cut.is_recording);
  CHECK_FALSE(cut.is_whole);
  CHECK(cut.messages < summary.messages);
  CHECK(cut.problems.size() == 1);
}

}  // namespace
}  // namespace alces
