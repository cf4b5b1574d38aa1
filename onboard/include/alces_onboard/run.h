// alcesd from its options to its end.
#pragma once

#include <cstdio>

#include "alces_onboard/orderly_stop.h"
#include "alces_onboard/plan.h"

namespace alces::onboard {

/// Runs until it is told to stop (SIGTERM, SIGINT), or, with is_dry_run, prints the plan to `out` and
/// returns. Error when it cannot start.
void run(const Options& options, const char* version, std::FILE* out);

/// As the exit status of a process: run(), and what it throws as one sentence on standard error.
[[nodiscard]] int run_as_program(const Options& options, const char* version);

}  // namespace alces::onboard
