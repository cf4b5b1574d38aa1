#include "alces/loop_detector.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alces/pose_graph.h"

namespace alces {
namespace {

/// Cells beyond this one share it, so that a position of 1e30 m does no harm: clamping keeps neighbours
/// within one cell of each other, and the distance decides in the end.
constexpr double outermost_cell = 1e12;

std::int64_t cell(double coordinate_m, double cell_m) {
  return static_cast<std::int64_t>(
      std::clamp(std::floor(coordinate_m / cell_m), -outermost_cell, outermost_cell));
}

/// Which of `bucket_count` (a power of two) lists holds the cell.
std::size_t bucket(std::int64_t x, std::int64_t y, std::int64_t z, std::size_t bucket_count) {
  std::uint64_t hash = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15U;
  hash = (hash ^ (hash >> 32) ^ static_cast<std::uint64_t>(y)) * 0xbf58476d1ce4e5b9U;
  hash = (hash ^ (hash >> 32) ^ static_cast<std::uint64_t>(z)) * 0x94d049bb133111ebU;
  return static_cast<std::size_t>(hash ^ (hash >> 32)) & (bucket_count - 1);
}

}  // namespace

void LoopDetector::Grid::clear() {
  std::ranges::fill(first, no_index);
}

void LoopDetector::Grid::insert(std::uint32_t scan, const Eigen::Vector3d& position_m, double cell_m) {
  std::uint32_t& head = first[bucket(cell(position_m.x(), cell_m), cell(position_m.y(), cell_m),
                                     cell(position_m.z(), cell_m), first.size())];
  next[scan] = head;
  head = scan;
}

Status LoopDetector::validate(const LoopDetectorConfig& config) {
  const bool radii_are_good =
      std::isfinite(config.radius_cap_m) && config.radius_m > 0 && config.radius_m <= config.radius_cap_m;
  const bool factor_is_good = std::isfinite(config.sigma_factor) && config.sigma_factor >= 0;
  return radii_are_good && factor_is_good && config.minimum_gap_scans > 0 &&
                 std::isfinite(config.minimum_gap_m) && config.minimum_gap_m >= 0
             ? Status::ok
             : Status::bad_config;
}

void LoopDetector::clear() {
  scan_count_ = 0;
  by_position_.clear();
  by_gps_position_.clear();
}

Status LoopDetector::add(const Eigen::Vector3d& position_m, double driven_m,
                         const Eigen::Vector3d* gps_position_m) {
  if (!position_m.allFinite() || !std::isfinite(driven_m)) return Status::bad_pose;
  if (gps_position_m != nullptr) {
    if (!config_.use_gps) return Status::bad_config;
    if (!gps_position_m->allFinite()) return Status::bad_pose;
  }
  if (scan_count_ == positions_m_.size()) return Status::no_scan_capacity;
  const std::uint32_t scan = scan_count_;
  if (scan == 0) clear();
  positions_m_[scan] = position_m;
  driven_m_[scan] = driven_m;
  by_position_.insert(scan, positions_m_[scan], config_.radius_cap_m);
  if (gps_position_m != nullptr) {
    gps_positions_m_[scan] = *gps_position_m;
    by_gps_position_.insert(scan, gps_positions_m_[scan], config_.radius_cap_m);
  } else if (config_.use_gps) {
    gps_positions_m_[scan].x() = std::numeric_limits<double>::quiet_NaN();
  }
  ++scan_count_;
  return Status::ok;
}

Status LoopDetector::rebuild(std::span<const Pose> map_from_body) {
  if (map_from_body.size() > positions_m_.size()) return Status::no_scan_capacity;
  for (const Pose& pose : map_from_body) {
    if (!pose.translation_m.allFinite()) return Status::bad_pose;
  }
  const std::uint32_t known_count = scan_count_;
  clear();
  for (const Pose& pose : map_from_body) {
    const std::uint32_t scan = scan_count_++;
    positions_m_[scan] = pose.translation_m;
    by_position_.insert(scan, positions_m_[scan], config_.radius_cap_m);
    if (!config_.use_gps) continue;
    if (scan >= known_count) gps_positions_m_[scan].x() = std::numeric_limits<double>::quiet_NaN();
    if (has_gps(scan)) by_gps_position_.insert(scan, gps_positions_m_[scan], config_.radius_cap_m);
  }
  return Status::ok;
}

bool LoopDetector::has_gps(std::uint32_t scan) const {
  return config_.use_gps && !std::isnan(gps_positions_m_[scan].x());
}

template <typename Visit>
void LoopDetector::visit_near(const Grid& grid, const Eigen::Vector3d& position_m, double radius_m,
                              Visit visit) const {
  const double cell_m = config_.radius_cap_m;
  std::int64_t low[3];
  std::int64_t high[3];
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = cell(position_m[axis] - radius_m, cell_m);
    high[axis] = cell(position_m[axis] + radius_m, cell_m);
  }
  for (std::int64_t x = low[0]; x <= high[0]; ++x) {
    for (std::int64_t y = low[1]; y <= high[1]; ++y) {
      for (std::int64_t z = low[2]; z <= high[2]; ++z) {
        std::uint32_t scan = grid.first[bucket(x, y, z, grid.first.size())];
        for (; scan != no_index; scan = grid.next[scan]) visit(scan);
      }
    }
  }
}

