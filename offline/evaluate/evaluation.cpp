#include "evaluation.h"

#include <fmt/core.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "offline/io/files/error.h"

namespace alces::offline {

namespace {

constexpr double deg_per_rad = 180 / std::numbers::pi;

std::vector<std::size_t> order_by_stamp(std::span<const double> stamps_s) {
  std::vector<std::size_t> order(stamps_s.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t j) { return stamps_s[i] < stamps_s[j]; });
  return order;
}

Association associate_by_index(std::size_t count) {
  Association association;
  association.by_index = true;
  for (std::size_t i = 0; i < count; ++i) association.pairs.push_back({i, i});
  return association;
}

bool counts_up(const Trajectory& trajectory) {
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (trajectory.stamps_s[i] != static_cast<double>(i)) return false;
  }
  return true;
}

/// Whole numbers of a file may be seconds as well as scan numbers; the other trajectory's times tell.
bool are_both_times(const Trajectory& a, const Trajectory& b) {
  if (a.has_time == b.has_time) return a.has_time;
  const Trajectory& numbers = a.has_time ? b : a;
  const Trajectory& times = a.has_time ? a : b;
  if (!numbers.has_stamps || counts_up(numbers)) return false;
  const auto range = std::minmax_element(times.stamps_s.begin(), times.stamps_s.end());
  return std::any_of(numbers.stamps_s.begin(), numbers.stamps_s.end(), [&range](double stamp) {
    return stamp >= *range.first && stamp <= *range.second;  // clang 14 captures no structured bindings
  });
}

}  // namespace

Association associate_stamps(std::span<const double> estimate_s, std::span<const double> truth_s,
                             double max_difference_s) {
  struct Candidate {
    double difference_s;
    Association::Pair pair;
  };
  const std::vector<std::size_t> truth_order = order_by_stamp(truth_s);
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < estimate_s.size(); ++i) {
    const auto after = std::lower_bound(truth_order.begin(), truth_order.end(), estimate_s[i],
                                        [&](std::size_t j, double stamp_s) { return truth_s[j] < stamp_s; });
    const auto offer = [&](std::size_t j) {
      const double difference_s = std::abs(truth_s[j] - estimate_s[i]);
      if (difference_s <= max_difference_s) candidates.push_back({difference_s, {i, j}});
    };
    if (after != truth_order.end()) offer(*after);
    if (after != truth_order.begin()) offer(*(after - 1));
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.difference_s < b.difference_s; });

  Association association;
  std::vector<bool> estimate_taken(estimate_s.size());
  std::vector<bool> truth_taken(truth_s.size());
  for (const Candidate& candidate : candidates) {
    if (estimate_taken[candidate.pair.estimate] || truth_taken[candidate.pair.truth]) continue;
    estimate_taken[candidate.pair.estimate] = truth_taken[candidate.pair.truth] = true;
    association.pairs.push_back(candidate.pair);
    association.largest_time_difference_s = candidate.difference_s;
  }
  std::sort(association.pairs.begin(), association.pairs.end(),
            [](const auto& a, const auto& b) { return a.estimate < b.estimate; });
  return association;
}

namespace {

/// Least squares over the positions (Umeyama 1991, scale 1).
Pose align_positions(std::span<const Pose> estimate, std::span<const Pose> truth) {
  const auto count = static_cast<double>(estimate.size());
  Eigen::Vector3d estimate_mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d truth_mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    estimate_mean += estimate[i].translation_m / count;
    truth_mean += truth[i].translation_m / count;
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    covariance += (truth[i].translation_m - truth_mean) *
                  (estimate[i].translation_m - estimate_mean).transpose() / count;
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d sigma = svd.singularValues();

  Pose truth_from_map;
  if (sigma(0) <= 0) {
    truth_from_map.rotation.setIdentity();
  } else if (sigma(1) < 1e-9 * sigma(0)) {
    // All on a line: the rotation about it is open, the smallest one takes direction to direction.
    truth_from_map.rotation =
        Eigen::Quaterniond::FromTwoVectors(svd.matrixV().col(0), svd.matrixU().col(0)).normalized();
  } else {
    const double handedness = svd.matrixU().determinant() * svd.matrixV().determinant() < 0 ? -1 : 1;
    const Eigen::Matrix3d rotation =
        svd.matrixU() * Eigen::Vector3d(1, 1, handedness).asDiagonal() * svd.matrixV().transpose();
    truth_from_map.rotation = Eigen::Quaterniond(rotation).normalized();
  }
  truth_from_map.translation_m = truth_mean - truth_from_map.rotation * estimate_mean;
  return truth_from_map;
}

template <typename Member>
Statistics statistics_of(const std::vector<ScanError>& scans, Member member) {
  std::vector<double> values;
  values.reserve(scans.size());
  for (const ScanError& scan : scans) values.push_back(scan.*member);
  return statistics(values);
}

}  // namespace

Statistics statistics(std::span<const double> values) {
  Statistics result;
  result.count = values.size();
  if (values.empty()) return result;
  const auto count = static_cast<double>(values.size());
  double square_sum = 0;
  for (const double value : values) {
    result.mean += value / count;
    square_sum += value * value;
    result.max = std::max(result.max, value);
  }
  double variance = 0;
  for (const double value : values) variance += (value - result.mean) * (value - result.mean) / count;
  result.standard_deviation = std::sqrt(variance);
  result.rmse = std::sqrt(square_sum / count);
  result.median = median(values);
  return result;
}

