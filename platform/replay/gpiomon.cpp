#include "alces_platform/replay/gpiomon.h"

#include <algorithm>
#include <utility>

namespace alces::replay {
namespace {

struct Line {
  std::int64_t stamp_ns = 0;
  bool is_rising = false;
  std::string_view offset;  ///< may be empty when there is a name
  std::string_view name;
};

bool parse_version_1(Words& words, Line& line) {
  const std::string_view direction = words.next();
  line.is_rising = direction == "RISING";
  if (!line.is_rising && direction != "FALLING") return false;
  if (words.next() != "EDGE" || words.next() != "offset:") return false;
  line.offset = words.next();
  return words.next() == "timestamp:" && parse_seconds(words.bracketed('[', ']'), line.stamp_ns);
}

bool parse_version_2(std::string_view stamp, Words& words, Line& line) {
  if (!parse_seconds(stamp, line.stamp_ns) && !parse_date(stamp, line.stamp_ns)) return false;
  const std::string_view direction = words.next();
  line.is_rising = direction == "rising";
  if (!line.is_rising && direction != "falling") return false;
  std::string_view rest = words.rest();
  std::uint64_t offset = 0;
  // "chip offset", perhaps a name behind it; or the name alone
  Words parts(rest);
  static_cast<void>(parts.next());
  const std::string_view second = parts.next();
  if (!rest.empty() && rest.front() != '"' && parse_unsigned(second, offset)) {
    line.offset = second;
    rest = parts.rest();
  }
  if (rest.size() >= 2 && rest.front() == '"' && rest.back() == '"') rest = rest.substr(1, rest.size() - 2);
  line.name = rest;
  return !line.offset.empty() || !line.name.empty();
}

bool parse_line(std::string_view text, Line& line) {
  Words words(text);
  const std::string_view first = words.next();
  if (first == "event:") return parse_version_1(words, line);
  return parse_version_2(first, words, line);
}

/// The banner, and the lines' first states.
bool is_remark(std::string_view line) {
  return line.empty() || line.front() == '#' || line.starts_with("Monitoring line") ||
         line.find("=active") != std::string_view::npos || line.find("=inactive") != std::string_view::npos;
}

}  // namespace

GpiomonReader::GpiomonReader(const std::filesystem::path& file, GpiomonOptions options)
    : lines_(file), options_(std::move(options)) {}

bool GpiomonReader::is_edge(std::string_view line) {
  Line parsed;
  return parse_line(line, parsed);
}

bool GpiomonReader::next(Event& event) {
  std::string_view text;
  while (lines_.next(text)) {
    if (is_remark(text)) continue;
    Line line;
    if (!parse_line(text, line)) {
      problems_.add(lines_.problem("this is no edge as gpiomon writes it"));
      continue;
    }
    std::uint64_t number = 0;
    if (options_.lines.empty()) {
      if (!parse_unsigned(line.offset, number) || number > 255) {
        problems_.add(lines_.problem("which line this is must be said: name the lines in their order"));
        continue;
      }
    } else {
      const auto found = std::ranges::find_if(options_.lines, [&](const std::string& configured) {
        return !configured.empty() && (configured == line.offset || configured == line.name);
      });
      if (found == options_.lines.end()) {
        problems_.add(lines_.problem("an edge on a line that is none of the configured ones"));
        continue;
      }
      number = static_cast<std::uint64_t>(found - options_.lines.begin());
    }
    event = {};
    event.kind = EventKind::edge;
    event.stamp_ns = line.stamp_ns;
    event.edge.line = static_cast<std::uint8_t>(number);
    event.edge.is_rising = line.is_rising;
    return true;
  }
  return false;
}

void append_gpiomon(std::string& text, const Event& event, std::string_view line, GpiomonForm form) {
  if (form == GpiomonForm::libgpiod_1) {
    text += event.edge.is_rising ? "event:  RISING EDGE offset: " : "event: FALLING EDGE offset: ";
    text += line;
    text += " timestamp: [";
    append_seconds(text, event.stamp_ns, 9, 8, ' ');
    text += "]\n";
    return;
  }
  append_seconds(text, event.stamp_ns, 9, 1, '0');
  text += event.edge.is_rising ? "\trising\tgpiochip0 " : "\tfalling\tgpiochip0 ";
  text += line;
  text += '\n';
}

}  // namespace alces::replay