std::optional<LoopDetector::Nearby> LoopDetector::nearest(const Eigen::Vector3d& position_m,
                                                          std::uint32_t newest_scan, double sigma_m,
                                                          const Eigen::Vector3d* gps_position_m) const {
  if (newest_scan >= scan_count_ || newest_scan < config_.minimum_gap_scans) return std::nullopt;
  if (!position_m.allFinite()) return std::nullopt;
  // The last scan that is far enough back: the way only grows.
  const std::span<const double> ways_m = driven_m_.first(newest_scan - config_.minimum_gap_scans + 1);
  const double way_m = driven_m_[newest_scan] - config_.minimum_gap_m;
  const auto beyond = std::upper_bound(ways_m.begin(), ways_m.end(), way_m);
  if (beyond == ways_m.begin()) return std::nullopt;
  const auto last_scan = static_cast<std::uint32_t>(beyond - ways_m.begin() - 1);
  const double grown_m = config_.radius_m + config_.sigma_factor * sigma_m;
  const double radius_m =
      grown_m > config_.radius_m ? std::min(grown_m, config_.radius_cap_m) : config_.radius_m;
  const bool with_gps = config_.use_gps && gps_position_m != nullptr && gps_position_m->allFinite();

  Nearby best{no_index, radius_m};
  const auto consider = [&](std::uint32_t scan, const Eigen::Vector3d& there_m,
                            const Eigen::Vector3d& here_m) {
    if (scan > last_scan) return;
    const double distance_m = (there_m - here_m).norm();
    if (distance_m < best.distance_m || (distance_m == best.distance_m && scan < best.scan)) {
      best = {scan, distance_m};
    }
  };
  visit_near(by_position_, position_m, radius_m, [&](std::uint32_t scan) {
    if (!with_gps || !has_gps(scan)) consider(scan, positions_m_[scan], position_m);
  });
  if (with_gps) {
    visit_near(by_gps_position_, *gps_position_m, radius_m,
               [&](std::uint32_t scan) { consider(scan, gps_positions_m_[scan], *gps_position_m); });
  }
  if (best.scan == no_index) return std::nullopt;
  return best;
}

std::optional<LoopTrigger::Loop> LoopTrigger::observe(std::uint32_t scan,
                                                      const std::optional<LoopDetector::Nearby>& nearby) {
  if (!nearby) return finish();
  const Loop here{nearby->scan, scan, nearby->distance_m};
  switch (state_) {
    case State::out_of_reach:
      state_ = State::approaching;
      best_ = here;
      waited_scans_ = 0;
      return std::nullopt;
    case State::approaching: {
      if (here.distance_m < best_.distance_m) {
        best_ = here;
        waited_scans_ = 0;
        return std::nullopt;
      }
      ++waited_scans_;
      const bool grows = here.distance_m > best_.distance_m + config_.hysteresis_m;
      const bool waited_enough = config_.patience_scans != 0 && waited_scans_ >= config_.patience_scans;
      if (!grows && !waited_enough) return std::nullopt;
      state_ = State::reported;
      waited_scans_ = 0;
      return best_;
    }
    case State::reported:
      if (config_.repeat_after_scans == 0 || ++waited_scans_ < config_.repeat_after_scans)
        return std::nullopt;
      waited_scans_ = 0;
      return here;
  }
  return std::nullopt;
}

std::optional<LoopTrigger::Loop> LoopTrigger::finish() {
  const bool is_due = state_ == State::approaching;
  state_ = State::out_of_reach;
  if (!is_due) return std::nullopt;
  return best_;
}

}  // namespace alces
