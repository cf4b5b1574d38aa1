// What comes after the drive: LUM, TORO or HOG-Man on a finished map.
#pragma once

#include <optional>

#include "experiment.h"
#include "link_matching.h"

namespace alces::offline {

/// The links' matches, which rows with the same map share; their time counts for each.
struct SharedLinks {
  std::optional<LinkMatching> matching;
  double seconds = 0;
};

/// From the map folder and the result of the row that it continues. Ctrl-C is thrown as an Error; no map
/// folder is written then.
[[nodiscard]] RowResult run_post_row(const CompareRow& row, const RowResult& drive, SpooledScanSource& scans,
                                     const ExperimentRequest& request, const ExperimentCallbacks& callbacks,
                                     SharedLinks& links);

}  // namespace alces::offline
