#include "alces_platform/recording/recording_reader.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>

#include "alces_platform/recording/channels.h"

namespace alces {

using recording::Topic;

namespace {

constexpr int foreign = -1;
constexpr int first_can_topic = static_cast<int>(Topic::can_rx);

/// MCAP stamps are unsigned; what does not fit ours stands for the end of time.
std::int64_t signed_ns(std::uint64_t stamp_ns) {
  return static_cast<std::int64_t>(std::min<std::uint64_t>(stamp_ns, INT64_MAX));
}

std::int64_t parse_integer(std::string_view text) {
  std::int64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

/// Nothing: a classical frame of more than 8 bytes, which there is none of.
std::optional<Event> decode_frame(CdrReader& cdr, int topic, std::int64_t stamp_ns) {
  const int place = (topic - first_can_topic) % recording::topics_per_can_bus;
  Event event;
  event.stamp_ns = stamp_ns;
  event.kind = place % 2 == 0 ? EventKind::can_frame : EventKind::can_sent;
  event.channel = static_cast<std::uint8_t>((topic - first_can_topic) / recording::topics_per_can_bus);
  static_cast<void>(cdr.header());
  CanFrame& frame = event.frame;
  frame.id = cdr.number<std::uint32_t>();
  frame.is_remote = cdr.boolean();
  frame.is_extended = cdr.boolean();
  frame.is_error = cdr.boolean();
  std::span<const std::uint8_t> data;
  if (place < 2) {
    frame.size = cdr.number<std::uint8_t>();
    data = cdr.byte_array(8);
    if (frame.size > data.size()) return std::nullopt;
  } else {
    frame.is_fd = cdr.boolean();
    frame.is_bit_rate_switched = cdr.boolean();
    frame.is_error_state_indicated = cdr.boolean();
    data = cdr.byte_sequence();
    frame.size = static_cast<std::uint8_t>(std::min<std::size_t>(data.size(), CanFrame::maximum_bytes));
    data = data.first(frame.size);
  }
  std::ranges::copy(data, frame.data.begin());
  return event;
}

Event decode_bytes(CdrReader& cdr, std::int64_t stamp_ns) {
  Event event;
  event.stamp_ns = stamp_ns;
  static_cast<void>(cdr.time());
  event.channel = cdr.number<std::uint8_t>();
  event.kind = cdr.boolean() ? EventKind::bytes_sent : EventKind::bytes;
  event.bytes = cdr.byte_sequence();
  return event;
}

LoopRecord decode_loop(CdrReader& cdr, std::int64_t stamp_ns) {
  LoopRecord loop;
  loop.stamp_ns = stamp_ns;
  static_cast<void>(cdr.time());
  loop.first = cdr.number<std::uint32_t>();
  loop.last = cdr.number<std::uint32_t>();
  loop.is_closed = cdr.boolean();
  loop.verdict = cdr.string();
  loop.distance_m = cdr.number<double>();
  loop.overlap = cdr.number<double>();
  loop.rms_m = cdr.number<double>();
  loop.mahalanobis2 = cdr.number<double>();
  loop.correction_m = cdr.number<double>();
  loop.correction_rad = cdr.number<double>();
  loop.iterations = cdr.number<std::uint32_t>();
  return loop;
}

GraphEdgeRecord decode_graph_edge(CdrReader& cdr, std::int64_t stamp_ns) {
  GraphEdgeRecord edge;
  edge.stamp_ns = stamp_ns;
  static_cast<void>(cdr.time());
  edge.from = cdr.number<std::uint32_t>();
  edge.to = cdr.number<std::uint32_t>();
  edge.closes_loop = cdr.boolean();
  edge.from_from_to = cdr.pose();
  edge.x_m2 = cdr.number<double>();
  edge.y_m2 = cdr.number<double>();
  edge.z_m2 = cdr.number<double>();
  edge.rotation_rad2 = cdr.number<double>();
  return edge;
}

/// None: somebody else's. "/tf" is everybody's topic; ours have one transform, of the body in the map.
std::optional<TransformRecord> decode_transform(CdrReader& cdr, std::int64_t stamp_ns) {
  if (cdr.number<std::uint32_t>() != 1) return std::nullopt;
  static_cast<void>(cdr.time());
  const bool is_ours = cdr.string() == "map" && cdr.string() == "body";
  if (!is_ours) return std::nullopt;
  return TransformRecord{stamp_ns, cdr.pose()};
}

}  // namespace

bool RecordingReader::open() {
  return mcap_.open();
}

/// A channel is ours when both its topic and its type are.
int RecordingReader::topic_of(std::uint16_t channel) {
  if (const auto known = topics_.find(channel); known != topics_.end()) return known->second;
  const mcap::ReadChannel& read = mcap_.channels().at(channel);
  const auto ours = recording::channels(recording::maximum_can_buses);
  int topic = foreign;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    if (ours[i].topic == read.topic && recording::schemas()[ours[i].schema].name == read.schema &&
        read.message_encoding == "cdr")
      topic = static_cast<int>(i);
  }
  topics_.emplace(channel, topic);
  return topic;
}

bool RecordingReader::next(RecordedMessage& message) {
  mcap::ReadMessage raw;
  while (mcap_.next(raw)) {
    const auto [expected, is_new] = next_sequence_.try_emplace(raw.channel, 0);
    const int topic = topic_of(raw.channel);
    if (topic != foreign && raw.sequence > expected->second)
      counters_.messages_missing += raw.sequence - expected->second;
    expected->second = raw.sequence + 1;

    message.channel = raw.channel;
    message.bytes = raw.data.size();
    message.handed_on_ns = signed_ns(raw.log_time_ns);
    if (!decode(topic, raw, message)) {
      ++counters_.messages_malformed;
      continue;
    }
    if (std::holds_alternative<Event>(message.content)) {
      ++counters_.events;
    } else if (std::holds_alternative<ForeignRecord>(message.content)) {
      ++counters_.foreign;
    } else {
      ++counters_.results;
    }
    return true;
  }
  return false;
}

bool RecordingReader::next_event(Event& event) {
  RecordedMessage message;
  while (next(message)) {
    if (const Event* found = std::get_if<Event>(&message.content)) {
      event = *found;
      return true;
    }
  }
  return false;
}

bool RecordingReader::decode(int topic, const mcap::ReadMessage& raw, RecordedMessage& message) {
  if (topic == foreign) {
    message.content = ForeignRecord{};
    return true;
  }
  CdrReader cdr(raw.data);
  // The exact stamp: a message's own has 32 bits of seconds.
  const std::int64_t stamp_ns = signed_ns(raw.publish_time_ns);
  Event event;
  event.stamp_ns = stamp_ns;
  if (topic >= first_can_topic) {
    const std::optional<Event> frame = decode_frame(cdr, topic, stamp_ns);
    if (frame) message.content = *frame;
    return frame.has_value() && !cdr.failed();
  }
  switch (static_cast<Topic>(topic)) {
    case Topic::tick:
    case Topic::stop:
      event.kind = static_cast<Topic>(topic) == Topic::tick ? EventKind::tick : EventKind::stop;
      static_cast<void>(cdr.time());
      message.content = event;
      break;
    case Topic::orders: {
      event.kind = EventKind::order;
      static_cast<void>(cdr.time());
      const auto order = cdr.number<std::uint8_t>();
      event.is_up = cdr.boolean();
      event.order = static_cast<MotorOrder>(order);
      if (order <= static_cast<std::uint8_t>(MotorOrder::resumed)) {
        message.content = event;
      } else {
        message.content = ForeignRecord{};
      }
      break;
    }
    case Topic::syncs:
      event.kind = EventKind::sync_sent;
      static_cast<void>(cdr.time());
      event.channel = cdr.number<std::uint8_t>();
      message.content = event;
      break;
    case Topic::edges:
    case Topic::edges_lost:
      static_cast<void>(cdr.time());
      event.channel = cdr.number<std::uint8_t>();
      event.edge.line = cdr.number<std::uint8_t>();
      if (static_cast<Topic>(topic) == Topic::edges) {
        event.kind = EventKind::edge;
        event.edge.is_rising = cdr.boolean();
        event.edge.sequence = cdr.number<std::uint32_t>();
      } else {
        event.kind = EventKind::edges_lost;
        event.lost_count = cdr.number<std::uint32_t>();
      }
      message.content = event;
      break;
    case Topic::links:
      static_cast<void>(cdr.time());
      event.kind = cdr.number<std::uint8_t>() == 0 ? EventKind::can_link : EventKind::byte_link;
      event.channel = cdr.number<std::uint8_t>();
      event.is_up = cdr.boolean();
      message.content = event;
      break;
    case Topic::laser_a_rx:
    case Topic::laser_a_tx:
    case Topic::laser_b_rx:
    case Topic::laser_b_tx:
    case Topic::gps_rx:
    case Topic::gps_tx:
      message.content = decode_bytes(cdr, stamp_ns);
      break;
    case Topic::scan_info:
      message.content = decode_scan(cdr, stamp_ns);
      break;
    case Topic::cloud:
      message.content = decode_cloud(cdr, stamp_ns);
      break;
    case Topic::pose: {
      static_cast<void>(cdr.header());
      message.content = PoseRecord{stamp_ns, cdr.pose()};
      break;
    }
    case Topic::transforms:
      message.content = ForeignRecord{};
      if (const auto transform = decode_transform(cdr, stamp_ns)) message.content = *transform;
      break;
    case Topic::path:
      message.content = decode_path(cdr, stamp_ns);
      break;
    case Topic::loops:
      message.content = decode_loop(cdr, stamp_ns);
      break;
    case Topic::graph_edges:
      message.content = decode_graph_edge(cdr, stamp_ns);
      break;
    case Topic::diagnostics:
      message.content = decode_diagnostic(cdr, stamp_ns);
      break;
    default:
      return false;
  }
  return !cdr.failed();
}

ScanRecord RecordingReader::decode_scan(CdrReader& cdr, std::int64_t stamp_ns) const {
  ScanRecord scan;
  scan.reference_stamp_ns = stamp_ns;
  static_cast<void>(cdr.header());
  scan.number = cdr.number<std::uint32_t>();
  scan.begin_stamp_ns = cdr.number<std::int64_t>();
  scan.end_stamp_ns = cdr.number<std::int64_t>();
  scan.was_mapped = cdr.boolean();
  scan.verdict = cdr.string();
  scan.map_index = cdr.number<std::uint32_t>();
  scan.is_incomplete = cdr.boolean();
  scan.profiles = cdr.number<std::uint32_t>();
  scan.profiles_missing = cdr.number<std::uint32_t>();
  scan.rays_without_range = cdr.number<std::uint32_t>();
  scan.points = cdr.number<std::uint32_t>();
  scan.points_reduced = cdr.number<std::uint32_t>();
  scan.head_turn_rad = cdr.number<double>();
  scan.angle_sigma_rad = cdr.number<double>();
  scan.has_odometry = cdr.boolean();
  scan.odometry_from_body = cdr.pose();
  scan.has_gps = cdr.boolean();
  for (int axis = 0; axis < 3; ++axis) scan.gps_position_m[axis] = cdr.number<double>();
  return scan;
}

/// Our own layout of the points, x y z float32 without gaps; another one does not decode.
CloudRecord RecordingReader::decode_cloud(CdrReader& cdr, std::int64_t stamp_ns) {
  static_cast<void>(cdr.header());
  static_cast<void>(cdr.number<std::uint32_t>());
  const auto count = cdr.number<std::uint32_t>();
  const std::uint32_t fields = cdr.count(12);
  for (std::uint32_t field = 0; field < fields; ++field) {
    static_cast<void>(cdr.string());
    static_cast<void>(cdr.number<std::uint32_t>());
    static_cast<void>(cdr.number<std::uint8_t>());
    static_cast<void>(cdr.number<std::uint32_t>());
  }
  static_cast<void>(cdr.boolean());
  const auto point_bytes = cdr.number<std::uint32_t>();
  static_cast<void>(cdr.number<std::uint32_t>());
  const std::span<const std::uint8_t> data = cdr.byte_sequence();
  points_.clear();
  if (fields == 3 && point_bytes == sizeof(Point) && data.size() == std::size_t{count} * sizeof(Point)) {
    points_.resize(count);
    if (count > 0) std::memcpy(points_.data(), data.data(), data.size());
  } else {
    cdr = CdrReader({});  // failed
  }
  return {stamp_ns, points_};
}

PathRecord RecordingReader::decode_path(CdrReader& cdr, std::int64_t stamp_ns) {
  static_cast<void>(cdr.header());
  const std::uint32_t count = cdr.count(8 + 4 + 1 + 7 * 8);
  poses_.clear();
  stamps_ns_.clear();
  for (std::uint32_t i = 0; i < count && !cdr.failed(); ++i) {
    stamps_ns_.push_back(cdr.header());
    poses_.push_back(cdr.pose());
  }
  return {stamp_ns, stamps_ns_, poses_};
}

DiagnosticRecord RecordingReader::decode_diagnostic(CdrReader& cdr, std::int64_t stamp_ns) {
  static_cast<void>(cdr.header());
  DiagnosticRecord diagnostic;
  diagnostic.stamp_ns = stamp_ns;
  if (cdr.number<std::uint32_t>() != 1) {  // ours have one status
    cdr = CdrReader({});
    return diagnostic;
  }
  diagnostic.level = static_cast<DiagnosticLevel>(cdr.number<std::uint8_t>());
  diagnostic.name = cdr.string();
  diagnostic.message = cdr.string();
  static_cast<void>(cdr.string());
  const std::uint32_t count = cdr.count(10);
  values_.clear();
  for (std::uint32_t i = 0; i < count && !cdr.failed(); ++i) {
    const std::string_view key = cdr.string();
    values_.push_back({key, cdr.string()});
  }
  diagnostic.values = values_;
  return diagnostic;
}

std::string RecordingReader::configuration() const {
  const auto found = mcap_.attachments().find(std::string(recording::configuration_name));
  return found == mcap_.attachments().end() ? std::string() : found->second;
}

std::int64_t RecordingReader::utc_offset_ns() const {
  const auto record = mcap_.metadata().find(std::string(recording::metadata_name));
  if (record == mcap_.metadata().end()) return 0;
  const auto entry = record->second.find(std::string(recording::utc_offset_key));
  return entry == record->second.end() ? 0 : parse_integer(entry->second);
}

std::uint8_t RecordingReader::can_bus_count() const {
  std::uint8_t count = 0;
  for (const auto& [id, channel] : mcap_.channels()) {
    for (std::uint8_t bus = count; bus < recording::maximum_can_buses; ++bus) {
      if (channel.topic == "/can" + std::to_string(bus) + "/rx") count = static_cast<std::uint8_t>(bus + 1);
    }
  }
  return count;
}

RecordingSummary summarise_recording(ByteSource& source) {
  RecordingReader reader(source);
  RecordingSummary summary;
  summary.is_recording = reader.open();
  std::map<std::uint16_t, RecordingSummary::Topic> topics;
  RecordedMessage message;
  bool has_begun = false;
  while (reader.next(message)) {
    ++summary.messages;
    // others' clocks say nothing of the drive
    if (!std::holds_alternative<ForeignRecord>(message.content)) {
      if (!has_begun) summary.begin_ns = message.handed_on_ns;
      has_begun = true;
      summary.end_ns = message.handed_on_ns;
    }
    RecordingSummary::Topic& topic = topics[message.channel];
    ++topic.messages;
    topic.bytes += message.bytes;
  }
  for (auto& [id, topic] : topics) {
    const mcap::ReadChannel& channel = reader.file().channels().at(id);
    topic.name = channel.topic;
    topic.type = channel.schema;
    summary.topics.push_back(std::move(topic));
  }
  summary.bytes = reader.file().counters().bytes;
  summary.messages_missing = reader.counters().messages_missing;
  summary.utc_offset_ns = reader.utc_offset_ns();
  summary.has_configuration = !reader.configuration().empty();
  summary.is_whole = reader.is_whole() && source.error_number() == 0;
  summary.read_error = source.error_number();
  summary.problems = reader.problems();
  return summary;
}

}  // namespace alces
