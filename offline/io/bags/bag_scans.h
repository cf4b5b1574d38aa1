// The scans of a bag as a source: what `alces map` maps.
//
// The bag is surveyed once when it is opened (bag_survey.h) and read again, in turn, for its points: one
// message in memory at a time. Going back to an earlier scan begins the bag anew.
//
// Points come out in the body's frame, metres: as the message has them where scanner and body share a frame,
// else through /tf_static, or through /tf at the scan's stamp. A point at exactly (0, 0, 0), which is how
// some drivers say that nothing came back, becomes NaN. Odometry is interpolated between its neighbours, at
// most 1 s apart. A scan that is not later than the one before is left out, and told.
#pragma once

#include <filesystem>
#include <memory>

#include "offline/io/scans/scan_source.h"

namespace alces::offline {

/// InputError.
[[nodiscard]] std::unique_ptr<ScanSource> open_bag_scans(const std::filesystem::path& bag,
                                                         const ScanSourceOptions& options);

}  // namespace alces::offline
