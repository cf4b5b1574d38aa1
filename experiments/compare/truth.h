// Ground truth laid beside the scans of a source before anything is mapped, so that what does not fit is said
// at once.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "offline/evaluate/evaluation.h"
#include "offline/io/scans/scan_source.h"

namespace alces::offline {

struct ScanTruth {
  std::vector<std::optional<Pose>> truth_from_body;  ///< one a scan of the source
  Alignment alignment = Alignment::none;             ///< none or first
  std::size_t known = 0;                             ///< scans that have one
  double largest_time_difference_s = 0;

  /// The transform that takes a map into the frame of the truth: the identity (the paper: nothing is
  /// re-aligned), or what lays the first scan that has one upon it.
  [[nodiscard]] Pose truth_from_map(std::span<const Pose> map_from_body,
                                    std::span<const std::size_t> source_index) const;
};

/// By time stamp, by scan number, or by place where one of the two has no times and both are equally long.
/// InputError naming the file when nothing fits, or fewer than two scans do.
[[nodiscard]] ScanTruth read_scan_truth(const std::filesystem::path& file, const ScanSource& scans,
                                        Alignment alignment, double max_time_difference_s);

struct TruthError {
  AbsoluteError error;
  std::vector<std::size_t> poses;  ///< that each of error.scans belongs to
};
/// Of all poses that have a truth.
[[nodiscard]] TruthError error_against(const ScanTruth& truth, std::span<const Pose> map_from_body,
                                       std::span<const std::size_t> source_index);

}  // namespace alces::offline
