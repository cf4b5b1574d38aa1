#include "alces_platform/recording/recording_writer.h"

#include <algorithm>

#include "alces_drivers/stamp.h"

namespace alces {

using recording::Topic;

namespace {

/// An event's stamp may be ahead of the time at which it is handed on (another clock, badly converted); by
/// more than this it is not believed. Ticks always are.
constexpr std::int64_t longest_lead_ns = ns_per_s;

bool fits_classical_frame(const CanFrame& frame) {
  return !frame.is_fd && !frame.is_bit_rate_switched && !frame.is_error_state_indicated && frame.size <= 8;
}

}  // namespace

const char* to_string(RecordingStatus status) {
  switch (status) {
    case RecordingStatus::ok:
      return "ok";
    case RecordingStatus::block_too_small:
      return "the block is smaller than memory_required()";
    case RecordingStatus::block_misaligned:
      return "the block does not start on a 64-byte boundary";
    case RecordingStatus::bad_config:
      return "a configuration value of the recording is out of its range";
  }
  return "unknown";
}

RecordingWriter::RecordingWriter(Arena& arena, const RecordingConfig& config, ByteSink* sink,
                                 NoticePort* notices)
    : config_(config),
      metadata_{{{recording::format_key, recording::format_version},
                 {recording::clock_key, "CLOCK_MONOTONIC"},
                 {recording::utc_offset_key,
                  {utc_offset_text_.data(),
                   static_cast<std::size_t>(std::to_chars(utc_offset_text_.data(),
                                                          utc_offset_text_.data() + utc_offset_text_.size(),
                                                          config.utc_offset_ns)
                                                .ptr -
                                            utc_offset_text_.data())}}}},
      mcap_(arena, file_config(config, metadata_), sink),
      notices_(notices) {
  if (notices != nullptr) capacity_notices_.emplace(*notices, "recording");
}

mcap::WriterConfig RecordingWriter::file_config(const RecordingConfig& config,
                                                std::span<const mcap::KeyValue> metadata) {
  mcap::WriterConfig file;
  file.chunk_bytes = config.chunk_bytes;
  file.messages_per_chunk = config.messages_per_chunk;
  file.chunk_capacity = config.chunk_capacity;
  file.profile = "ros2";
  file.library = "alces";
  file.schema_encoding = "ros2msg";
  file.message_encoding = "cdr";
  file.schemas = recording::schemas();
  file.channels = recording::channels(config.can_bus_count);
  file.metadata_name = recording::metadata_name;
  file.metadata = metadata;
  if (!config.configuration.empty()) {
    file.attachment_name = recording::configuration_name;
    file.attachment_media_type = "application/toml";
    file.attachment = config.configuration;
    file.attachment_time_ns = static_cast<std::uint64_t>(std::max<std::int64_t>(config.begin_stamp_ns, 0));
  }
  return file;
}

std::size_t RecordingWriter::memory_required(const RecordingConfig& config) {
  Arena arena;
  arena.allocate<std::byte>(sizeof(RecordingWriter));
  const RecordingWriter writer(arena, config, nullptr, nullptr);
  return arena.overflowed() ? SIZE_MAX : arena.used_bytes();
}

RecordingWriter* RecordingWriter::create(std::span<std::byte> block, const RecordingConfig& config,
                                         ByteSink& sink, NoticePort* notices, RecordingStatus& status) {
  const bool config_is_good = config.chunk_bytes >= 4096 && config.chunk_bytes <= (std::size_t{64} << 20) &&
                              config.messages_per_chunk >= 16 && config.messages_per_chunk <= 65535 &&
                              config.chunk_capacity >= 1 && config.flush_interval_ns > 0 &&
                              config.can_bus_count <= recording::maximum_can_buses;
  status = RecordingStatus::bad_config;
  if (!config_is_good) return nullptr;
  status = RecordingStatus::block_misaligned;
  if (reinterpret_cast<std::uintptr_t>(block.data()) % Arena::alignment != 0) return nullptr;
  status = RecordingStatus::block_too_small;
  if (block.size() < memory_required(config)) return nullptr;
  Arena arena(block);
  const std::span<std::byte> place = arena.allocate<std::byte>(sizeof(RecordingWriter));
  if (place.empty()) return nullptr;
  status = RecordingStatus::ok;
  return new (place.data()) RecordingWriter(arena, config, &sink, notices);
}

void RecordingWriter::commit(std::uint16_t channel, std::int64_t stamp_ns, std::size_t size) {
  if (stamp_ns < 0) ++counters_.stamps_negative;
  if (mcap_.messages_in_chunk() == 0) retry_later();
  mcap_.commit_message(channel, static_cast<std::uint64_t>(now_ns_),
                       static_cast<std::uint64_t>(std::max<std::int64_t>(stamp_ns, 0)), size);
}

void RecordingWriter::retry_later() {
  const std::int64_t interval_ns = config_.flush_interval_ns;
  retry_ns_ = std::min(now_ns_, INT64_MAX - interval_ns) + interval_ns;
}

void RecordingWriter::make_room() {
  static_cast<void>(try_flush(true));
}

/// The notices come last: whoever hears them may write them here.
bool RecordingWriter::try_flush(bool gives_up) {
  const std::uint64_t not_indexed_before = mcap_.counters().chunks_not_indexed;
  const bool taken = mcap_.flush();
  const std::uint64_t lost_before = mcap_.counters().messages_lost;
  if (!taken && gives_up) mcap_.discard();
  retry_later();
  if (taken && is_stalled_) {
    is_stalled_ = false;
    const auto lost = static_cast<std::int64_t>(mcap_.counters().messages_lost - lost_before_stall_);
    say(Severity::info, "the recording goes on; messages lost meanwhile", lost);
  } else if (!taken && !is_stalled_) {
    is_stalled_ = true;
    lost_before_stall_ = lost_before;
    say(Severity::error, "the recording cannot be written; make room on its disk", 0);
  }
  say_not_indexed(not_indexed_before);
  return taken;
}

void RecordingWriter::say_not_indexed(std::uint64_t before) {
  if (mcap_.counters().chunks_not_indexed > before)
    say(NoticeKind::not_indexed,
        "its index cannot be made, for it is too long or cannot be read back: it is read from the front; "
        "chunks",
        mcap_.counters().chunks_written);
}

void RecordingWriter::say(Severity severity, const char* text, std::int64_t value) {
  if (notices_ != nullptr)
    notices_->raise({now_ns_, severity, "recording", text, value, severity == Severity::info});
}

void RecordingWriter::say(NoticeKind kind, const char* text, std::uint64_t count) {
  if (capacity_notices_)
    capacity_notices_->raise(kind, Severity::warning, now_ns_, text, static_cast<std::int64_t>(count));
}

bool RecordingWriter::flush() {
  return try_flush(false);
}

bool RecordingWriter::finish() {
  static_cast<void>(try_flush(true));
  const std::uint64_t not_indexed_before = mcap_.counters().chunks_not_indexed;
  const bool is_finished = mcap_.finish();
  say_not_indexed(not_indexed_before);
  return is_finished;
}

/// The time at which this is handed on: that of the last tick, or later by what newer stamps say.
void RecordingWriter::advance(const Event& event) {
  const bool is_verified = is_sane_stamp(event.stamp_ns) && (!has_now_ || event.kind == EventKind::tick ||
                                                             event.stamp_ns - now_ns_ <= longest_lead_ns);
  advance_to(is_verified ? event.stamp_ns : now_ns_);
}

void RecordingWriter::advance_to(std::int64_t now_ns) {
  if (now_ns > now_ns_) {
    now_ns_ = now_ns;
    has_now_ = true;
  }
  if (mcap_.messages_in_chunk() > 0 && now_ns_ >= retry_ns_) static_cast<void>(try_flush(false));
}

void RecordingWriter::on_event(const Event& event) {
  ++counters_.events;
  advance(event);
  switch (event.kind) {
    case EventKind::tick:
      put(Topic::tick, event.stamp_ns, [&](CdrWriter& cdr) { cdr.time(event.stamp_ns); });
      return;
    case EventKind::stop:
      put(Topic::stop, event.stamp_ns, [&](CdrWriter& cdr) { cdr.time(event.stamp_ns); });
      return;
    case EventKind::order:
      put(Topic::orders, event.stamp_ns, [&](CdrWriter& cdr) {
        cdr.time(event.stamp_ns);
        cdr.number(static_cast<std::uint8_t>(event.order));
        cdr.boolean(event.is_up);
      });
      return;
    case EventKind::sync_sent:
      put(Topic::syncs, event.stamp_ns, [&](CdrWriter& cdr) {
        cdr.time(event.stamp_ns);
        cdr.number(event.channel);
      });
      return;
    case EventKind::can_frame:
    case EventKind::can_sent:
      put_frame(event);
      return;
    case EventKind::bytes:
      put_bytes(event, false);
      return;
    case EventKind::bytes_sent:
      put_bytes(event, true);
      return;
    case EventKind::can_link:
    case EventKind::byte_link:
      put(Topic::links, event.stamp_ns, [&](CdrWriter& cdr) {
        cdr.time(event.stamp_ns);
        cdr.number<std::uint8_t>(event.kind == EventKind::byte_link ? 1 : 0);
        cdr.number(event.channel);
        cdr.boolean(event.is_up);
      });
      return;
    case EventKind::edge:
      put(Topic::edges, event.stamp_ns, [&](CdrWriter& cdr) {
        cdr.time(event.stamp_ns);
        cdr.number(event.channel);
        cdr.number(event.edge.line);
        cdr.boolean(event.edge.is_rising);
        cdr.number(event.edge.sequence);
      });
      return;
    case EventKind::edges_lost:
      put(Topic::edges_lost, event.stamp_ns, [&](CdrWriter& cdr) {
        cdr.time(event.stamp_ns);
        cdr.number(event.channel);
        cdr.number(event.edge.line);
        cdr.number(event.lost_count);
      });
      return;
  }
  ++counters_.events_unknown;
}

void RecordingWriter::put_frame(const Event& event) {
  if (event.channel >= config_.can_bus_count) {
    ++counters_.events_unknown;
    return;
  }
  const CanFrame& frame = event.frame;
  const bool is_classical = fits_classical_frame(frame);
  if (frame.size > CanFrame::maximum_bytes) {
    ++counters_.frames_too_long;
    say(NoticeKind::too_long, "CAN frames are longer than 64 bytes and are cut; so far",
        counters_.frames_too_long);
  }
  const int channel = static_cast<int>(Topic::can_rx) + recording::topics_per_can_bus * event.channel +
                      (event.kind == EventKind::can_sent ? 1 : 0) + (is_classical ? 0 : 2);
  put_on(static_cast<std::uint16_t>(channel), event.stamp_ns, [&](CdrWriter& cdr) {
    cdr.header(event.stamp_ns, "");
    cdr.number(frame.id);
    cdr.boolean(frame.is_remote);
    cdr.boolean(frame.is_extended);
    cdr.boolean(frame.is_error);
    if (is_classical) {
      cdr.number(frame.size);
      cdr.byte_array(std::span(frame.data).first(8));
    } else {
      cdr.boolean(frame.is_fd);
      cdr.boolean(frame.is_bit_rate_switched);
      cdr.boolean(frame.is_error_state_indicated);
      cdr.byte_sequence(std::span(frame.data).first(std::min(frame.size, CanFrame::maximum_bytes)));
    }
  });
}

void RecordingWriter::put_bytes(const Event& event, bool is_sent) {
  if (event.channel >= byte_channel_count) {
    ++counters_.events_unknown;
    return;
  }
  const int channel = static_cast<int>(Topic::laser_a_rx) + 2 * event.channel + (is_sent ? 1 : 0);
  put_on(static_cast<std::uint16_t>(channel), event.stamp_ns, [&](CdrWriter& cdr) {
    cdr.time(event.stamp_ns);
    cdr.number(event.channel);
    cdr.boolean(is_sent);
    cdr.byte_sequence(event.bytes);
  });
}

void RecordingWriter::write_scan_info(const ScanRecord& scan) {
  put(Topic::scan_info, scan.reference_stamp_ns, [&](CdrWriter& cdr) {
    cdr.header(scan.reference_stamp_ns, "body");
    cdr.number(scan.number);
    cdr.number(scan.begin_stamp_ns);
    cdr.number(scan.end_stamp_ns);
    cdr.boolean(scan.was_mapped);
    cdr.string(scan.verdict);
    cdr.number(scan.map_index);
    cdr.boolean(scan.is_incomplete);
    cdr.number(scan.profiles);
    cdr.number(scan.profiles_missing);
    cdr.number(scan.rays_without_range);
    cdr.number(scan.points);
    cdr.number(scan.points_reduced);
    cdr.number(scan.head_turn_rad);
    cdr.number(scan.angle_sigma_rad);
    cdr.boolean(scan.has_odometry);
    cdr.pose(scan.odometry_from_body);
    cdr.boolean(scan.has_gps);
    for (int axis = 0; axis < 3; ++axis) cdr.number(scan.gps_position_m[axis]);
  });
}

bool RecordingWriter::write_cloud(const CloudRecord& cloud) {
  static_assert(sizeof(Point) == 12);
  constexpr std::uint8_t float32 = 7;
  return put(Topic::cloud, cloud.stamp_ns, [&](CdrWriter& cdr) {
    const auto count = static_cast<std::uint32_t>(cloud.points.size());
    cdr.header(cloud.stamp_ns, "body");
    cdr.number(std::uint32_t{1});  // height: not organised
    cdr.number(count);
    cdr.number(std::uint32_t{3});
    std::uint32_t offset = 0;
    for (const char* name : {"x", "y", "z"}) {
      cdr.string(name);
      cdr.number(offset);
      cdr.number(float32);
      cdr.number(std::uint32_t{1});
      offset += 4;
    }
    cdr.boolean(false);  // little endian
    cdr.number(std::uint32_t{sizeof(Point)});
    cdr.number(static_cast<std::uint32_t>(count * sizeof(Point)));
    cdr.byte_sequence(
        {reinterpret_cast<const std::uint8_t*>(cloud.points.data()), cloud.points.size_bytes()});
    cdr.boolean(true);  // no NaN in it
  });
}

void RecordingWriter::write_pose(const PoseRecord& pose) {
  put(Topic::pose, pose.stamp_ns, [&](CdrWriter& cdr) {
    cdr.header(pose.stamp_ns, "map");
    cdr.pose(pose.map_from_body);
  });
  put(Topic::transforms, pose.stamp_ns, [&](CdrWriter& cdr) {
    cdr.number(std::uint32_t{1});
    cdr.header(pose.stamp_ns, "map");
    cdr.string("body");
    cdr.pose(pose.map_from_body);  // a Transform's numbers are a Pose's
  });
}

void RecordingWriter::write_path(const PathRecord& path) {
  constexpr std::size_t pose_bytes = 8 + 8 + 7 * 8;  // stamp, "map", pose
  const std::size_t room = config_.chunk_bytes - std::min<std::size_t>(config_.chunk_bytes, 256);
  const std::size_t count = path.map_from_body.size();
  std::size_t step = 1;
  while (count / step * pose_bytes > room) step *= 2;
  if (step > 1) {
    ++counters_.paths_thinned;
    say(NoticeKind::thinned, "the path is longer than a chunk and is downsampled; poses of it", count);
  }
  put(Topic::path, path.stamp_ns, [&](CdrWriter& cdr) {
    cdr.header(path.stamp_ns, "map");
    const std::size_t place = cdr.count_later();
    std::uint32_t written = 0;
    // Counted from the end, so that the newest pose is there whatever the step.
    for (std::size_t i = count == 0 ? 0 : (count - 1) % step; i < count; i += step, ++written) {
      cdr.header(i < path.stamps_ns.size() ? path.stamps_ns[i] : path.stamp_ns, "map");
      cdr.pose(path.map_from_body[i]);
    }
    cdr.count(place, written);
  });
}

void RecordingWriter::write_loop(const LoopRecord& loop) {
  put(Topic::loops, loop.stamp_ns, [&](CdrWriter& cdr) {
    cdr.time(loop.stamp_ns);
    cdr.number(loop.first);
    cdr.number(loop.last);
    cdr.boolean(loop.is_closed);
    cdr.string(loop.verdict);
    cdr.number(loop.distance_m);
    cdr.number(loop.overlap);
    cdr.number(loop.rms_m);
    cdr.number(loop.mahalanobis2);
    cdr.number(loop.correction_m);
    cdr.number(loop.correction_rad);
    cdr.number(loop.iterations);
  });
}

void RecordingWriter::write_edge(const GraphEdgeRecord& edge) {
  put(Topic::graph_edges, edge.stamp_ns, [&](CdrWriter& cdr) {
    cdr.time(edge.stamp_ns);
    cdr.number(edge.from);
    cdr.number(edge.to);
    cdr.boolean(edge.closes_loop);
    cdr.pose(edge.from_from_to);
    cdr.number(edge.x_m2);
    cdr.number(edge.y_m2);
    cdr.number(edge.z_m2);
    cdr.number(edge.rotation_rad2);
  });
}

/// Up to the values, whose count comes next.
void RecordingWriter::begin_diagnostic(CdrWriter& cdr, const DiagnosticRecord& diagnostic) {
  cdr.header(diagnostic.stamp_ns, "");
  cdr.number(std::uint32_t{1});
  cdr.number(static_cast<std::uint8_t>(diagnostic.level));
  cdr.string(diagnostic.name);
  cdr.string(diagnostic.message);
  cdr.string("");  // hardware id
}

void RecordingWriter::write_diagnostics(const DiagnosticRecord& diagnostic) {
  put(Topic::diagnostics, diagnostic.stamp_ns, [&](CdrWriter& cdr) {
    begin_diagnostic(cdr, diagnostic);
    cdr.number(static_cast<std::uint32_t>(diagnostic.values.size()));
    for (const DiagnosticValue& value : diagnostic.values) {
      cdr.string(value.key);
      cdr.string(value.value);
    }
  });
}

void RecordingWriter::write_notice(const Notice& notice) {
  std::array<char, 24> digits{};
  const char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), notice.value).ptr;
  const DiagnosticValue value{"value", {digits.data(), static_cast<std::size_t>(end - digits.data())}};
  const auto level = static_cast<DiagnosticLevel>(notice.severity);  // info is their OK
  write_diagnostics({notice.stamp_ns, level, notice.source, notice.text,
                     notice.has_value ? std::span(&value, 1) : std::span<const DiagnosticValue>()});
}

}  // namespace alces
