// The odometry of a bag's scans: a pose for the stamp of each, from what was chosen of the bag, or from a
// trajectory that the user names.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bag_choice.h"
#include "bag_survey.h"
#include "offline/io/scans/scan_source.h"

namespace alces::offline {

struct ChosenOdometry {
  std::vector<std::optional<Pose>> poses;  ///< odometry_from_body of every scan; empty: no odometry
  std::string title;                       ///< "odometry from /odom"
  std::optional<OdometryOrigin> origin;
  std::vector<std::string> warnings;
};

/// InputError where the trajectory that is asked for does not fit. May shift the survey's frames to the clock
/// of its scans.
[[nodiscard]] ChosenOdometry take_odometry(BagSurvey& survey, const BagChoice& choice,
                                           const ScanSourceOptions& options);

/// odometry_from_body at a time of the scans' clock, after take_odometry(); none: not known then, or there is
/// none in the bag.
[[nodiscard]] std::optional<Pose> odometry_at(const BagSurvey& survey, const BagChoice& choice,
                                              std::int64_t stamp_ns);

}  // namespace alces::offline
