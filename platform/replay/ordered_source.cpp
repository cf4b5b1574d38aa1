#include "ordered_source.h"

#include <cstdlib>
#include <utility>

#include "alces_drivers/stamp.h"
#include "alces_platform/replay/trace_writer.h"

namespace alces::replay {
namespace {

bool parse_byte(std::string_view text, std::uint8_t& byte) {
  std::uint64_t value = 0;
  if (!parse_unsigned(text, value) || value > 255) return false;
  byte = static_cast<std::uint8_t>(value);
  return true;
}

bool parse_word(std::string_view text, std::uint32_t& word) {
  std::uint64_t value = 0;
  if (!parse_unsigned(text, value) || value > UINT32_MAX) return false;
  word = static_cast<std::uint32_t>(value);
  return true;
}

}  // namespace

OrderedSource::OrderedSource(const std::filesystem::path& order) : order_(order) {}

void OrderedSource::add(const std::string& what, std::unique_ptr<EventSource> source) {
  sources_[what] = std::move(source);
}

void OrderedSource::refuse(const std::string& what) const {
  throw TraceError(order_.problem(what) +
                   "; remove this file to have the traces merged by their time stamps");
}

bool OrderedSource::next(Event& event) {
  std::string_view line;
  while (order_.next(line)) {
    if (line.empty() || line.front() == '#') continue;
    Words words(line);
    std::int64_t stamp_ns = 0;
    if (!parse_signed(words.next(), stamp_ns) || !read_entry(words, stamp_ns, event))
      refuse("an entry is a stamp in ns and what happened then");
    return true;
  }
  if (!ended_) end();
  return false;
}

bool OrderedSource::read_entry(Words& words, std::int64_t stamp_ns, Event& event) {
  const std::string what(words.next());
  const std::string_view first = words.next();
  const std::string_view second = words.next();
  const std::string_view third = words.next();
  if (!words.next().empty()) return false;

  event = {};
  event.stamp_ns = stamp_ns;
  const bool is_bus = what.size() == 4 && what.starts_with("can") && what[3] >= '0' && what[3] <= '9';
  if (what == "tick") return first.empty();
  if (what == "stop") {
    event.kind = EventKind::stop;
    return first.empty();
  }
  if (what == "order") {
    event.kind = EventKind::order;
    std::uint8_t order = 0;
    std::uint8_t is_up = 0;
    if (!parse_byte(first, order) || !parse_byte(second, is_up) || !third.empty()) return false;
    event.order = static_cast<MotorOrder>(order);
    event.is_up = is_up != 0;
    return order <= static_cast<std::uint8_t>(MotorOrder::resumed);
  }
  if (what == "sync_sent") {
    event.kind = EventKind::sync_sent;
    return parse_byte(first, event.channel) && second.empty();
  }
  if (what == "edges_lost") {
    event.kind = EventKind::edges_lost;
    return parse_byte(first, event.channel) && parse_byte(second, event.edge.line) &&
           parse_word(third, event.lost_count);
  }
  if (first == "up" || first == "down") {
    const int channel = byte_channel_of(what);
    if (!is_bus && channel < 0) return false;
    event.kind = is_bus ? EventKind::can_link : EventKind::byte_link;
    event.channel = is_bus ? static_cast<std::uint8_t>(what[3] - '0') : static_cast<std::uint8_t>(channel);
    event.is_up = first == "up";
    return second.empty();
  }

  const auto source = sources_.find(what);
  if (source == sources_.end()) refuse("the file with this is missing");
  const bool is_edge = what == "edge";
  std::uint8_t edge_channel = 0;
  GpioEdge edge;
  if (is_edge) {
    if (!parse_byte(first, edge_channel) || !parse_byte(second, edge.line) ||
        !parse_word(third, edge.sequence))
      return false;
  } else if (!first.empty()) {
    return false;
  }
  if (!source->second->next(event)) refuse("the file with this has fewer entries");
  // candump has whole microseconds
  if (std::llabs(event.stamp_ns - stamp_ns) >= (is_bus ? ns_per_us : 1))
    refuse("the file with this has another time stamp here");
  event.stamp_ns = stamp_ns;
  if (is_bus) event.channel = static_cast<std::uint8_t>(what[3] - '0');
  if (is_edge) {
    edge.is_rising = event.edge.is_rising;
    event.edge = edge;
    event.channel = edge_channel;
  }
  return true;
}

void OrderedSource::end() {
  ended_ = true;
  Event event;
  for (const auto& [what, source] : sources_) {
    std::uint64_t left = 0;
    while (source->next(event)) ++left;
    if (left > 0)
      problems_.add(source->name() + ": has " + std::to_string(left) + " entries that " + order_.name() +
                    " does not know; they are left out");
  }
}

TraceProblems OrderedSource::problems() const {
  TraceProblems problems = problems_;
  for (const auto& [what, source] : sources_) problems.add(source->problems());
  return problems;
}

std::uint64_t OrderedSource::bytes_read() const {
  std::uint64_t bytes = order_.bytes_read();
  for (const auto& [what, source] : sources_) bytes += source->bytes_read();
  return bytes;
}

}  // namespace alces::replay
