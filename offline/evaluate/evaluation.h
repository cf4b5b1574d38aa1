// How good is a trajectory? Against ground truth (the paper's Section 4.1, Table 1; relative errors), and,
// where there is none, by how well the scans that see the same surfaces agree at their map poses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "alces/point.h"
#include "alces/pose.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"

namespace alces::offline {

/// Of a set of errors. `standard_deviation` divides by n (Table 1 describes all scans, it does not sample
/// them).
struct Statistics {
  std::size_t count = 0;
  double mean = 0;
  double standard_deviation = 0;
  double median = 0;
  double rmse = 0;
  double max = 0;
};
/// All zero for no values.
[[nodiscard]] Statistics statistics(std::span<const double> values);
/// Mean of the middle two for an even count; 0 for no values.
[[nodiscard]] double median(std::span<const double> values);

// ---------------------------------------------------------------------------------------- against ground
// truth

/// Which pose of the truth belongs to which of the estimate.
struct Association {
  struct Pair {
    std::size_t estimate = 0;
    std::size_t truth = 0;
  };
  std::vector<Pair> pairs;  ///< in the order of the estimate
  bool by_index = false;    ///< scan i is scan i
  bool by_number = false;   ///< the scans' numbers are equal; neither: by the nearest time stamp
  double largest_time_difference_s = 0;
};

/// Each of `stamps_s` takes the nearest of `others_s`, no further than `max_difference_s`; each of these is
/// taken once, by the nearest. O(n log n).
[[nodiscard]] Association associate_stamps(std::span<const double> stamps_s, std::span<const double> others_s,
                                           double max_difference_s);

/// By stamp where both have times (whole numbers that do not count up from 0 and lie in the other's range are
/// times, too), no further apart than `max_time_difference_s`. Otherwise by number where both say the same
/// scan numbers, by index where both are equally long, and by the numbers that both have. InputError if
/// lengths do not match, if only one has times, or if nothing associates.
[[nodiscard]] Association associate(const Trajectory& estimate, const Trajectory& truth,
                                    double max_time_difference_s);

/// "poses associated by stamp, 3 ms apart at most": what was paired how.
[[nodiscard]] std::string to_string(const Association& association);

enum class Alignment {
  none,   ///< the truth is used as it stands (the paper)
  first,  ///< the first associated poses are made to agree
  se3,    ///< least squares over all positions, rotation and translation, no scale (Horn 1987, Umeyama 1991)
};

/// The transform that takes the estimate into the frame of the truth. Equally long spans, at least one pose.
/// Positions on one line leave the rotation about it open: se3 then takes the smallest.
[[nodiscard]] Pose truth_from_map(std::span<const Pose> estimate, std::span<const Pose> truth,
                                  Alignment alignment);

/// Errors of one scan.
struct ScanError {
  double translation_m = 0;
  double translation_xy_m = 0;  ///< x and y of the truth's frame only, as in Table 1
  double quaternion_angle_deg =
      0;                    ///< the paper's e_rotation = arccos |q . q_ref|: HALF the angle of rotation
  double rotation_deg = 0;  ///< the angle of rotation between the two, twice the above
};

struct AbsoluteError {
  std::vector<ScanError> scans;
  Statistics translation_m;
  Statistics translation_xy_m;
  Statistics quaternion_angle_deg;
  Statistics rotation_deg;
};
/// Both in the frame of the truth: apply truth_from_map() to the estimate first. Equally long spans.
[[nodiscard]] AbsoluteError absolute_error(std::span<const Pose> estimate, std::span<const Pose> truth);

/// Error of the motion from pose i to i + delta, for every i (Sturm et al. 2012): independent of the
/// alignment.
struct RelativeError {
  std::size_t delta = 1;
  Statistics translation_m;
  Statistics rotation_deg;
};
/// Statistics over nothing when the trajectory is not longer than delta.
[[nodiscard]] RelativeError relative_error(std::span<const Pose> estimate, std::span<const Pose> truth,
                                           std::size_t delta);

// ---------------------------------------------------------------------------------------- without ground
// truth

/// The consistency figure. Of a pair of scans (a, b) at their map poses: the points between min_range_m and
/// max_range_m from their scanner. A point of a has a normal if, among its `normal_neighbours` nearest points
/// of a (itself included), the smallest eigenvalue of the covariance is below `max_eigenvalue_ratio` times
/// the middle one. Every `every`-th such point of b takes its nearest neighbour among all these points of a,
/// if there is one within max_distance_m; where that neighbour has a normal, the residual is the distance to
/// it along the normal, elsewhere the point says nothing (vegetation must not lend its points to a wall
/// behind). The pair's figure is the median residual. Scans are taken as the files have them: no reduction,
/// no outlier filter.
struct ConsistencySettings {
  double min_range_m = 1.5;
  double max_range_m = 20;
  std::size_t normal_neighbours = 10;
  double max_eigenvalue_ratio = 0.02;
  std::size_t every = 3;
  double max_distance_m = 1;
  std::size_t min_correspondences = 50;  ///< fewer: the pair is without overlap
};

using ScanPair = std::pair<std::uint32_t, std::uint32_t>;

/// Scan a, its points, their normals and the tree to find them; about 40 bytes a point, some 50 ms for 17,000
/// points.
class SurfaceModel {
 public:
  SurfaceModel(std::span<const Point> points, const ConsistencySettings& settings);
  ~SurfaceModel();
  SurfaceModel(SurfaceModel&&) noexcept;
  SurfaceModel& operator=(SurfaceModel&&) noexcept;

