#include "alces_platform/replay/nmea_trace.h"

#include "alces_drivers/stamp.h"

namespace alces::replay {
namespace {

constexpr std::int64_t day_ns = 86'400 * ns_per_s;

/// "hhmmss" or "hhmmss.sss" in the field after the sentence's name: GGA, RMC, and most others that have a
/// time. -1: none.
std::int64_t time_of_day_ns(std::string_view sentence) {
  const std::size_t comma = sentence.find(',');
  if (comma == std::string_view::npos) return -1;
  std::string field(sentence.substr(comma + 1, sentence.find(',', comma + 1) - comma - 1));
  if (field.size() < 6 || (field.size() > 6 && field[6] != '.')) return -1;
  std::uint64_t hour = 0;
  std::uint64_t minute = 0;
  std::int64_t second_ns = 0;
  field += field.size() == 6 ? ".0" : "";
  if (field.back() == '.') field += '0';
  const std::string_view text = field;
  if (!parse_unsigned(text.substr(0, 2), hour) || !parse_unsigned(text.substr(2, 2), minute) ||
      !parse_seconds(text.substr(4), second_ns) || hour > 23 || minute > 59 || second_ns >= 61 * ns_per_s)
    return -1;
  return static_cast<std::int64_t>(hour * 60 + minute) * 60 * ns_per_s + second_ns;
}

bool parse_line(std::string_view text, std::string_view& sentence, std::int64_t& stamp_ns, bool& has_stamp) {
  Words words(text);
  std::string_view stamp = words.bracketed('(', ')');
  std::string_view rest = words.rest();
  if (stamp.empty() && !rest.empty() && rest.front() != '$' && rest.front() != '!') {
    Words parts(rest);
    stamp = parts.next();
    rest = parts.rest();
  }
  has_stamp = !stamp.empty();
  if (has_stamp && !parse_seconds(stamp, stamp_ns) && !parse_date(stamp, stamp_ns)) return false;
  sentence = rest;
  return rest.size() >= 6 && (rest.front() == '$' || rest.front() == '!');
}

}  // namespace

bool NmeaTraceReader::is_sentence(std::string_view line) {
  std::string_view sentence;
  std::int64_t stamp_ns = 0;
  bool has_stamp = false;
  return parse_line(line, sentence, stamp_ns, has_stamp);
}

bool NmeaTraceReader::next(Event& event) {
  std::string_view line;
  while (lines_.next(line)) {
    if (line.empty() || line.front() == '#') continue;
    std::string_view sentence;
    std::int64_t stamp_ns = 0;
    bool has_stamp = false;
    if (!parse_line(line, sentence, stamp_ns, has_stamp)) {
      problems_.add(lines_.problem("this is no NMEA sentence"));
      continue;
    }
    if (!has_stamp) {
      stamp_ns = last_stamp_ns_;
      if (const std::int64_t now_ns = time_of_day_ns(sentence); now_ns >= 0) {
        // Over midnight the day begins again; a step back is one of the receiver's clock.
        const std::int64_t passed_ns =
            last_time_of_day_ns_ < 0 ? 0 : (now_ns - last_time_of_day_ns_ + day_ns) % day_ns;
        if (passed_ns < day_ns / 2) stamp_ns += passed_ns;
        last_time_of_day_ns_ = now_ns;
      }
    }
    last_stamp_ns_ = stamp_ns;
    sentence_ = sentence;
    sentence_ += "\r\n";
    event = {};
    event.kind = EventKind::bytes;
    event.channel = gps_channel;
    event.stamp_ns = stamp_ns;
    event.bytes = {reinterpret_cast<const std::uint8_t*>(sentence_.data()), sentence_.size()};
    return true;
  }
  return false;
}

}  // namespace alces::replay
