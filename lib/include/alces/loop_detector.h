// Loop detection: which earlier scan is near enough to close a loop with, and when to close it.
// Paper: section 3.2 (distance 15 m, 20 scans in between, GPS positions where there are any; the loop is
// closed at the closest approach, not at the first touch).
//
// LoopDetector answers "nearest earlier scan within reach" from a spatial hash: cells of the largest reach,
// in a table with one chained list a bucket. LoopTrigger turns the answers of successive scans into loops.
//
// Memory: 40 to 44 bytes a scan; with GPS positions 32 to 36 more.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>

#include "alces/arena.h"
#include "alces/pose.h"
#include "alces/status.h"

namespace alces {

struct LoopDetectorConfig {
  std::uint32_t scan_capacity = 0;
  double radius_m = 15;      ///< reach when the position is certain
  double radius_cap_m = 15;  ///< reach at most; at least radius_m. The cells have this size
  double sigma_factor =
      0;  ///< reach = min(radius_cap_m, radius_m + sigma_factor * sigma_m); 0: always radius_m
  std::uint32_t minimum_gap_scans = 20;  ///< the earlier scan's number is smaller by at least this; not 0
  /// And the way driven in between is at least this long, so that scans of one pass are no revisit however
  /// densely they follow each other: twice the mapper's reach, which a straight way of this length has left.
  double minimum_gap_m = 16;
  bool use_gps = false;  ///< room for GPS positions
};

class LoopDetector {
 public:
  struct Nearby {
    std::uint32_t scan = 0;
    double distance_m = 0;
  };

  constexpr LoopDetector(Arena& arena, const LoopDetectorConfig& config)
      : config_(config),
        positions_m_(arena.allocate<Eigen::Vector3d>(config.scan_capacity)),
        driven_m_(arena.allocate<double>(config.scan_capacity)),
        by_position_(arena, config.scan_capacity),
        gps_positions_m_(arena.allocate<Eigen::Vector3d>(config.use_gps ? config.scan_capacity : 0)),
        by_gps_position_(arena, config.use_gps ? config.scan_capacity : 0) {}

  /// bad_config: radii not finite, not positive or the cap below the radius; a negative sigma_factor; no gap
  /// (a scan would be its own neighbour).
  [[nodiscard]] static Status validate(const LoopDetectorConfig& config);

  /// Forgets all scans. O(capacity).
  void clear();

  /// Appends the position of the next scan, the way driven to it since the first (not less than before) and,
  /// if it has one, its GPS position, in any metric frame of its own. bad_pose (not finite),
  /// no_scan_capacity, bad_config (a GPS position without use_gps). O(1).
  [[nodiscard]] Status add(const Eigen::Vector3d& position_m, double driven_m,
                           const Eigen::Vector3d* gps_position_m = nullptr);

  /// Takes the positions of these poses for the scans 0, 1, ... after the map was bent; GPS positions stay
  /// with the scans that have them. bad_pose and no_scan_capacity leave everything as it was. O(capacity).
  [[nodiscard]] Status rebuild(std::span<const Pose> map_from_body);

  /// The scan nearest to `position_m` of those that are far enough before `newest_scan` in scans and in
  /// metres driven, if one is within reach; of equally near ones the first. sigma_m: standard deviation of
  /// the position relative to the earlier scans, where it is known. Against scans that have a GPS position
  /// the distance between the GPS positions counts, if there is one here. Looks at the scans in at most 27
  /// cells (8 when the reach is half the cap): O(1) on a drive that goes somewhere, O(scans) for a vehicle
  /// that never leaves the place.
  [[nodiscard]] std::optional<Nearby> nearest(const Eigen::Vector3d& position_m, std::uint32_t newest_scan,
                                              double sigma_m = 0,
                                              const Eigen::Vector3d* gps_position_m = nullptr) const;

  [[nodiscard]] std::uint32_t scan_count() const { return scan_count_; }

 private:
  /// Scan numbers by the cell of a position. Cells may share a bucket: the distance is what decides.
  struct Grid {
    constexpr Grid(Arena& arena, std::uint32_t capacity)
        : first(arena.allocate<std::uint32_t>(capacity == 0 ? 0 : std::bit_ceil(std::size_t{capacity}))),
          next(arena.allocate<std::uint32_t>(capacity)) {}
    void clear();
    void insert(std::uint32_t scan, const Eigen::Vector3d& position_m, double cell_m);
    std::span<std::uint32_t> first;
    std::span<std::uint32_t> next;
  };

  template <typename Visit>
  void visit_near(const Grid& grid, const Eigen::Vector3d& position_m, double radius_m, Visit visit) const;
  [[nodiscard]] bool has_gps(std::uint32_t scan) const;

  LoopDetectorConfig config_;
  std::span<Eigen::Vector3d> positions_m_;
  std::span<double> driven_m_;
  Grid by_position_;
  std::span<Eigen::Vector3d> gps_positions_m_;  ///< NaN where a scan has none
  Grid by_gps_position_;
  std::uint32_t scan_count_ = 0;
};

struct LoopTriggerConfig {
  double hysteresis_m =
      0.5;  ///< the distance grows again when it is larger than the smallest by more than this
  std::uint32_t patience_scans = 5;  ///< or when so many scans came no nearer; 0: do not count them
  std::uint32_t repeat_after_scans =
      0;  ///< closures while the robot follows its old track; 0: none (the paper)
};

/// The closest-approach rule. Each approach, that is a row of scans within reach, gives one loop, at its
/// smallest distance: when the distance grows again, when reach is left, or at the drive's end. After that,
/// as long as reach is not left, a loop with the scan that is nearest just then follows every
/// `repeat_after_scans` scans.
class LoopTrigger {
 public:
  struct Loop {
    std::uint32_t first = 0;  ///< f, the earlier scan
    std::uint32_t last = 0;   ///< l; not always the newest scan
    double distance_m = 0;
  };

  constexpr explicit LoopTrigger(const LoopTriggerConfig& config) : config_(config) {}

  /// To be told of every scan in order, with what LoopDetector::nearest() says of it. O(1).
  [[nodiscard]] std::optional<Loop> observe(std::uint32_t scan,
                                            const std::optional<LoopDetector::Nearby>& nearby);

  /// The drive ends: the loop of an approach that is still going on.
  [[nodiscard]] std::optional<Loop> finish();

 private:
  enum class State : std::uint8_t { out_of_reach, approaching, reported };

  LoopTriggerConfig config_;
  State state_ = State::out_of_reach;
  Loop best_;
  std::uint32_t waited_scans_ = 0;  ///< since the best, or since the last report
};

}  // namespace alces
