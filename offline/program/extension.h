// Verbs of parts that are not always built (experiments/): they add themselves before main, main adds their
// verbs.
#pragma once

#include <CLI/CLI.hpp>
#include <vector>

namespace alces::offline {

using Extension = void (*)(CLI::App& alces);

void add_extension(Extension extension);
[[nodiscard]] const std::vector<Extension>& extensions();

}  // namespace alces::offline
