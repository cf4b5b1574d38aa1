// candump's text: one CAN frame a line.
//   (1436509052.249713) can0 181#2104FFFF00000000        candump -l, -L: 123#R4 remote, 123##3DEAD FD with
//   flags
//     can0  181   [8]  21 04 FF FF 00 00 00 00            candump on a screen; with -t a, z, d, A a time
//     before it
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "alces_drivers/can_frame.h"

namespace alces::offline {

struct CandumpLine {
  std::size_t line = 0;
  std::optional<double>
      stamp_s;  ///< as the file has it: since 1970, since the start, or since the frame before
  std::string channel;
  CanFrame frame;
};

/// Calls `take` for each frame in the file's order and returns how many there were. Empty lines, comments (#)
/// and the indented details that candump -e prints below an error frame are passed over. InputError names the
/// line.
std::size_t read_candump(const std::filesystem::path& file,
                         const std::function<void(const CandumpLine&)>& take);

}  // namespace alces::offline
