// The mapper: scans in, a loop-closed map out, in one block of memory.
//
//   add_scan: reduce -> store -> predict -> match against the last scans -> edge -> detect -> close (ELCH)
//
// Paper: sections 3.1 to 3.6. All memory comes from the block; nothing is allocated after create(). Two
// mappers in two blocks do not know of each other. One thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "alces/arena.h"
#include "alces/free_space.h"
#include "alces/held_directions.h"
#include "alces/icp.h"
#include "alces/loop_correction.h"
#include "alces/loop_detector.h"
#include "alces/loop_relaxation.h"
#include "alces/map_verdict.h"
#include "alces/motion_prior.h"
#include "alces/pair_covariance.h"
#include "alces/pose.h"
#include "alces/pose_graph.h"
#include "alces/scan_archive.h"
#include "alces/scan_signature.h"
#include "alces/scan_store.h"
#include "alces/start_search.h"
#include "alces/status.h"
#include "alces/step_judge.h"
#include "alces/voxel_grid.h"

namespace alces {

/// When a loop is believed before it bends the map. A refused loop is reported with its reason.
struct LoopVerification {
  /// A loop is only matched where the map can be off by more than this (standard deviation): what closes
  /// nothing is not added. While loops are used up faster than scans, it grows (see Mapper), so that a patrol
  /// over the same streets never runs out of loops before it runs out of scans.
  double known_m = 0.03;
  double minimum_overlap = 0.4;  ///< share of the data's samples that find a correspondence, 0 to 1
  double maximum_rms_m = 0.10;   ///< of the residuals of the match
  /// Squared length of the correction against the uncertainty accumulated along the loop: 6.5 standard
  /// deviations, because the errors of steps have heavy tails (a turn among trees, a crowd). Less where the
  /// uncertainty holds many places.
  double maximum_mahalanobis2 = 42;
  /// Where walls are few, the ground alone gives a good overlap and small residuals anywhere. So of the
  /// samples that face along the two weaker directions of the match this share has to lie on the model.
  double minimum_wall_fit = 0.15;
  double minimum_fit_share = 0.7;   ///< of the fit that is usual on this drive, if l moves by more than that:
  double small_correction_m = 0.5;  ///< of what l sees 15 m away: up to here no walls are asked for
  /// A loop is refused if the scans fit as well elsewhere along a weak direction, as far as the map can be
  /// off (this many standard deviations); 0: that is not asked.
  double ambiguity_sigmas = 3;
  /// A loop is refused if what both ends see stands in the other's free space, or if nothing has stood there
  /// before the correction, so that nothing speaks for it (this many standard deviations); 0: not asked.
  double free_space_sigmas = 2;
};

/// Where the match of a loop starts beside where the poses say.
///
/// Searched: a drift of many degrees or metres is beyond the reach of ICP. Where the first match is not sure,
/// StartSearch looks for other starts, as far around as the map can be off.
///
/// Shifted: between long walls a match comes together anywhere along them, because what lies across is few
/// samples, and robust weights take them for the odd ones out. So those few are asked alone, where along the
/// weakest direction they fit best (Icp::likely_shifts), and the match starts anew from the best three such
/// places; one where more of all samples come to lie on the model (IcpResult::fit) wins.
struct LoopSearchConfig {
  double sure_overlap = 0.6;      ///< from here on no other start is tried ...
  double sure_fit_share = 0.8;    ///< ... if the surfaces fit so well, too, as a share of what is usual
  std::uint32_t iterations = 12;  ///< of each shifted start; searched ones: StartSearchConfig
  double shift_step_m = 0.1;
  std::uint32_t shift_steps = 40;  ///< to each side, at most Icp::maximum_shift_steps; 0: the paper
  double shift_gain = 0.005;       ///< of the fit, by which a shift has to better it
  std::uint32_t candidates =
      3;  ///< when the nearest scan is refused, so many in all: each of an earlier visit
};

/// Capacities as on a vehicle; `alces map` takes larger scans and what memory it is given (map.toml).
struct MapperConfig {
  std::uint32_t scan_capacity = 1024;
  std::uint32_t loop_capacity = 1024;  ///< loops closed; one more edge each
  std::size_t pool_bytes = std::size_t{32} << 20;
  std::uint32_t cache_slots = 16;

