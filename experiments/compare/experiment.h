// The paper's experiment (section 4) on anybody's data: the same scans through every strategy, each into a
// map folder of its own.
//
// The scans are read once (SpooledScanSource). Every online row is a MapRun of its own with the same settings
// but for what closes its loops; rows that post-process start from the ELCH row's map, which is therefore
// made whenever one of them is asked for. LUM runs in LOA's place as the paper's Figure 3 has it: all scans
// so far are relaxed when an approach to an earlier place ends, so its row asks for one loop an approach
// (trigger.repeat_after_scans = 0); otherwise it would relax dozens of times for the same street.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/map_folder/map_folder.h"
#include "offline/io/scans/spooled_scan_source.h"
#include "offline/map/map_run.h"
#include "offline/optimize/lum/settings.h"
#include "row_result.h"
#include "truth.h"

namespace alces::offline {

struct ExperimentRequest {
  MapRequest map;  ///< memory as one run has it; an archive is put below `out`
  LumSettings lum;
  std::vector<CompareRow> rows;
  std::filesystem::path out;
  std::optional<ScanTruth> truth;
  std::vector<std::size_t> watched;  ///< places in the source; empty with ground truth: chosen
  bool measures_consistency = false;
  std::optional<std::vector<ScanPair>> revisits;  ///< of the map's scans; none: found in the best row's poses
  ProgramFacts program;                           ///< for each map folder's run.json
};

struct ExperimentCallbacks {
  std::function<void(std::string_view row, std::string_view stage, std::size_t done, std::size_t total)>
      progress;
  std::function<void(const RowResult&)> finished;  ///< a row, its map folder written
  std::function<int()> stop_signal;                ///< 0: go on
};

struct ExperimentResult {
  std::vector<RowResult> rows;  ///< finished ones, in order
  std::vector<std::string> warnings;
  std::optional<Error> problem;  ///< what ended it early; the rows before are whole
};

/// Errors of one row end the experiment and stand in `problem`; the rows before are whole.
[[nodiscard]] ExperimentResult run_experiment(SpooledScanSource& scans, const ExperimentRequest& request,
                                              const ExperimentCallbacks& callbacks = {});

}  // namespace alces::offline
