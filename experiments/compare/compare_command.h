// `alces compare`: ICP, LUM, ELCH, TORO and HOG-Man over one drive: the tables of the paper.
#pragma once

#include <CLI/CLI.hpp>

namespace alces::offline {

void add_compare_command(CLI::App& alces);

}  // namespace alces::offline