  VoxelGridConfig voxel;        ///< cell_capacity is also the most points that a stored scan has
  bool keep_intensity = false;  ///< of scans that bring it: a byte a point stored
  SurfaceConfig surface;

  /// Residuals that count little begin early, and pairs are near: what is paired wrongly on the ground is a
  /// wall's foot or a car, always above it, and would pitch every step a little upward.
  IcpConfig scan_match{
      .last_distance_limit_m = 0.5F, .robust_factor = 2.5F, .robust_scale_m = 0.02F, .finish_iterations = 8};
  float pair_reach = 2;  ///< pairs may be this many times the scan's typical spacing apart, or the last limit
  std::uint32_t model_scans = 3;  ///< the last k scans that a new one is matched to; 1: pairwise
  /// Sparse scans have gaps, which older ones fill: the model takes more scans until it has this many points,
  /// as far back as half the typical range, and as the cache has slots. 0: never.
  std::uint32_t model_points = 12000;
  MotionUncertainty motion;
  bool use_motion_prior = true;  ///< the prediction holds a match where the scans leave it open
  float longest_reach_m = 6;     ///< pairs of a first iteration, however far predictions are off
  StepVerification step_verification;
  bool judge_steps = true;   ///< a match that is not believed gives way to the odometry
  bool search_steps = true;  ///< and other starts are looked for before
  StartSearchConfig start_search;
  std::uint32_t correspondence_capacity = 4096;
  bool label_with_appendix_a =
      false;  ///< edges' variances from Appendix A instead of the curvature minimised on
  EdgeUncertainty edge_uncertainty;

  /// The radius reaches farther as the pose becomes less sure; scan_capacity is set from the above.
  LoopDetectorConfig detector{.scan_capacity = 0, .radius_m = 8, .radius_cap_m = 15, .sigma_factor = 1};
  LoopTriggerConfig trigger{.repeat_after_scans = 3};
  bool close_loops = true;
  IcpConfig loop_match{.maximum_iterations = 20,
                       .first_distance_limit_m = 4,
                       .last_distance_limit_m = 0.5F,
                       .robust_factor = 2.5F,
                       .robust_scale_m = 0.02F,
                       .finish_iterations = 8};
  std::uint32_t scans_around_first = 2;  ///< the start metascan: f - 2 .. f + 2
  std::uint32_t scans_before_last = 2;   ///< the end metascan: l - 2 .. l
  LoopSearchConfig loop_search;
  LoopVerification loop_verification;
  CorrectionRule correction_rule = CorrectionRule::trails;

