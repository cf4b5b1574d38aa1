// candump's text, one CAN frame a line: the forms are those of alces_platform/replay/candump.h.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "alces_drivers/can_frame.h"
#include "alces_platform/replay/event_source.h"

namespace alces::offline {

struct CandumpLine {
  std::size_t line = 0;
  /// As the file has it: since 1970, since the start, or since the frame before.
  std::optional<double> stamp_s;
  std::string channel;
  CanFrame frame;
};

struct CandumpRead {
  std::size_t frames = 0;
  /// Lines that are no frames (DROPCOUNT, a prompt, a cut end): the first sentences, and how many.
  replay::TraceProblems passed_over;
};

/// Calls `take` for each frame in the file's order. Empty lines, comments (#) and the indented details that
/// candump -e prints below an error frame are passed over. InputError where there is no frame at all.
CandumpRead read_candump(const std::filesystem::path& file,
                         const std::function<void(const CandumpLine&)>& take);

}  // namespace alces::offline
