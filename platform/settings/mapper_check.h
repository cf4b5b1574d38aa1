// Numbers of a mapper that are in their ranges, but not together.
#pragma once

#include "alces/mapper.h"

namespace alces::settings {

class TomlReader;

/// Error, with the line, where the file has one of them.
void check_mapper(const MapperConfig& config, const TomlReader& reader);

}  // namespace alces::settings