  [[nodiscard]] std::size_t size() const;  ///< points with a normal

  /// Residuals of scan b in metres, in the order of b's points.
  [[nodiscard]] std::vector<double> residuals_m(std::span<const Point> b, const Pose& a_from_b) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
  ConsistencySettings settings_;
};

struct PairConsistency {
  ScanPair pair;
  std::size_t correspondences = 0;
  std::optional<double> median_residual_m;  ///< none: without overlap
};

/// A named list of pairs, and what came of it.
struct PairGroup {
  std::string name;
  std::vector<ScanPair> pairs;
};
struct GroupConsistency {
  std::string name;
  std::vector<PairConsistency> pairs;  ///< in the order of the list
  std::size_t without_overlap = 0;
  std::optional<double> median_m;  ///< over the pairs with overlap; none if there is none
};

/// "next": (i, i + 1), "five apart": (i, i + 5), for i = 5, 15, 25, ...
[[nodiscard]] std::vector<PairGroup> neighbour_pairs(std::size_t scan_count);

/// Pairs (a, b) with b >= a + min_gap whose positions are at most max_distance_m apart: two visits of a
/// place. Of more than max_pairs, that many are taken evenly spread over the list. O(n^2).
struct RevisitSettings {
  double max_distance_m = 3;
  std::uint32_t min_gap = 30;
  std::size_t max_pairs = 500;
};
struct Revisits {
  std::vector<ScanPair> pairs;
  std::size_t found = 0;  ///< before thinning
};
[[nodiscard]] Revisits find_revisits(std::span<const Pose> map_from_scan,
                                     const RevisitSettings& settings = {});

/// Pairs from JSON: [[a, b], ...]. Throws InputError naming the entry that is wrong or not below scan_count.
[[nodiscard]] std::vector<ScanPair> read_pairs(const std::filesystem::path& file, std::size_t scan_count);

/// Measures all groups on all cores: HANNOVER1's 390 pairs in a few seconds. As many poses as scans. Pairs
/// with the same a share its normals; memory is one SurfaceModel and two scans a thread. `progress(done,
/// total)` is called from any thread, one call at a time; may be empty.
[[nodiscard]] std::vector<GroupConsistency> measure_consistency(
    ScanSource& scans, std::span<const Pose> map_from_scan, std::span<const PairGroup> groups,
    const ConsistencySettings& settings = {},
    const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace alces::offline