  /// The better front end (default), and the paper's as it was published.
  [[nodiscard]] static constexpr MapperConfig standard();
  [[nodiscard]] static constexpr MapperConfig paper();
};

enum class LoopVerdict : std::uint8_t {
  closed,
  known,                ///< not matched: it would tell nothing that the map does not know
  refused_no_match,     ///< the metascans did not come together
  refused_overlap,      ///< too few points found a partner
  refused_residual,     ///< they came together badly
  refused_walls,        ///< nothing but the ground fits
  refused_fit,          ///< the surfaces fit worse than those of the drive's steps
  refused_ambiguous,    ///< the scans fit as well elsewhere, and the map cannot tell
  refused_free_space,   ///< surfaces would stand where the other end looked through
  refused_needless,     ///< the map does not contradict itself where it is: nothing speaks for the correction
  refused_implausible,  ///< the correction is larger than the accumulated uncertainty explains
  refused_capacity,     ///< no room for the edge
  refused_archive,      ///< a scan of the loop could not be brought back
};
[[nodiscard]] const char* to_string(LoopVerdict verdict);

/// One loop that was offered, closed or not.
struct LoopReport {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  LoopVerdict verdict = LoopVerdict::refused_no_match;
  double distance_m = 0;  ///< between the two poses when the loop was offered
  double overlap = 0;     ///< share of the data's samples with a correspondence, 0 to 1
  double rms_m = 0;       ///< of what the match minimised
  double wall_fit = 0;    ///< share of l's samples that face along the match's two weaker directions, and fit
  double mahalanobis2 = 0;
  double correction_m = 0;  ///< how far l moved against f
  double correction_rad = 0;
  double fit = 0;         ///< IcpResult::balanced_fit
  double usual_fit = 0;   ///< of the steps, at the time
  double expected_m = 0;  ///< standard deviation of l's place against f, before
  std::uint32_t iterations = 0;
  /// Surfaces of one end that stand in free space of the other, as a share of those that the other can tell
  /// of (FreeSpaceCount::share): where the map had l, where the match has it, and between neighbouring scans.
  FreeSpaceCount before;
  FreeSpaceCount after;
  FreeSpaceCount usual;
  /// Refused, and where the map has them the two ends do not see each other (alces::lies_apart): two places
  /// that look alike. Such a loop says nothing against the map.
  bool lies_apart = false;
  std::uint64_t share_ns = 0;  ///< LOA and sharing out, or the LoopRelaxation; 0 without a clock
};

/// Where add_scan's time went, if a clock was given (ns).
struct StageTimes {
  std::uint64_t reduce_ns = 0;
  std::uint64_t store_ns = 0;  ///< quantise, tree, surface
  std::uint64_t match_ns = 0;
  std::uint64_t detect_ns = 0;
  std::uint64_t loop_match_ns = 0;
  std::uint64_t loop_share_ns = 0;  ///< LOA and sharing out, or the LoopRelaxation
};

struct ScanReport {
  std::uint32_t scan = 0;  ///< index of the scan in the map
  VoxelGridCounts points;
  IcpVerdict match = IcpVerdict::converged;  ///< also of scan 0, which has nothing to be matched to
  std::uint32_t iterations = 0;
  std::uint32_t correspondences = 0;
  double overlap = 0;
  double fit = 0;
  double rms_m = 0;
  std::uint32_t samples = 0;   ///< of the scan's surface ...
  std::uint32_t surfaces = 0;  ///< ... and how many of them have a plane
  HeldDirections held;         ///< by that match alone: what odometry holds is not in it
  StepVerdict step = StepVerdict::first;
  StepDoubt doubt = StepDoubt::none;  ///< of the last match that was tried
  double motion_mahalanobis2 = 0;     ///< of that match, against the prediction
  bool is_predicted = false;          ///< the match is not believed: the pose is the prediction's
  bool archive_failed = false;        ///< a scan to match with could not be brought back
  bool loop_offered = false;
  LoopReport loop;
  StageTimes times;
};

/// A clock for StageTimes; the library reads none of its own.
class StageClock {
 public:
  [[nodiscard]] virtual std::uint64_t now_ns() = 0;

 protected:
  ~StageClock() = default;
};

class Mapper {
 public:
  /// What its stored scans hold beside points and samples.
  [[nodiscard]] static constexpr ChannelCapacity stored_channels(const MapperConfig& config) {
    return {config.keep_intensity, false, ScanSignature::stored_bytes};
  }

  /// Bytes that create() needs for this configuration; constexpr, so that it can size a static array.
  [[nodiscard]] static constexpr std::size_t memory_required(const MapperConfig& config);

  /// bad_config: a number that is not finite, out of range, or too small for another (cache_slots must hold
  /// the scans that are looked at together). O(1).
  [[nodiscard]] static Status validate(const MapperConfig& config);

  /// Lays a mapper out in `block` (64-byte aligned), which must outlive it. Null, and `status` says why:
  /// block_too_small, block_misaligned, bad_config. `relaxation`, unless null, bends the map in LOA's place.
  [[nodiscard]] static Mapper* create(std::span<std::byte> block, const MapperConfig& config, Status& status,
                                      ScanArchive* archive = nullptr, StageClock* clock = nullptr,
                                      LoopRelaxation* relaxation = nullptr);

  /// Appends a scan: points in the body frame, metres, at its reference time; odometry in any fixed frame, or
  /// null to assume constant velocity. `gps_position_m`, or null: in any metric frame, used to detect loops
  /// only; one that is not finite is left out and counted. `intensity`: empty, or of each point; kept with
  /// the points that stay if config.keep_intensity. When the status is not ok (empty_scan; bad_pose, also of
  /// a prediction farther than farthest_place_m; bad_channel; a capacity; an archive that fails) the scan was
  /// not added and the map so far stays whole; no_voxel_capacity: it was added, downsampled coarser
  /// (report.points.cell_size_m). Cost: O(p log p) for p points, and scan_match's bound on iterations x
  /// samples searches; when a loop is closed also loop_match's, at most candidates x (2 turn_steps + 5)
  /// times, and O(scans) to share out.
  [[nodiscard]] Status add_scan(std::span<const Point> points, const Pose* odometry_from_body,
                                ScanReport& report, const Eigen::Vector3d* gps_position_m = nullptr,
                                std::span<const std::uint8_t> intensity = {});

