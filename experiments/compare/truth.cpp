#include "truth.h"

#include <fmt/format.h>

#include <algorithm>

#include "offline/io/files/error.h"

namespace alces::offline {

ScanTruth read_scan_truth(const std::filesystem::path& file, const ScanSource& scans, Alignment alignment,
                          double max_time_difference_s) {
  const Trajectory truth = read_trajectory(file);
  Trajectory stamps;
  stamps.has_time = scans.size() > 0;
  stamps.has_stamps = true;
  for (std::size_t i = 0; i < scans.size(); ++i) stamps.has_time &= scans.stamp_s(i).has_value();
  for (std::size_t i = 0; i < scans.size(); ++i) {
    stamps.stamps_s.push_back(stamps.has_time ? *scans.stamp_s(i) : static_cast<double>(scans.number(i)));
    stamps.poses.emplace_back();
  }
  Association association;
  try {
    association = associate(stamps, truth, max_time_difference_s);
  } catch (const InputError& error) {
    throw InputError(file, fmt::format("does not belong to these {} scans: {}", scans.size(), error.what()));
  }
  if (association.pairs.size() < 2)
    throw InputError(file, fmt::format("knows only {} of the {} scans; give the ground truth of this drive",
                                       association.pairs.size(), scans.size()));
  ScanTruth result;
  result.alignment = alignment;
  result.truth_from_body.resize(scans.size());
  result.known = association.pairs.size();
  result.largest_time_difference_s = association.largest_time_difference_s;
  for (const Association::Pair& pair : association.pairs)
    result.truth_from_body[pair.estimate] = truth.poses[pair.truth];
  return result;
}

Pose ScanTruth::truth_from_map(std::span<const Pose> map_from_body,
                               std::span<const std::size_t> source_index) const {
  if (alignment == Alignment::none) return {};
  for (std::size_t i = 0; i < map_from_body.size(); ++i)
    if (const auto& pose = truth_from_body[source_index[i]]) return *pose * map_from_body[i].inverse();
  return {};
}

TruthError error_against(const ScanTruth& truth, std::span<const Pose> map_from_body,
                         std::span<const std::size_t> source_index) {
  const Pose truth_from_map = truth.truth_from_map(map_from_body, source_index);
  std::vector<Pose> estimates;
  std::vector<Pose> truths;
  TruthError result;
  for (std::size_t i = 0; i < map_from_body.size(); ++i) {
    const auto& pose = truth.truth_from_body[source_index[i]];
    if (!pose) continue;
    estimates.push_back(truth_from_map * map_from_body[i]);
    truths.push_back(*pose);
    result.poses.push_back(i);
  }
  result.error = absolute_error(estimates, truths);
  return result;
}

}  // namespace alces::offline
