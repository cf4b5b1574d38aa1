// ICP: moves a body of scans (the data) onto fixed scans (the model), with everything bounded.
//
// Each iteration finds, for every data sample, the nearest point of a model scan within a limit that shrinks,
// and minimises the distances: to the points themselves (paper, appendix A.1, in Horn's closed form), or
// mostly along the samples' normals, which lets surfaces slide and converges in far fewer iterations to far
// less drift.
//
// The samples ask the model's scans in turn, so that a metascan costs no more than one scan and need not be
// merged.
//
// Time: at most iterations x samples nearest-neighbour queries.
// Memory: 52 bytes a correspondence of capacity.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "alces/arena.h"
#include "alces/kd_tree.h"
#include "alces/pose.h"
#include "alces/surface.h"

namespace alces {

enum class IcpMetric : std::uint8_t {
  point_to_point,  ///< the paper's: Horn's unit quaternions
  surface,         ///< along the normal where there is a plane, weakly to the point elsewhere (Gauss-Newton)
};

/// The defaults are those of a match that knows little; MapperConfig has others for its two uses.
struct IcpConfig {
  IcpMetric metric = IcpMetric::surface;
  std::uint32_t maximum_iterations = 20;
  float first_distance_limit_m = 1.5F;  ///< of a correspondence in the first iteration ...
  float last_distance_limit_m = 0.8F;   ///< ... multiplied by limit_factor down to this
  float limit_factor = 0.7F;
  float translation_epsilon_m = 0.002F;  ///< converged when an iteration moves less ...
  float rotation_epsilon_rad = 0.0002F;  ///< ... and turns less, at the last distance limit
  std::uint32_t minimum_correspondences = 50;
  std::uint32_t coarse_stride = 4;  ///< only every so many samples, until the last distance limit is reached
  float robust_factor =
      3.0F;  ///< residuals well above this many rms of the last iteration count little; 0: all alike
  float robust_scale_m = 0.05F;  ///< but those below this never do
  float rough_weight = 0.05F;    ///< surface metric: weight of the distance where there is no plane
  float fit_distance_m = 0.1F;   ///< of IcpResult::fit: along the normal where there is a plane, else whole
  float degenerate_ratio =
      1e-3F;  ///< smallest over largest curvature below this: a direction is undetermined
};

/// One scan on either side of a match.
struct IcpScan {
  const KdTree* tree = nullptr;
  std::span<const SurfaceSample> samples;  ///< looked at on the data side only
  Pose side_from_body;                     ///< into the common frame of its side (model or data)
};

enum class IcpVerdict : std::uint8_t {
  converged,
  iteration_limit,          ///< the last iteration still moved; the pose is the best so far
  too_few_correspondences,  ///< nothing to stand on: the pose is the initial one
  degenerate,               ///< a direction is undetermined (see weak_direction); nothing was moved along it
};
[[nodiscard]] const char* text(IcpVerdict verdict);

/// Sums over the correspondences of the last iteration, from which Appendix A's E, s^2 and C follow without
/// stacking anything: M^T M, M^T Z and Z^T Z of the paper. Columns (translation m, rotation vector rad), in
/// the model frame, about its origin.
struct IcpSums {
  std::uint32_t count = 0;
  Matrix6d mtm = Matrix6d::Zero();
  Vector6d mtz = Vector6d::Zero();
  double ztz_m2 = 0;
};

struct IcpResult {
  IcpVerdict verdict = IcpVerdict::too_few_correspondences;
  Pose model_from_data;
  std::uint32_t iterations = 0;
  std::uint32_t correspondences = 0;  ///< of the last iteration
  std::uint32_t queries = 0;          ///< samples that asked for one
  double overlap = 0;                 ///< correspondences / queries
  double fit = 0;    ///< share of all samples that lie on the model, to within fit_distance_m
  double rms_m = 0;  ///< of what is minimised: along normals, or of whole distances
  /// Of model_from_data: inverse covariance of a left perturbation (translation m, rotation vector rad) in
  /// the model frame; all correspondences taken as independent.
  Matrix6d information = Matrix6d::Zero();
  /// Where the verdict is degenerate: the least determined direction, (translation m, rotation vector rad) in
  /// the model frame, unit length. Zero otherwise.
  Vector6d weak_direction = Vector6d::Zero();
  IcpSums sums;
};

/// What one iteration did.
struct IcpIteration {
  float distance_limit_m = 0;
  std::uint32_t correspondences = 0;
  double rms_m = 0;
  double moved_m = 0;
  double turned_rad = 0;
};

/// How many of the samples that face along a direction lie on the model.
struct FacingFit {
  std::uint32_t samples = 0;
  std::uint32_t fitting = 0;
};

class Icp {
 public:
  static constexpr std::uint32_t maximum_model_scans = 16;

  constexpr Icp(Arena& arena, std::uint32_t correspondence_capacity)
      : data_(arena.allocate<DataPoint>(correspondence_capacity)) {}

  /// Finds model_from_data from the initial one. `trace`, if not empty, takes what each iteration did.
  /// Data samples beyond the capacity are thinned out evenly. An empty model, one of more than
  /// maximum_model_scans, or data without samples: too_few_correspondences.
  [[nodiscard]] IcpResult match(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                const Pose& initial_model_from_data, const IcpConfig& config,
                                std::span<IcpIteration> trace = {});

  static constexpr std::uint32_t maximum_shift_steps = 64;
  static constexpr std::uint32_t maximum_facing_samples = 192;

  /// Of the samples whose plane faces along `direction` (model frame, unit), thinned out evenly to at most
  /// maximum_facing_samples: how many lie on the model, to within fit_distance_m along their normal.
  /// Cost: a short search in a tree for each.
  [[nodiscard]] FacingFit facing_fit(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                     const Pose& model_from_data, const Eigen::Vector3d& direction,
                                     const IcpConfig& config);

  /// Where else along a line the data may lie: facing_fit with the data shifted along `direction` by -steps
  /// ... +steps (at most maximum_shift_steps) times step_m. Writes the shifts where the most samples fit, at
  /// most shifts_m.size(), best first, as long as they are more than where the data lie; returns how many.
  /// Cost: that of facing_fit for each shift.
  [[nodiscard]] std::uint32_t likely_shifts(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                            const Pose& model_from_data, const Eigen::Vector3d& direction,
                                            double step_m, std::uint32_t steps, const IcpConfig& config,
                                            std::span<double> shifts_m);

 private:
  struct DataPoint {
    Point point;            // data frame
    Point normal;           // data frame
    float plane_weight;     // 0: no plane
    std::uint32_t model;    // scan that the sample asked last
    std::uint32_t nearest;  // what it answered
    Point asked;            // from where, in that scan's frame
    float others_m;         // how far from there all other points of that scan are at least
  };
  static void find_nearest(DataPoint& point, std::uint32_t m, const KdTree& tree, const Point& place,
                           float limit_m);

  std::uint32_t gather(std::span<const IcpScan> data);
  std::uint32_t gather_facing(std::span<const IcpScan> data, const Pose& model_from_data,
                              const Eigen::Vector3d& direction);
  [[nodiscard]] static std::uint32_t count_fitting(std::span<const IcpScan> model,
                                                   std::span<const DataPoint> points,
                                                   const Pose& model_from_data, const IcpConfig& config);

  std::span<DataPoint> data_;
};

}  // namespace alces
