#include "drive_observer.h"

#include <algorithm>

namespace alces::offline {

DriveObserver::DriveObserver(const ScanTruth& truth, const std::vector<std::size_t>& watched)
    : truth_(truth) {
  for (const std::size_t scan : watched) watched_.push_back({scan, {}});
}

DriveObserver::DriveObserver(const ScanTruth& truth, const RowResult& drive)
    : truth_(truth), drive_(drive.drive), watched_(drive.watched), loops_closed_(drive.loops_closed) {}

void DriveObserver::watch(std::span<const Pose> map_from_body, std::span<const std::size_t> source_index,
                          ConvergencePhase phase, bool only_new) {
  const Pose truth_from_map = truth_.truth_from_map(map_from_body, source_index);
  for (WatchedScan& scan : watched_) {
    const bool is_new = scan.samples.empty();
    if (only_new && !is_new) continue;
    const auto place = std::lower_bound(source_index.begin(), source_index.end(), scan.source_index);
    if (place == source_index.end() || *place != scan.source_index) continue;
    const auto& truth = truth_.truth_from_body[scan.source_index];
    if (!truth) continue;
    const Pose pose = truth_from_map * map_from_body[static_cast<std::size_t>(place - source_index.begin())];
    const ScanError error = absolute_error({&pose, 1}, {&*truth, 1}).scans.front();
    scan.samples.push_back({scan.samples.size(), is_new ? ConvergencePhase::match : phase,
                            error.translation_m, error.quaternion_angle_deg});
  }
}

void DriveObserver::scanned(std::span<const Pose> map_from_body, std::span<const std::size_t> source_index,
                            std::uint32_t loops_closed) {
  const AbsoluteError error = error_against(truth_, map_from_body, source_index).error;
  drive_.push_back(
      {map_from_body.size(), loops_closed, error.translation_m.mean, error.translation_xy_m.mean});
  watch(map_from_body, source_index, ConvergencePhase::loop, loops_closed == loops_closed_);
  loops_closed_ = loops_closed;
}

void DriveObserver::relaxed(std::span<const Pose> map_from_body, std::span<const std::size_t> source_index) {
  watch(map_from_body, source_index, ConvergencePhase::relaxation, false);
}

std::vector<std::size_t> scans_to_watch(const ScanTruth& truth) {
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < truth.truth_from_body.size(); ++i)
    if (truth.truth_from_body[i]) known.push_back(i);
  std::vector<std::size_t> chosen;
  if (known.empty()) return chosen;
  for (const std::size_t per_mille : {std::size_t{372}, std::size_t{602}, std::size_t{1000}})
    chosen.push_back(known[(known.size() - 1) * per_mille / 1000]);
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

}  // namespace alces::offline