  /// The drive ends: closes the loop of an approach that still goes on. True: `loop` says what came of it,
  /// and `times`, unless null, what it took.
  bool finish(LoopReport& loop, StageTimes* times = nullptr);

  /// A loop that somebody else detected: scan `last` was taken where scan `first` was. Matched, judged and
  /// shared out as any other, at the cost of a loop in add_scan. no_such_scan.
  [[nodiscard]] Status offer_loop(std::uint32_t first, std::uint32_t last, LoopReport& loop);

  [[nodiscard]] const PoseGraph& graph() const { return graph_; }
  [[nodiscard]] std::uint32_t scan_count() const { return graph_.vertex_count(); }

  /// What the map is worth as it stands. O(scans + loops).
  [[nodiscard]] MapHealth health() const;

  /// How the scan was placed. `scan` below scan_count().
  [[nodiscard]] StepVerdict step_verdict(std::uint32_t scan) const { return steps_[scan].verdict; }

  /// How sure a scan's place is relative to scan 0, variances summed over the axes; grows along the drive,
  /// falls back when a loop is closed.
  struct PoseUncertainty {
    double translation_m2 = 0;
    double rotation_rad2 = 0;
  };
  /// `scan` below scan_count().
  [[nodiscard]] const PoseUncertainty& pose_uncertainty(std::uint32_t scan) const {
    return uncertainties_[scan];
  }

  /// The loops offered so far, in order, up to four times loop_capacity of them.
  [[nodiscard]] std::span<const LoopReport> loops() const { return loops_.first(loop_count_); }

  /// Reduced points of a scan, body frame, metres, as they are stored; `count` says how many.
  /// buffer_too_small, no_such_scan, archive_read_failed.
  [[nodiscard]] Status read_scan(std::uint32_t scan, std::span<Point> points, std::uint32_t& count);

  /// A scan's record as it is stored (stored_scan.h); valid until the next call of a function that is not
  /// const. no_such_scan, archive_read_failed.
  [[nodiscard]] Status read_record(std::uint32_t scan, std::span<const std::byte>& record) {
    return store_.read_record(scan, record);
  }

  struct Counters {
    std::uint64_t points_in = 0;
    std::uint64_t points_not_finite = 0;
    std::uint64_t points_too_near = 0;
    std::uint64_t points_too_far = 0;
    std::uint64_t points_without_cell = 0;
    std::uint32_t scans_refused = 0;     ///< add_scan() said no
    std::uint32_t scans_predicted = 0;   ///< their match failed
    std::uint32_t archive_failures = 0;  ///< scans to match with could not be brought back
    std::uint32_t gps_not_finite = 0;    ///< positions that were left out
    std::uint32_t loops_offered = 0;
    std::uint32_t loops_closed = 0;
    std::uint32_t loops_known = 0;        ///< would have told nothing that the map does not know: not matched
    std::uint32_t loops_not_listed = 0;   ///< beyond the capacity of loops()
    std::uint32_t loops_not_relaxed = 0;  ///< the LoopRelaxation could not, LOA did
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] const ScanStore::Counters& store_counters() const { return store_.counters(); }
  [[nodiscard]] const MapperConfig& config() const { return config_; }

  /// Of the block: memory_required() of this configuration, to the byte.
  [[nodiscard]] std::size_t used_bytes() const { return used_bytes_; }

 private:
  friend class Arena;
  constexpr Mapper(Arena& arena, const MapperConfig& config);

