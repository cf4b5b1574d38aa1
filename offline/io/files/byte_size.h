// Sizes as people write them: 64MiB, 16 MiB, 65536, 1.5GB.
#pragma once

#include "alces_platform/settings/byte_size.h"

namespace alces::offline {

using settings::format_byte_size;
using settings::parse_byte_size;

}  // namespace alces::offline
