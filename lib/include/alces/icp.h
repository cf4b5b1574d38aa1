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
// Time: at most (iterations and those that finish) x samples nearest-neighbour queries.
// Memory: 56 bytes a correspondence of capacity.
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

/// How far off a match is for its curvature.
///
/// The errors of correspondences are not independent. Wrong normals and wrong partners pull as one force, the
/// harder the fewer samples hold a direction: of n correspondences with residuals of rms s, a force of
/// sqrt(n * pull) * s in every direction. With H the curvature of squares, L the samples' typical distance:
///   C = s^2 H^-1 (noise H + pull n diag(1, 1, 1, L^2, L^2, L^2)) H^-1
/// Measured on drives whose truth is known: docs/benchmarks.md.
struct IcpUncertainty {
  double noise = 2;
  double pull = 0.1;
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
      1e-3F;                     ///< smallest over largest curvature below this: a direction is undetermined
  IcpUncertainty uncertainty{};  ///< what a prior is weighed against
  /// A sample is paired only with what was seen from the same side: the two faces of a wall are no pair.
  bool same_side = true;
  /// Half of the samples are the model's, and ask the data: what is paired wrongly where one side sees more
  /// densely than the other pulls both ways then, and does not add up over a drive. Surface metric only.
  bool both_ways = true;
  /// Samples ask the other side's scans in turn, so that many scans take no longer than one. They are dealt
  /// into so many groups first, and a sample asks a group for the nearest: sparse scans fill each other's
  /// gaps. 0: each scan is a group. Mapper's steps: model_scans.
  std::uint32_t groups = 0;
  /// Surface metric: what has converged, with half of the surfaces on each other, goes on for at most so many
  /// iterations with all samples of the data, robust weights of this factor, and along directions that are
  /// well held only. 0: it does not. The other figures of the result are those of before.
  std::uint32_t finish_iterations = 0;
  float finish_robust_factor = 2.0F;
};

/// What is known of a match before it is made: of odometry, or of the map so far. It holds the match along
/// the directions that the scans leave open, as strongly as its covariance says.
struct IcpPrior {
  Pose model_from_data;
  /// Of the data's place and orientation: covariance of (translation m, rotation vector rad), model frame.
  Matrix6d covariance = Matrix6d::Identity();
};

/// One scan on either side of a match.
struct IcpScan {
  const KdTree* tree = nullptr;
  std::span<const SurfaceSample> samples;  ///< what asks
  Pose side_from_body;                     ///< into the common frame of its side (model or data)
};

enum class IcpVerdict : std::uint8_t {
  converged,
  iteration_limit,          ///< the last iteration still moved; the pose is the best so far
  too_few_correspondences,  ///< nothing to stand on: the pose is the initial one
  degenerate,               ///< a direction is undetermined (see weak_direction); nothing was moved along it
};
[[nodiscard]] const char* to_string(IcpVerdict verdict);

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
  std::uint32_t behind = 0;           ///< of those, found what was seen from the other side
  double overlap = 0;                 ///< share of the data's samples that have one
  double fit = 0;  ///< share of all samples that lie on the model, to within fit_distance_m
  /// The same for the surfaces that face along each of three axes, and of these shares the mean: the ground
  /// fits wherever a vehicle may be, so that it must not outvote the walls.
  double balanced_fit = 0;
  double rms_m = 0;  ///< of what is minimised: along normals, or of whole distances
  /// Of model_from_data: inverse covariance of a left perturbation (translation m, rotation vector rad) in
  /// the model frame; all correspondences taken as independent. A prior is not in it.
  Matrix6d information = Matrix6d::Zero();
  double lever_m = 1;  ///< the samples' typical distance, by which a rotation moves them
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

struct FloatTransform;

class Icp {
 public:
  static constexpr std::uint32_t maximum_model_scans = 16;

  constexpr Icp(Arena& arena, std::uint32_t correspondence_capacity)
      : samples_(arena.allocate<Sample>(correspondence_capacity)) {}

  /// Finds model_from_data from the initial one. `prior`, unless null, weighs in.
  /// `trace`, if not empty, takes what each iteration did.
  /// Data samples beyond the capacity are downsampled evenly. An empty model, one of more than
  /// maximum_model_scans, or data without samples: too_few_correspondences.
  [[nodiscard]] IcpResult match(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                const Pose& initial_model_from_data, const IcpConfig& config,
                                const IcpPrior* prior = nullptr, std::span<IcpIteration> trace = {});

  static constexpr std::uint32_t maximum_shift_steps = 64;
  static constexpr std::uint32_t maximum_facing_samples = 192;

  /// Of the samples whose plane faces along `direction` (model frame, unit), downsampled evenly to at most
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

  /// Whether the data lie clearly better on the model than shifted along `direction` to anywhere between
  /// `least_m` and `most_m`. Asked are the samples whose plane faces along it, and those without a plane, as
  /// poles and trees are; each place is compared by the samples that lie on the model at one of the two
  /// places only (McNemar's test, 2 standard deviations). What is nearer than three fit_distance_m is the
  /// same place. At most 2 * maximum_shift_steps places, spread evenly. Cost: that of facing_fit for each.
  [[nodiscard]] bool is_held(std::span<const IcpScan> model, std::span<const IcpScan> data,
                             const Pose& model_from_data, const Eigen::Vector3d& direction, double least_m,
                             double most_m, const IcpConfig& config);

 private:
  struct Direction;
  struct FacingShares;
  struct Sample {
    Point point;            // frame of its side
    Point normal;           // frame of its side
    float plane_weight;     // 0: no plane
    float incidence;        // cosine between the normal and the way to the scanner
    std::uint32_t scan;     // of the other side, that the sample asked last
    std::uint32_t nearest;  // what it answered
    Point asked;            // from where, in that scan's frame
    float others_m;         // how far from there all other points of that scan are at least
  };
  static void find_nearest(Sample& point, std::uint32_t scan, const KdTree& tree, const Point& place,
                           float limit_m);

  void finish(std::span<const IcpScan> model, std::span<const IcpScan> data, const IcpConfig& config,
              const IcpPrior* prior, IcpResult& result);

  /// Samples spread evenly over those of the scans, as many as there is room for.
  static std::span<Sample> gather(std::span<const IcpScan> scans, std::span<Sample> room);
  std::uint32_t gather_facing(std::span<const IcpScan> data, const Pose& model_from_data,
                              const Eigen::Vector3d& direction, bool with_rough);
  /// Whether a sample lies on one of the model's scans, to within fit_distance_m.
  [[nodiscard]] static bool is_fitting(const IcpScan& scan, const Sample& sample,
                                       const FloatTransform& body_from_data, const IcpConfig& config);
  [[nodiscard]] static std::uint32_t count_fitting(std::span<const IcpScan> model,
                                                   std::span<const Sample> points,
                                                   const Pose& model_from_data, const IcpConfig& config);

  std::span<Sample> samples_;
};

}  // namespace alces