  struct Step {
    Pose last_from_next;
    EdgeVariance variance;
    StepVerdict verdict = StepVerdict::first;
    double support = 1;  // share of the samples with a partner, by how well they fit it of what is usual
    bool has_odometry = false;
  };
  struct StepRecord {  // what is kept of a step
    StepVerdict verdict = StepVerdict::first;
    std::uint8_t support_percent = 100;  // at most 255
    bool has_odometry = false;           // that was trusted
    bool is_spanned = false;             // by a loop, which says how far off it can be
  };
  [[nodiscard]] Status refuse(Status status);
  [[nodiscard]] Status predict(const Pose* odometry_from_body, MotionPrior::Prediction& prediction) const;
  [[nodiscard]] Status reduce(std::span<const Point> points, ScanReport& report);
  [[nodiscard]] Status store(std::span<const std::uint8_t> intensity, ScanReport& report);
  void place(const MotionPrior::Prediction& prediction, const Pose* odometry_from_body, ScanReport& report);
  [[nodiscard]] Step match_step(std::uint32_t n, const MotionPrior::Prediction& prediction,
                                ScanReport& report);
  [[nodiscard]] std::uint32_t model_begin(std::uint32_t n);
  [[nodiscard]] IcpConfig step_config(const MotionPrior::Prediction& prediction,
                                      const ScanSpacing& spacing) const;
  [[nodiscard]] bool search_step(std::span<const IcpScan> model, const IcpScan& data,
                                 const Pose& map_from_last, const MotionPrior::Prediction& prediction,
                                 const IcpConfig& config, IcpResult& match);
  [[nodiscard]] bool try_starts(std::span<const IcpScan> model, const IcpScan& data,
                                std::span<const Start> starts, double gain, const IcpConfig& config,
                                const IcpPrior* prior, IcpResult& best);
  [[nodiscard]] bool search_against_odometry(std::span<const IcpScan> model, const IcpScan& data,
                                             const Pose& map_from_last, const ScanSpacing& spacing,
                                             const MotionPrior::Prediction& prediction,
                                             const IcpConfig& config, IcpResult& match, StepDoubt& doubt);
  void widen_for_motion_within(const IcpResult& match, EdgeVariance& variance) const;
  void add_step(std::uint32_t n, const Step& step);
  void look_for_loop(std::uint32_t n, const Eigen::Vector3d* gps_position_m, ScanReport& report);
  [[nodiscard]] bool load_metascan(std::uint32_t begin, std::uint32_t end, const Pose& map_from_side,
                                   std::span<IcpScan> scans, std::uint32_t& count);
  [[nodiscard]] IcpResult match_loop(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                     const IcpPrior& prior, const IcpConfig& config,
                                     const Eigen::Quaterniond& map_from_f);
  [[nodiscard]] IcpResult match_searched(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                         const IcpPrior& prior, const IcpConfig& config,
                                         const Eigen::Quaterniond& map_from_f, const IcpResult& straight);
  [[nodiscard]] IcpResult match_shifted(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                        const IcpConfig& config, const IcpPrior* prior,
                                        const IcpResult& match);
  void look_through(std::uint32_t f, std::uint32_t l, const Pose& f_from_matched, float tolerance_m,
                    LoopReport& loop);
  [[nodiscard]] bool is_ambiguous(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                  const IcpPrior& prior, const IcpResult& match, const IcpConfig& config);
  [[nodiscard]] LoopVerdict judge_fit(const IcpResult& match, const LoopReport& loop) const;
  [[nodiscard]] double wall_fit(std::span<const IcpScan> model, const IcpScan& scan_l,
                                const IcpResult& match);
  /// The edge's costs: what the match knows of its own uncertainty.
  [[nodiscard]] EdgeVariance match_variance(const IcpResult& match, const IcpPrior* prior) const;
  void close_loop(LoopTrigger::Loop candidate, std::uint32_t tries, LoopReport& loop, StageTimes& times);
  void judge_loop(const LoopTrigger::Loop& candidate, bool may_skip_known, LoopReport& loop,
                  StageTimes& times);
  [[nodiscard]] double known_m() const;
  [[nodiscard]] Status bend(const Edge& edge, const Pose& map_from_l);
  [[nodiscard]] std::uint64_t now_ns() const { return clock_ == nullptr ? 0 : clock_->now_ns(); }

  static constexpr std::uint32_t maximum_metascan = Icp::maximum_model_scans;

