// What the writer puts into a file, and what it does when the disk takes nothing.
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "alces_platform/recording/file_sink.h"
#include "recording_bench.h"

namespace alces {
namespace {

std::uint32_t slow_crc(std::span<const std::uint8_t> bytes) {
  std::uint32_t state = 0xffffffffU;
  for (const std::uint8_t byte : bytes) {
    state ^= byte;
    for (int bit = 0; bit < 8; ++bit) state = (state >> 1) ^ ((state & 1) != 0 ? 0xedb88320U : 0U);
  }
  return ~state;
}

namespace {

/// The first notice with this text, if there is one, has this value.
bool was_told(const RecordingBench& bench, const std::string& text, std::int64_t value) {
  for (const Notice& notice : bench.heard.notices) {
    if (std::string(notice.text).find(text) == 0) return notice.value == value;
  }
  return false;
}

}  // namespace

TEST_CASE("the CRC is the one of the catalogue, at any length and in any pieces") {
  const std::string check = "123456789";
  const std::span<const std::uint8_t> digits(reinterpret_cast<const std::uint8_t*>(check.data()),
                                             check.size());
  CHECK(crc32(digits) == 0xcbf43926U);
  std::vector<std::uint8_t> bytes;
  for (std::uint32_t size = 0; size < 40; ++size) {
    CHECK(crc32(bytes) == slow_crc(bytes));
    Crc32 pieces;
    pieces.add(std::span(bytes).first(size / 3));
    pieces.add({});
    pieces.add(std::span(bytes).subspan(size / 3));
    CHECK(pieces.value() == slow_crc(bytes));
    Crc32 joined;
    joined.add(std::span(bytes).first(size / 3));
    joined.add_known(crc32(std::span(bytes).subspan(size / 3)), size - size / 3);
    CHECK(joined.value() == slow_crc(bytes));
    bytes.push_back(static_cast<std::uint8_t>(size * 37 + 11));
  }
}

TEST_CASE("a configuration or a block that does not do is refused by name") {
  MemorySink sink;
  RecordingStatus status{};
  alignas(64) static std::array<std::byte, 1024> tiny{};
  RecordingConfig config = RecordingBench::small();
  CHECK(RecordingWriter::create(tiny, config, sink, nullptr, status) == nullptr);
  CHECK(status == RecordingStatus::block_too_small);
  CHECK(RecordingWriter::create(std::span(tiny).subspan(1), config, sink, nullptr, status) == nullptr);
  CHECK(status == RecordingStatus::block_misaligned);
  for (const auto& spoil :
       std::vector<void (*)(RecordingConfig&)>{[](RecordingConfig& c) { c.chunk_bytes = 100; },
                                               [](RecordingConfig& c) { c.chunk_bytes = 1U << 30; },
                                               [](RecordingConfig& c) { c.messages_per_chunk = 65536; },
                                               [](RecordingConfig& c) { c.can_bus_count = 5; },
                                               [](RecordingConfig& c) { c.flush_interval_ns = 0; },
                                               [](RecordingConfig& c) { c.chunk_capacity = 0; }}) {
    RecordingConfig bad = config;
    spoil(bad);
    CHECK(RecordingWriter::create(tiny, bad, sink, nullptr, status) == nullptr);
    CHECK(status == RecordingStatus::bad_config);
    CHECK(std::string(to_string(status)).find("configuration") != std::string::npos);
  }
}

TEST_CASE("events come back exactly as they went in, in their order") {
  const std::vector<std::uint8_t> bytes = sample_recording(500);
  const ReadBack read = read_back(bytes);
  INFO((read.problems.empty() ? "" : read.problems.front()));
  CHECK(read.opened);
  CHECK(read.is_whole);
  CHECK(read.configuration == sample::configuration);
  REQUIRE(read.events.size() == 500);
  std::size_t different = 0;
  for (std::uint32_t i = 0; i < 500; ++i) {
    if (!sample::same(read.events[i].event, sample::event_at(i).event)) ++different;
  }
  CHECK(different == 0);
  CHECK(read.counters.messages_missing == 0);
  CHECK(read.counters.messages_malformed == 0);
  CHECK(read.file.chunks > 5);
}

TEST_CASE("the results of the mapping come back as well") {
  const std::vector<std::uint8_t> bytes = sample_recording(60);  // scans 0, 1, 2
  MemorySource source(bytes);
  RecordingReader reader(source);
  REQUIRE(reader.open());
  CHECK(reader.utc_offset_ns() == sample::utc_offset_ns);
  CHECK(reader.can_bus_count() == 2);
  CHECK(reader.file().profile() == "ros2");
  std::vector<std::size_t> kinds(std::variant_size_v<decltype(RecordedMessage::content)>);
  RecordedMessage message;
  std::int64_t last_ns = 0;
  while (reader.next(message)) {
    CHECK(message.handed_on_ns >= last_ns);
    last_ns = message.handed_on_ns;
    const std::uint32_t number = static_cast<std::uint32_t>(kinds[message.content.index()]++);
    const std::int64_t stamp_ns = sample::begin_ns + std::int64_t{number} * 20'000'000;
    if (const auto* scan = std::get_if<ScanRecord>(&message.content)) {
      CHECK(scan->number == number);
      CHECK(scan->reference_stamp_ns == stamp_ns);
      CHECK(scan->begin_stamp_ns == stamp_ns - 1000);
      CHECK(scan->end_stamp_ns == stamp_ns + 1001);
      CHECK(scan->verdict == "mapped");
      CHECK(scan->was_mapped);
      CHECK(scan->is_incomplete == (number == 0));
      CHECK(scan->profiles == 90);
      CHECK(scan->profiles_missing == 2);
      CHECK(scan->rays_without_range == 17);
      CHECK(scan->points == 181 * 90);
      CHECK(scan->points_reduced == 10);
      CHECK(scan->head_turn_rad == 3.25);
      CHECK(scan->odometry_from_body.matrix() == sample::pose_at(number).matrix());
      CHECK(scan->has_gps == (number % 2 == 0));
      CHECK(scan->gps_position_m == Eigen::Vector3d(1, 2, 3));
    } else if (const auto* cloud = std::get_if<CloudRecord>(&message.content)) {
      REQUIRE(cloud->points.size() == 10);
      CHECK(cloud->points[9].x == 9);
      CHECK(cloud->points[9].y == static_cast<float>(number));
      CHECK(cloud->points[9].z == -1.5F);
    } else if (const auto* pose = std::get_if<PoseRecord>(&message.content)) {
      CHECK(pose->map_from_body.matrix() == sample::pose_at(number).matrix());
      CHECK(pose->stamp_ns == stamp_ns);
    } else if (const auto* transform = std::get_if<TransformRecord>(&message.content)) {
      CHECK(transform->map_from_body.matrix() == sample::pose_at(number).matrix());
      CHECK(transform->stamp_ns == stamp_ns);
    } else if (const auto* path = std::get_if<PathRecord>(&message.content)) {
      REQUIRE(path->map_from_body.size() == 4);
      CHECK(path->stamps_ns[3] == sample::begin_ns + 3);
      CHECK(path->map_from_body[3].matrix() == sample::pose_at(3).matrix());
    } else if (const auto* loop = std::get_if<LoopRecord>(&message.content)) {
      CHECK(loop->first == 1);
      CHECK(loop->last == 2);
      CHECK(loop->is_closed);
      CHECK(loop->verdict == "closed");
      CHECK(loop->correction_m == 1.25);
      CHECK(loop->iterations == 11);
    } else if (const auto* edge = std::get_if<GraphEdgeRecord>(&message.content)) {
      CHECK(edge->from == number);
      CHECK(edge->to == number + 1);
      CHECK(edge->rotation_rad2 == 0.04);
    } else if (const auto* diagnostic = std::get_if<DiagnosticRecord>(&message.content)) {
      if (number == 0) {
        CHECK(diagnostic->name == "motor");
        CHECK(diagnostic->level == DiagnosticLevel::warning);
        REQUIRE(diagnostic->values.size() == 1);
        CHECK(diagnostic->values[0].value == "25376");
      } else {
        CHECK(diagnostic->name == "recording");
        REQUIRE(diagnostic->values.size() == 8);
        CHECK(diagnostic->values[0].key == "messages_written");
      }
    }
  }
  CHECK(kinds == std::vector<std::size_t>{60, 3, 3, 3, 1, 1, 3, 2, 3, 0});
  CHECK(reader.is_whole());
}

TEST_CASE("messages take the bytes that the header states") {
  RecordingBench bench;
  const std::vector<std::uint8_t> data(100);
  const auto event_of = [&](EventKind kind) {
    Event event;
    event.kind = kind;
    event.bytes = data;
    return event;
  };
  for (const EventKind kind : {EventKind::tick, EventKind::edge, EventKind::can_frame, EventKind::bytes})
    bench.writer->on_event(event_of(kind));
  Event fd = event_of(EventKind::can_sent);
  fd.frame.is_fd = true;
  fd.frame.size = 64;
  bench.writer->on_event(fd);
  const std::vector<Point> points(10);
  const std::vector<Pose> poses(10);
  bench.writer->write_pose({});
  bench.writer->write_cloud({0, points});
  bench.writer->write_path({0, {}, poses});
  REQUIRE(bench.writer->finish());
  MemorySource source(bench.sink.bytes);
  RecordingReader reader(source);
  REQUIRE(reader.open());
  RecordedMessage message;
  std::vector<std::uint64_t> sizes;
  while (reader.next(message)) sizes.push_back(message.bytes);
  CHECK(sizes == std::vector<std::uint64_t>{12, 20, 36, 20 + 100, 36 + 64, 76, 92, 113 + 120, 28 + 720});
}

TEST_CASE("a pose is also a transform that places the body in the map, as ROS 2 encodes it") {
  RecordingBench bench;
  bench.writer->write_pose({3 * ns_per_s + 7, sample::pose_at(5)});
  REQUIRE(bench.writer->finish());
  MemorySource source(bench.sink.bytes);
  mcap::Reader reader(source);
  REQUIRE(reader.open());
  mcap::ReadMessage message;
  while (reader.next(message) && reader.channels().at(message.channel).topic != "/tf") {
  }
  const mcap::ReadChannel& channel = reader.channels().at(message.channel);
  REQUIRE(channel.topic == "/tf");
  CHECK(channel.schema == "tf2_msgs/msg/TFMessage");
  CHECK(channel.message_encoding == "cdr");
  CdrReader cdr(message.data);
  CHECK(cdr.number<std::uint32_t>() == 1);  // transforms
  CHECK(cdr.time() == 3 * ns_per_s + 7);
  CHECK(cdr.string() == "map");
  CHECK(cdr.string() == "body");
  const Pose pose = cdr.pose();
  CHECK(pose.translation_m == sample::pose_at(5).translation_m);
  CHECK(pose.rotation.coeffs() == sample::pose_at(5).rotation.coeffs());
  CHECK_FALSE(cdr.failed());
}

TEST_CASE("without events, results are handed on when the caller says") {
  RecordingBench bench;
  for (const std::int64_t now_ns : {4 * ns_per_s, 3 * ns_per_s, 5 * ns_per_s, INT64_MAX}) {
    bench.writer->advance_to(now_ns);
    bench.writer->write_pose({1, {}});
  }
  CHECK(bench.writer->file_counters().chunks_written == 2);  // by time
  REQUIRE(bench.writer->finish());
  MemorySource source(bench.sink.bytes);
  RecordingReader reader(source);
  REQUIRE(reader.open());
  RecordedMessage message;
  std::vector<std::int64_t> handed_on_ns;
  while (reader.next(message)) {
    if (std::holds_alternative<PoseRecord>(message.content)) handed_on_ns.push_back(message.handed_on_ns);
  }
  CHECK(handed_on_ns == std::vector<std::int64_t>{4 * ns_per_s, 4 * ns_per_s, 5 * ns_per_s, INT64_MAX});
}

TEST_CASE("an empty recording is a whole file") {
  RecordingBench bench;
  REQUIRE(bench.writer->finish());
  const ReadBack read = read_back(bench.sink.bytes);
  CHECK(read.opened);
  CHECK(read.is_whole);
  CHECK(read.events.empty());
}

TEST_CASE("a chunk is written after the flush interval, however little is in it") {
  RecordingBench bench;
  Event event;
  event.stamp_ns = 10 * ns_per_s;
  bench.writer->on_event(event);
  event.stamp_ns += 499 * ns_per_ms;
  bench.writer->on_event(event);
  CHECK(bench.sink.bytes.empty());
  event.stamp_ns += ns_per_ms;
  bench.writer->on_event(event);
  CHECK(bench.writer->file_counters().messages_written == 2);  // the third begins the next chunk
  CHECK(read_back(bench.sink.bytes).events.size() == 2);
}

TEST_CASE("a stamp far ahead of the others does not stop the clock of the recording") {
  RecordingBench bench;
  Event tick;
  tick.stamp_ns = 10 * ns_per_s;
  bench.writer->on_event(tick);
  Event edge;
  edge.kind = EventKind::edge;
  edge.stamp_ns = INT64_MAX;
  bench.writer->on_event(edge);
  for (int i = 0; i < 60; ++i) {
    tick.stamp_ns += 10 * ns_per_ms;
    bench.writer->on_event(tick);
  }
  CHECK(bench.writer->file_counters().chunks_written == 1);  // by time
  REQUIRE(bench.writer->finish());
  const ReadBack read = read_back(bench.sink.bytes);
  REQUIRE(read.events.size() == 62);
  CHECK(read.events[1].event.stamp_ns == INT64_MAX);
  CHECK(read.events[61].event.stamp_ns == tick.stamp_ns);
}

TEST_CASE("what cannot be recorded is counted and told, never dropped in silence") {
  RecordingBench bench;
  Event event;
  event.kind = EventKind::can_frame;
  event.channel = 2;  // two buses: 0 and 1
  bench.writer->on_event(event);
  event.kind = EventKind::bytes;
  event.channel = byte_channel_count;
  bench.writer->on_event(event);
  event.kind = static_cast<EventKind>(99);
  bench.writer->on_event(event);
  CHECK(bench.writer->counters().events_unknown == 3);

  const std::vector<Point> points(1000);
  CHECK_FALSE(bench.writer->write_cloud({1, points}));
  CHECK(bench.writer->counters().messages_too_large == 1);
  CHECK(was_told(bench, "messages are larger than a chunk and are left out; so far", 1));
  CHECK_FALSE(bench.writer->write_cloud({1, points}));
  CHECK(bench.heard.notices.size() == 1);  // a second one at the same time is a flood

  event = {};
  event.stamp_ns = -5;
  bench.writer->on_event(event);
  CHECK(bench.writer->counters().stamps_negative == 1);

  event = {};
  event.kind = EventKind::can_frame;
  event.frame.size = 200;
  bench.writer->on_event(event);
  CHECK(bench.writer->counters().frames_too_long == 1);
  CHECK(was_told(bench, "CAN frames are longer than 64 bytes and are cut; so far", 1));
  REQUIRE(bench.writer->finish());
  const ReadBack read = read_back(bench.sink.bytes);
  CHECK(read.is_whole);
  REQUIRE(read.events.size() == 2);
  CHECK(read.events[0].event.stamp_ns == 0);
  CHECK(read.events[1].event.frame.size == 64);
}

TEST_CASE("a message that just fills a chunk is recorded, one byte more is not") {
  RecordingBench bench;
  const std::size_t largest = 4096 - 31 - 4 - 8 - 2 - 2 - 4;
  std::vector<std::uint8_t> data(largest + 1, 0x55);
  Event event;
  event.kind = EventKind::bytes;
  event.bytes = data;
  bench.writer->on_event(event);
  CHECK(bench.writer->counters().messages_too_large == 1);
  event.bytes = std::span(data).first(largest);
  bench.writer->on_event(event);
  CHECK(bench.writer->counters().messages_too_large == 1);
  REQUIRE(bench.writer->finish());
  const ReadBack read = read_back(bench.sink.bytes);
  REQUIRE(read.events.size() == 1);
  CHECK(read.events[0].bytes.size() == largest);
}

TEST_CASE("a path longer than a chunk is thinned and keeps its last pose") {
  RecordingBench bench;
  for (const std::uint32_t count : {1U, 53U, 54U, 200U, 1001U}) {
    std::vector<Pose> poses;
    for (std::uint32_t i = 0; i < count; ++i) poses.push_back(sample::pose_at(i));
    bench.writer->write_path({1000, {}, poses});
  }
  CHECK(bench.writer->counters().messages_too_large == 0);
  CHECK(bench.writer->counters().paths_thinned == 3);
  CHECK(was_told(bench, "the path is longer than a chunk and is downsampled; poses of it", 54));
  REQUIRE(bench.writer->finish());
  MemorySource source(bench.sink.bytes);
  RecordingReader reader(source);
  REQUIRE(reader.open());
  RecordedMessage message;
  std::vector<std::size_t> counts;
  std::vector<double> last_x_m;
  while (reader.next(message)) {
    const auto& path = std::get<PathRecord>(message.content);
    counts.push_back(path.map_from_body.size());
    last_x_m.push_back(path.map_from_body.back().translation_m.x());
  }
  CHECK(counts == std::vector<std::size_t>{1, 53, 27, 50, 32});
  CHECK(last_x_m == std::vector<double>{0, 26, 26.5, 99.5, 500});
}

TEST_CASE(
    "with the disk full, chunks wait, are then given up and counted, and recording goes on where there is "
    "room") {
  RecordingBench bench;
  std::uint32_t i = 0;
  for (; i < 200; ++i) bench.writer->on_event(sample::event_at(i).event);
  const std::size_t before = bench.sink.bytes.size();
  bench.sink.capacity = before;
  for (; i < 600; ++i) bench.writer->on_event(sample::event_at(i).event);
  CHECK(bench.sink.bytes.size() == before);
  CHECK(bench.writer->is_stalled());
  CHECK(bench.writer->file_counters().chunks_lost > 2);
  REQUIRE(bench.heard.notices.size() == 1);  // said once
  CHECK(bench.heard.notices[0].severity == Severity::error);
  bench.sink.capacity = SIZE_MAX;
  for (; i < 900; ++i) bench.writer->on_event(sample::event_at(i).event);
  CHECK_FALSE(bench.writer->is_stalled());
  REQUIRE(bench.heard.notices.size() == 2);
  CHECK(bench.heard.notices[1].value ==
        static_cast<std::int64_t>(bench.writer->file_counters().messages_lost));
  REQUIRE(bench.writer->finish());

  const ReadBack read = read_back(bench.sink.bytes);
  INFO((read.problems.empty() ? "" : read.problems.front()));
  CHECK(read.is_whole);  // the file is; what is missing shows in the sequence numbers
  CHECK(read.counters.messages_missing == bench.writer->file_counters().messages_lost);
  CHECK(read.events.size() + read.counters.messages_missing == 900);
  CHECK(sample::same(read.events.back().event, sample::event_at(899).event));
}

TEST_CASE("a disk that is full for a moment only costs nothing") {
  RecordingBench bench;
  std::uint32_t i = 0;
  for (; i < 200; ++i) bench.writer->on_event(sample::event_at(i).event);
  REQUIRE(bench.writer->flush());
  bench.sink.capacity = bench.sink.bytes.size();
  for (; i < 220; ++i) bench.writer->on_event(sample::event_at(i).event);
  CHECK_FALSE(bench.writer->flush());
  CHECK(bench.writer->is_stalled());
  bench.sink.capacity = SIZE_MAX;
  for (; i < 300; ++i) bench.writer->on_event(sample::event_at(i).event);
  REQUIRE(bench.writer->finish());
  const ReadBack read = read_back(bench.sink.bytes);
  CHECK(read.is_whole);
  CHECK(read.events.size() == 300);
  CHECK(bench.writer->file_counters().messages_lost == 0);
}

TEST_CASE("a disk that is full from the beginning gets the head with the first chunk that fits") {
  RecordingBench bench;
  bench.sink.capacity = 0;
  std::uint32_t i = 0;
  for (; i < 300; ++i) bench.writer->on_event(sample::event_at(i).event);
  CHECK(bench.sink.bytes.empty());
  bench.sink.capacity = SIZE_MAX;
  for (; i < 400; ++i) bench.writer->on_event(sample::event_at(i).event);
  REQUIRE(bench.writer->finish());
  const ReadBack read = read_back(bench.sink.bytes);
  CHECK(read.is_whole);
  CHECK(read.configuration == sample::configuration);
  CHECK(read.events.size() + read.counters.messages_missing == 400);
}

TEST_CASE("notices that are written into the recording they are about do it no harm") {
  struct Echo final : NoticePort {
    void raise(const Notice& notice) override { writer->write_notice(notice); }
    RecordingWriter* writer = nullptr;
  } echo;
  const RecordingConfig config = RecordingBench::small();
  MemorySink sink;
  RecordingStatus status{};
  std::vector<std::byte> memory(RecordingWriter::memory_required(config) + 64);
  std::byte* block = memory.data() + (64 - reinterpret_cast<std::uintptr_t>(memory.data()) % 64) % 64;
  echo.writer = RecordingWriter::create({block, memory.size() - 64}, config, sink, &echo, status);
  REQUIRE(echo.writer != nullptr);
  for (std::uint32_t i = 0; i < 900; ++i) {
    sink.capacity = i < 200 || i > 500 ? SIZE_MAX : sink.bytes.size();
    echo.writer->on_event(sample::event_at(i).event);
  }
  REQUIRE(echo.writer->finish());
  const ReadBack read = read_back(sink.bytes);
  CHECK(read.is_whole);
  CHECK(read.counters.results >= 1);
  CHECK(read.events.size() + read.counters.results + read.counters.messages_missing == 902);
}

/// The ChunkIndex records behind the data, and whether each points to a chunk and its message indexes.
std::size_t chunks_indexed(std::span<const std::uint8_t> file) {
  std::size_t count = 0;
  std::uint64_t expected_offset = 0;
  bool is_behind_data = false;
  ByteReader in(file);
  static_cast<void>(in.bytes(mcap::magic.size()));
  while (in.left() > mcap::magic.size()) {
    const auto opcode = static_cast<mcap::Opcode>(in.u8());
    ByteReader record(in.bytes(in.u64()));
    is_behind_data = is_behind_data || opcode == mcap::Opcode::data_end;
    if (!is_behind_data || opcode != mcap::Opcode::chunk_index) continue;
    const std::uint64_t begin_ns = record.u64();
    const std::uint64_t end_ns = record.u64();
    const std::uint64_t offset = record.u64();
    const std::uint64_t length = record.u64();
    CHECK(offset >= expected_offset);  // in the file's order
    expected_offset = offset + length;
    ByteReader chunk(file.subspan(static_cast<std::size_t>(offset)));
    CHECK(chunk.u8() == static_cast<std::uint8_t>(mcap::Opcode::chunk));
    CHECK(chunk.u64() + mcap::record_header_bytes == length);
    CHECK(chunk.u64() == begin_ns);
    CHECK(chunk.u64() == end_ns);
    ByteReader places(record.bytes(record.u32()));
    std::uint64_t indexes_end = offset + length;
    while (places.left() > 0) {
      const std::uint16_t channel = places.u16();
      const std::uint64_t place = places.u64();
      CHECK(place == indexes_end);
      ByteReader index(file.subspan(static_cast<std::size_t>(place)));
      CHECK(index.u8() == static_cast<std::uint8_t>(mcap::Opcode::message_index));
      indexes_end += mcap::record_header_bytes + index.u64();
      CHECK(index.u16() == channel);
    }
    CHECK(record.u64() == indexes_end - offset - length);
    ++count;
  }
  CHECK_FALSE(in.failed());
  return count;
}

TEST_CASE("the summary indexes every chunk, however few rows of the index memory holds") {
  for (const std::uint32_t rows : {1U, 2U, 3U, 7U, 1000U}) {
    CAPTURE(rows);
    RecordingConfig config = RecordingBench::small();
    config.chunk_capacity = rows;
    RecordingBench bench(config);
    sample::record(*bench.writer, 1500);
    REQUIRE(bench.writer->finish());
    const mcap::Writer::Counters& counters = bench.writer->file_counters();
    CHECK(counters.chunks_written > 20);
    CHECK(counters.chunks_not_indexed == 0);
    CHECK(chunks_indexed(bench.sink.bytes) == counters.chunks_written);
    const ReadBack read = read_back(bench.sink.bytes);
    CHECK(read.is_whole);
    CHECK(read.events.size() == 1500);
    CHECK(read.file.records_unknown == 0);
    for (const Notice& notice : bench.heard.notices)
      CHECK_THAT(std::string(notice.text), !Catch::Contains("index"));
  }
}

TEST_CASE("the index takes the same memory for any length of drive") {
  RecordingConfig config;
  const std::size_t bytes = RecordingWriter::memory_required(config);
  CHECK(bytes < 2'000'000);
  config.chunk_capacity = 16384;
  CHECK(RecordingWriter::memory_required(config) > bytes + 900'000);
}

TEST_CASE("a page of the index that the disk does not take waits as a chunk does, and the index is whole") {
  RecordingConfig config = RecordingBench::small();
  config.chunk_capacity = 2;
  RecordingBench bench(config);
  for (std::uint32_t i = 0; i < 900; ++i) {
    bench.sink.capacity = i < 200 || i > 500 ? SIZE_MAX : bench.sink.bytes.size() + 50;
    bench.writer->on_event(sample::event_at(i).event);
  }
  REQUIRE(bench.writer->finish());
  CHECK(bench.writer->file_counters().write_failures > 0);
  CHECK(chunks_indexed(bench.sink.bytes) == bench.writer->file_counters().chunks_written);
  CHECK(read_back(bench.sink.bytes).is_whole);
}

TEST_CASE("an index that cannot be read back is left out as a whole, is told, and the file stays whole") {
  RecordingConfig config = RecordingBench::small();
  config.chunk_capacity = 2;
  RecordingBench bench(config);
  bench.sink.reads_back = false;
  sample::record(*bench.writer, 500);
  REQUIRE(bench.writer->finish());
  CHECK(bench.writer->file_counters().chunks_not_indexed > 3);
  CHECK(was_told(bench, "its index cannot be made",
                 static_cast<std::int64_t>(bench.writer->file_counters().chunks_written)));
  CHECK(chunks_indexed(bench.sink.bytes) == 0);
  const ReadBack read = read_back(bench.sink.bytes);
  CHECK(read.is_whole);
  CHECK(read.events.size() == 500);
}

TEST_CASE("more pages than their places have room for: no index, and the file stays whole") {
  mcap::WriterConfig config;
  config.chunk_bytes = 4096;
  config.messages_per_chunk = 16;
  config.chunk_capacity = 2;
  config.page_capacity = 3;
  const std::array<mcap::Schema, 1> schemas{{{"test", "uint8 x"}}};
  const std::array<mcap::Channel, 1> channels{{{"/test", 0}}};
  config.schemas = schemas;
  config.channels = channels;
  for (const std::uint32_t chunks : {8U, 9U}) {  // the last page stays in memory
    CAPTURE(chunks);
    MemorySink sink;
    alignas(64) static std::array<std::byte, 65536> block{};
    Arena arena(block);
    mcap::Writer writer(arena, config, &sink);
    for (std::uint32_t i = 0; i < chunks; ++i) {
      writer.begin_message()[0] = 1;
      writer.commit_message(0, i, i, 1);
      REQUIRE(writer.flush());
    }
    REQUIRE(writer.finish());
    CHECK(writer.counters().chunks_not_indexed == chunks - 8);
    CHECK(chunks_indexed(sink.bytes) == (chunks == 8 ? 8 : 0));
    CHECK(read_back(sink.bytes).is_whole);
  }
}

TEST_CASE("a write that ends half way leaves the file behind the last whole one") {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("alces_sink_" + std::to_string(::getpid()))).string();
  FileSink sink;
  CHECK_FALSE(sink.open("/nowhere/at/all.mcap"));
  CHECK(sink.error_number() == ENOENT);
  CHECK_FALSE(sink.open("/dev/null"));  // could not be cut back
  REQUIRE(sink.open(path.c_str()));
  const std::vector<std::uint8_t> piece(3000, 7);
  REQUIRE(sink.write(piece));

  struct rlimit before {};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  struct rlimit limited = before;
  limited.rlim_cur = 5000;  // 2000 of the next 3000 bytes fit
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &limited) == 0);
  const bool taken = sink.write(piece);
  const auto size_after = std::filesystem::file_size(path);
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &before) == 0);
  std::signal(SIGXFSZ, handler);
  CHECK_FALSE(taken);
  CHECK(sink.error_number() == EFBIG);
  CHECK(size_after == 3000);

  const std::vector<std::uint8_t> other(10, 9);
  REQUIRE(sink.write(other));
  CHECK(sink.sync());
  CHECK(sink.close());
  CHECK_FALSE(sink.write(other));
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> read{std::istreambuf_iterator<char>(file), {}};
  CHECK(read.size() == 3010);
  CHECK(std::count(read.begin(), read.end(), 9) == 10);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace alces
