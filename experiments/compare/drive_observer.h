// Watches the poses of a map against the ground truth while it is made: for the plots of the error over the
// drive and of the convergence of single scans.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "row_result.h"
#include "truth.h"

namespace alces::offline {

class DriveObserver {
 public:
  /// `truth` outlives it. `watched`: places in the source.
  DriveObserver(const ScanTruth& truth, const std::vector<std::size_t>& watched);
  /// Goes on where the drive ended, with the same scans: for what comes afterwards.
  DriveObserver(const ScanTruth& truth, const RowResult& drive);

  /// After each scan. O(scans).
  void scanned(std::span<const Pose> map_from_body, std::span<const std::size_t> source_index,
               std::uint32_t loops_closed);
  /// After an iteration that moves all scans.
  void relaxed(std::span<const Pose> map_from_body, std::span<const std::size_t> source_index);

  [[nodiscard]] const std::vector<DriveSample>& drive() const { return drive_; }
  [[nodiscard]] const std::vector<WatchedScan>& watched() const { return watched_; }

 private:
  void watch(std::span<const Pose> map_from_body, std::span<const std::size_t> source_index,
             ConvergencePhase phase, bool only_new);

  const ScanTruth& truth_;
  std::vector<DriveSample> drive_;
  std::vector<WatchedScan> watched_;
  std::uint32_t loops_closed_ = 0;
};

/// Three scans that a plot shows well: about where the paper's are (344 and 556 of 924), and the last.
[[nodiscard]] std::vector<std::size_t> scans_to_watch(const ScanTruth& truth);

}  // namespace alces::offline