double median(std::span<const double> values) {
  if (values.empty()) return 0;
  std::vector<double> sorted(values.begin(), values.end());
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  if (sorted.size() % 2 == 1) return *middle;
  return (*std::max_element(sorted.begin(), middle) + *middle) / 2;
}

Association associate(const Trajectory& estimate, const Trajectory& truth, double max_time_difference_s) {
  if (estimate.size() == 0 || truth.size() == 0) {
    throw InputError(fmt::format("the {} holds no poses", estimate.size() == 0 ? "trajectory" : "truth"));
  }
  const bool both_have_time = are_both_times(estimate, truth);
  if (!both_have_time && estimate.has_stamps && truth.has_stamps && !estimate.has_time && !truth.has_time) {
    Association by_number = associate_stamps(estimate.stamps_s, truth.stamps_s, 0);
    by_number.by_number = true;
    if (by_number.pairs.size() == estimate.size() && estimate.size() == truth.size()) return by_number;
  }
  if (!both_have_time && estimate.size() == truth.size()) return associate_by_index(estimate.size());
  if (!both_have_time && estimate.has_time != truth.has_time) {
    throw InputError(
        fmt::format("the trajectory has {} poses, the truth {}, and only the {} has times: give a truth "
                    "with times or with as many poses",
                    estimate.size(), truth.size(), truth.has_time ? "truth" : "trajectory"));
  }
  if (!both_have_time) {
    if (counts_up(estimate) && counts_up(truth)) {
      throw InputError(
          fmt::format("the trajectory has {} poses, the truth {}, and neither has times to associate them "
                      "by: give a truth with as many poses, or scan numbers or times to both",
                      estimate.size(), truth.size()));
    }
    Association by_number = associate_stamps(estimate.stamps_s, truth.stamps_s, 0);
    by_number.by_number = true;
    if (by_number.pairs.empty()) throw InputError("trajectory and truth have no scan number in common");
    return by_number;
  }
  Association by_time = associate_stamps(estimate.stamps_s, truth.stamps_s, max_time_difference_s);
  if (by_time.pairs.empty()) {
    const auto [first, last] = std::minmax_element(estimate.stamps_s.begin(), estimate.stamps_s.end());
    const auto [truth_first, truth_last] = std::minmax_element(truth.stamps_s.begin(), truth.stamps_s.end());
    throw InputError(
        fmt::format("no pose of the truth ({:.3f} to {:.3f} s) is within {} s of one of the trajectory "
                    "({:.3f} to {:.3f} s): check the clocks or raise --max-time-difference",
                    *truth_first, *truth_last, max_time_difference_s, *first, *last));
  }
  return by_time;
}

std::string to_string(const Association& association) {
  const std::size_t count = association.pairs.size();
  const std::string what = fmt::format("{} {} associated by ", count, count == 1 ? "pose" : "poses");
  if (association.by_index) return what + "index";
  if (association.by_number) return what + "number";
  return what + fmt::format("stamp ({:.3g} s apart at most)", association.largest_time_difference_s);
}

Pose truth_from_map(std::span<const Pose> estimate, std::span<const Pose> truth, Alignment alignment) {
  switch (alignment) {
    case Alignment::first:
      return truth.front() * estimate.front().inverse();
    case Alignment::se3:
      return align_positions(estimate, truth);
    case Alignment::none:
      break;
  }
  return Pose{};
}

AbsoluteError absolute_error(std::span<const Pose> estimate, std::span<const Pose> truth) {
  AbsoluteError error;
  error.scans.reserve(estimate.size());
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const Eigen::Vector3d difference_m = estimate[i].translation_m - truth[i].translation_m;
    const double rotation_deg = deg_per_rad * angle_between_rad(estimate[i].rotation, truth[i].rotation);
    error.scans.push_back(
        {difference_m.norm(), difference_m.head<2>().norm(), rotation_deg / 2, rotation_deg});
  }
  error.translation_m = statistics_of(error.scans, &ScanError::translation_m);
  error.translation_xy_m = statistics_of(error.scans, &ScanError::translation_xy_m);
  error.quaternion_angle_deg = statistics_of(error.scans, &ScanError::quaternion_angle_deg);
  error.rotation_deg = statistics_of(error.scans, &ScanError::rotation_deg);
  return error;
}

RelativeError relative_error(std::span<const Pose> estimate, std::span<const Pose> truth, std::size_t delta) {
  std::vector<double> translation_m;
  std::vector<double> rotation_deg;
  for (std::size_t i = 0; i + delta < estimate.size(); ++i) {
    const Pose estimated = estimate[i].inverse() * estimate[i + delta];
    const Pose true_motion = truth[i].inverse() * truth[i + delta];
    const Pose error = true_motion.inverse() * estimated;
    translation_m.push_back(error.translation_m.norm());
    rotation_deg.push_back(deg_per_rad * angle_between_rad(error.rotation, Eigen::Quaterniond::Identity()));
  }
  return {delta, statistics(translation_m), statistics(rotation_deg)};
}

}  // namespace alces::offline
