// What one row of the comparison came to: poses, errors or consistency, times, and the way there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compare_rows.h"
#include "offline/evaluate/evaluation.h"
#include "offline/evaluate/map_entropy.h"
#include "offline/io/map_folder/trajectory.h"

namespace alces::offline {

/// Table 2 of the paper. Seconds of this machine; the post-processing uses all its cores, the rest one.
struct RowTimes {
  double icp_s = 0;               ///< online: downsampling, indexing and matching every scan
  double online_front_end_s = 0;  ///< detecting and matching loops; of LUM: links and correspondences
  double online_back_end_s = 0;   ///< LOA and sharing out, or what stands in its place
  double post_front_end_s = 0;    ///< links and their matches
  double post_back_end_s = 0;     ///< equations and their solution
  double total_s = 0;             ///< by the clock, with everything else: reading scans, waiting
};

/// The map while the drive goes on, after each scan. Errors are means over the scans so far.
struct DriveSample {
  std::size_t scans = 0;
  std::uint32_t loops_closed = 0;
  double translation_m = 0;
  double translation_xy_m = 0;
};

/// What moved a scan.
enum class ConvergencePhase : std::uint8_t { match, loop, relaxation };

/// The error of a watched scan after something has moved the map (paper, Figures 15 and 16).
struct ConvergenceSample {
  std::size_t step = 0;  ///< from 0, when the scan joined the map; a loop closed or an iteration each
  ConvergencePhase phase = ConvergencePhase::match;
  double translation_m = 0;
  double quaternion_angle_deg = 0;
};
struct WatchedScan {
  std::size_t source_index = 0;
  std::vector<ConvergenceSample> samples;
};

/// Figures of a map that need no ground truth. Not an error: a map can be consistent and bent.
struct RowConsistency {
  std::vector<GroupConsistency> groups;  ///< next, five apart, revisits: the same pairs for all rows
  MapEntropy entropy;
};

struct RowResult {
  CompareRow row;
  std::size_t scans = 0;
  std::uint32_t loops_closed = 0;
  std::uint32_t loops_refused = 0;
  std::uint32_t iterations = 0;       ///< of LUM, TORO, HOG-Man afterwards; of LUM online, all together
  bool is_converged = true;           ///< of LUM afterwards
  std::vector<std::string> warnings;  ///< of its run, without the source's
  RowTimes times;
  Trajectory trajectory;
  std::vector<std::size_t> source_index;  ///< of each pose
  std::optional<AbsoluteError> error;     ///< with ground truth
  std::vector<std::size_t> error_scans;   ///< the pose that each of error->scans belongs to
  std::optional<RowConsistency> consistency;
  std::vector<DriveSample> drive;    ///< with ground truth; of the online part
  std::vector<WatchedScan> watched;  ///< with ground truth
};

}  // namespace alces::offline
