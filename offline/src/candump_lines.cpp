#include "alces_offline/candump_lines.h"

#include "alces_offline/error.h"
#include "alces_platform/replay/candump_line.h"
#include "alces_platform/replay/line_reader.h"

namespace alces::offline {
namespace {

replay::LineReader open_lines(const std::filesystem::path& file) {
  try {
    return replay::LineReader(file);
  } catch (const replay::TraceError& error) {
    throw InputError(error.what());
  }
}

}  // namespace

std::size_t read_candump(const std::filesystem::path& file,
                         const std::function<void(const CandumpLine&)>& take) {
  replay::LineReader lines = open_lines(file);
  std::size_t frames = 0;
  std::string_view text;
  while (lines.next(text)) {
    if (replay::is_candump_remark(text)) continue;
    replay::CandumpLine parsed;
    if (const std::string wrong = replay::parse_candump_line(text, parsed); !wrong.empty())
      throw InputError(file, lines.number(), wrong);
    CandumpLine line;
    line.line = lines.number();
    if (parsed.stamp_ns) line.stamp_s = 1e-9 * static_cast<double>(*parsed.stamp_ns);
    line.channel = parsed.interface;
    line.frame = parsed.frame;
    take(line);
    ++frames;
  }
  if (frames == 0) throw InputError(file, "holds no CAN frame; candump's text is needed here");
  return frames;
}

}  // namespace alces::offline
