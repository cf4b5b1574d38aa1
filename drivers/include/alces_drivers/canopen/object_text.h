// Names of the objects that a motor's configuration touches: CiA 301 and CiA 402-2.
#pragma once

#include <cstdint>

namespace alces::canopen {

/// Never null; static storage. Of any axis. One that is not known here says so.
[[nodiscard]] const char* object_text(std::uint16_t index);

}  // namespace alces::canopen
