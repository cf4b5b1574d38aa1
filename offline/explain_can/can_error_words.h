// The kernel's error frames in words (linux/can/error.h): what the identifier's class bits and the eight
// bytes say.
#pragma once

#include <string>

#include "alces_drivers/can_frame.h"

namespace alces::offline {

[[nodiscard]] std::string can_error_words(const CanFrame& frame);

}  // namespace alces::offline
