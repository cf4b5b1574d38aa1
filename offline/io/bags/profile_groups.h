// A 2D laser on a turning head: which of its profiles make one scan.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bag_choice.h"
#include "bag_survey.h"

namespace alces::offline {

/// Replaces the profiles of the chosen topic by scans: from one profile on until the head has turned far
/// enough that every direction was seen (half a turn where a profile sees 170 deg or more, else a whole one),
/// or turns back. The rest at the end, of less than half of that, and profiles without a place in /tf are
/// left out, and a sentence says so. InputError: the frames do not turn the laser.
[[nodiscard]] std::vector<std::string> group_profiles(BagSurvey& survey, const BagChoice& choice);

}  // namespace alces::offline
