// `alces reference`: Poses from matching a drive to a map that is known: ground truth.
#pragma once

#include <CLI/CLI.hpp>

namespace alces::offline {

void add_reference_command(CLI::App& alces);

}  // namespace alces::offline
