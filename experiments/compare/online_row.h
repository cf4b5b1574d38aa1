// A row's way through the drive: one MapRun.
#pragma once

#include <filesystem>

#include "experiment.h"

namespace alces::offline {

/// Maps all scans and writes the map folder. Whatever stops the run (Ctrl-C included) is thrown as an Error,
/// and no map folder is written.
[[nodiscard]] RowResult run_online_row(const CompareRow& row, SpooledScanSource& scans,
                                       const ExperimentRequest& request,
                                       const ExperimentCallbacks& callbacks);

/// The sentence and the exit status of a row that a signal has ended.
[[nodiscard]] Error interrupted(const CompareRow& row, int signal);

}  // namespace alces::offline
