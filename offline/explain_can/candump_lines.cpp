#include "candump_lines.h"

#include "alces_platform/replay/candump_line.h"
#include "alces_platform/replay/line_reader.h"
#include "offline/io/files/error.h"

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

CandumpRead read_candump(const std::filesystem::path& file,
                         const std::function<void(const CandumpLine&)>& take) {
  replay::LineReader lines = open_lines(file);
  CandumpRead read;
  std::string_view text;
  const auto next = [&] {
    try {
      return lines.next(text);
    } catch (const replay::TraceError& error) {
      throw InputError(error.what());
    }
  };
  while (next()) {
    if (replay::is_candump_remark(text)) continue;
    replay::CandumpLine parsed;
    if (const std::string wrong = replay::parse_candump_line(text, parsed); !wrong.empty()) {
      read.passed_over.add(lines.problem(wrong));
      continue;
    }
    CandumpLine line;
    line.line = lines.number();
    if (parsed.stamp_ns) line.stamp_s = 1e-9 * static_cast<double>(*parsed.stamp_ns);
    line.channel = parsed.interface;
    line.frame = parsed.frame;
    take(line);
    ++read.frames;
  }
  if (read.frames == 0) {
    const auto& sentences = read.passed_over.sentences;
    throw sentences.empty()
        ? InputError(file, "holds no CAN frame; candump's text is needed here")
        : InputError("holds no CAN frame; candump's text is needed here: " + sentences.front());
  }
  return read;
}

}  // namespace alces::offline