  MapperConfig config_;
  VoxelGrid voxel_grid_;
  std::span<Point> reduced_;
  std::span<std::uint8_t> reduced_intensity_;  // empty: none is kept
  ScanStore store_;
  Icp icp_;
  StartSearch start_search_;
  FreeSpace free_space_;
  PoseGraph graph_;
  LoopDetector detector_;
  LoopTrigger trigger_;
  LoopCorrection correction_;
  std::span<PoseUncertainty> uncertainties_;
  std::span<StepRecord> steps_;
  std::span<LoopReport> loops_;
  StageClock* clock_ = nullptr;
  LoopRelaxation* relaxation_ = nullptr;
  std::span<MotionPrior> motion_;  // one
  UsualFit usual_fit_;
  double driven_m_ = 0;
  bool has_planar_odometry_ = false;
  std::size_t used_bytes_ = 0;
  std::uint32_t loop_count_ = 0;
  Counters counters_;
};

constexpr MapperConfig MapperConfig::standard() {
  return MapperConfig{};
}

constexpr MapperConfig MapperConfig::paper() {
  MapperConfig config;
  config.scan_match.metric = IcpMetric::point_to_point;
  config.scan_match.last_distance_limit_m = 0.8F;
  config.scan_match.robust_factor = 0;
  config.scan_match.maximum_iterations = 50;
  config.loop_match = config.scan_match;
  config.loop_match.first_distance_limit_m = 4;
  config.detector = LoopDetectorConfig{};
  config.model_scans = 1;
  config.model_points = 0;
  config.motion.learn_heading = false;
  config.motion.learn_delay = false;
  config.use_motion_prior = false;
  config.judge_steps = false;
  config.search_steps = false;
  config.pair_reach = 0;
  config.label_with_appendix_a = true;
  config.edge_uncertainty = {
      .inflation = 1, .minimum_translation_m = 1e-6, .minimum_rotation_rad = 1e-7, .unconverged_factor = 1};
  config.trigger.repeat_after_scans = 0;
  config.loop_search.shift_steps = 0;
  config.loop_search.candidates = 1;
  config.correction_rule = CorrectionRule::paper;
  // The paper has no test of belief: a sharp one would refuse what its scan-to-scan drift leaves.
  config.loop_verification.maximum_rms_m = 0.5;
  config.loop_verification.maximum_mahalanobis2 = 3000;
  config.loop_verification.minimum_wall_fit = 0;
  config.loop_verification.minimum_fit_share = 0;
  config.loop_verification.known_m = 0;
  config.loop_verification.ambiguity_sigmas = 0;
  config.loop_verification.free_space_sigmas = 0;
  return config;
}

constexpr Mapper::Mapper(Arena& arena, const MapperConfig& config)
    : config_(config),
      voxel_grid_(arena, config.voxel),
      reduced_(arena.allocate<Point>(config.voxel.cell_capacity)),
      reduced_intensity_(
          arena.allocate<std::uint8_t>(config.keep_intensity ? config.voxel.cell_capacity : 0)),
      store_(arena, {config.scan_capacity, config.voxel.cell_capacity, config.pool_bytes, config.cache_slots,
                     config.surface, stored_channels(config)}),
      icp_(arena, config.correspondence_capacity),
      start_search_(arena),
      free_space_(arena),
      graph_(arena, {config.scan_capacity, config.scan_capacity + config.loop_capacity}),
      detector_(arena, config.detector),
      trigger_(config.trigger),
      correction_(arena, {config.scan_capacity, config.scan_capacity + config.loop_capacity}),
      uncertainties_(arena.allocate<PoseUncertainty>(config.scan_capacity)),
      steps_(arena.allocate<StepRecord>(config.scan_capacity)),
      loops_(arena.allocate<LoopReport>(4 * std::size_t{config.loop_capacity})),
      motion_(arena.allocate<MotionPrior>(1)) {}

constexpr std::size_t Mapper::memory_required(const MapperConfig& config) {
  Arena arena;
  MapperConfig planned = config;
  planned.detector.scan_capacity = config.scan_capacity;
  arena.allocate<std::byte>(sizeof(Mapper));
  const Mapper mapper(arena, planned);
  return arena.overflowed() ? SIZE_MAX : arena.used_bytes();
}

}  // namespace alces
