// Which configurations a mapper takes: every number is finite and in a range that does no harm.
#include <algorithm>

#include "alces/mapper.h"

namespace alces {
namespace {

// False for NaN, too.
bool is_within(double value, double least, double most) {
  return value >= least && value <= most;
}
bool is_within(float value, double least, double most) {
  return is_within(static_cast<double>(value), least, most);
}

constexpr double shortest_m = 1e-3;  // of what has to have a length
constexpr double longest_m = 1e4;    // of what a scanner sees

bool is_usable(const IcpConfig& config) {
  return config.maximum_iterations > 0 && config.minimum_correspondences >= 3 &&
         is_within(config.first_distance_limit_m, shortest_m, longest_m) &&
         is_within(config.last_distance_limit_m, shortest_m, longest_m) &&
         is_within(config.limit_factor, 0.01, 1) && is_within(config.translation_epsilon_m, 0, longest_m) &&
         is_within(config.rotation_epsilon_rad, 0, 4) && is_within(config.robust_factor, 0, 1e6) &&
         is_within(config.robust_scale_m, 0, longest_m) && is_within(config.rough_weight, 0, 1) &&
         is_within(config.fit_distance_m, 0, longest_m) && is_within(config.degenerate_ratio, 0, 1) &&
         is_within(config.finish_robust_factor, 0, 1e6) && is_within(config.uncertainty.noise, 0, 1e6) &&
         is_within(config.uncertainty.pull, 0, 1e6);
}

bool is_usable(const VoxelGridConfig& config) {
  return config.cell_capacity > 0 && config.cell_capacity <= KdTree::maximum_points &&
         is_within(config.cell_size_m, shortest_m, longest_m) &&
         is_within(config.minimum_range_m, 0, longest_m) && is_within(config.maximum_range_m, 0, longest_m) &&
         config.minimum_range_m < config.maximum_range_m;
}

bool is_usable(const SurfaceConfig& config) {
  return config.sample_capacity > 0 && config.neighbors >= 3 &&
         config.neighbors <= KdTree::maximum_neighbors && is_within(config.neighbor_reach, 1, 100);
}

bool is_usable(const EdgeUncertainty& config) {
  return is_within(config.inflation, 1e-6, 1e6) &&
         is_within(config.minimum_translation_m, 1e-12, longest_m) &&
         is_within(config.minimum_rotation_rad, 1e-12, 10) && is_within(config.unconverged_factor, 1, 1e6);
}

bool is_usable(const LoopSearchConfig& config) {
  return config.candidates > 0 && config.iterations > 0 && is_within(config.sure_overlap, 0, 1) &&
         is_within(config.sure_fit_share, 0, 10) && is_within(config.shift_step_m, 0.01, longest_m) &&
         config.shift_steps <= Icp::maximum_shift_steps && is_within(config.shift_gain, 0, 1);
}

bool is_usable(const MotionUncertainty& config) {
  return is_within(config.odometry_m_per_m, 1e-6, longest_m) &&
         is_within(config.odometry_rad_per_m, 1e-6, 10) &&
         is_within(config.without_odometry_m, 1e-6, longest_m) &&
         is_within(config.without_odometry_rad, 1e-6, 10) && is_within(config.steps_assumed, 0.1, 1e6) &&
         is_within(config.steps_remembered, 2, 1e6);
}

bool is_usable(const StepVerification& config) {
  return is_within(config.minimum_overlap, 0, 1) && is_within(config.usual_fit_share, 0, 1) &&
         is_within(config.least_fit_share, 0, 1) && is_within(config.minimum_fit, 0, 1) &&
         is_within(config.held_fit_share, 0, 1) && is_within(config.maximum_mahalanobis2, 0, 1e12);
}

bool is_usable(const StartSearchConfig& config) {
  return is_within(config.cell_m, 0.05, longest_m) && is_within(config.reach_m, 0, 60) &&
         is_within(config.reach_m / config.cell_m, 0, 60) && is_within(config.turn_step_rad, 0.025, 4) &&
         config.iterations > 0 && is_within(config.gain, 0, 1) &&
         is_within(config.gain_against_odometry, 0, 1);
}

bool is_usable(const LoopVerification& config) {
  return is_within(config.known_m, 0, longest_m) && is_within(config.minimum_overlap, 0, 1) &&
         is_within(config.maximum_rms_m, 0, longest_m) && is_within(config.maximum_mahalanobis2, 0, 1e12) &&
         is_within(config.minimum_wall_fit, 0, 1) && is_within(config.minimum_fit_share, 0, 10) &&
         is_within(config.small_correction_m, 0, longest_m) && is_within(config.ambiguity_sigmas, 0, 100) &&
         is_within(config.free_space_sigmas, 0, 100);
}

}  // namespace

Status Mapper::validate(const MapperConfig& config) {
  constexpr std::uint32_t most = Icp::maximum_model_scans;
  if (config.scans_around_first > most || config.scans_before_last > most) return Status::bad_config;
  if (std::uint64_t{config.scan_capacity} + config.loop_capacity > INT32_MAX) return Status::bad_config;
  // Scans looked at together must all have a slot.
  const std::uint32_t around_loop = 2 * config.scans_around_first + 1 + config.scans_before_last + 1;
  const std::uint32_t together = std::max(config.model_scans + 1, around_loop);
  const bool is_good =
      config.scan_capacity > 0 && config.correspondence_capacity > 0 && config.model_scans > 0 &&
      config.model_scans <= most && around_loop <= most && config.cache_slots >= together &&
      is_within(config.trigger.hysteresis_m, 0, longest_m) && is_usable(config.voxel) &&
      is_usable(config.surface) && is_usable(config.scan_match) && is_usable(config.loop_match) &&
      is_usable(config.edge_uncertainty) && is_usable(config.motion) && is_usable(config.step_verification) &&
      is_usable(config.start_search) && is_within(config.pair_reach, 0, 100) &&
      is_within(config.longest_reach_m, shortest_m, longest_m) && is_usable(config.loop_search) &&
      is_usable(config.loop_verification) && LoopDetector::validate(config.detector) == Status::ok;
  return is_good ? Status::ok : Status::bad_config;
}

}  // namespace alces
