// The one list of a mapper's keys: their tables, names, ranges and comments, shared by all that reads or
// writes them (map.toml, vehicle.toml, run.json). A visitor has
//   table(name, comment)
//   number(key, value, least, most, comment)
//   flag(key, value, comment)
//   choice(key, value, names, comment)
//   retired(key)
// and is handed references into the configuration: const ones when that is const.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "alces/mapper.h"

namespace alces::settings {

/// The words for an enumeration's values.
template <typename Enum>
using Names = std::vector<std::pair<const char*, Enum>>;

template <typename Config, typename Visitor>
void visit_icp(Config& icp, Visitor& visit) {
  visit.choice("metric", icp.metric,
               {{"point_to_point", IcpMetric::point_to_point}, {"surface", IcpMetric::surface}},
               "surface: along the normals, where there is a plane; point_to_point: the paper's");
  visit.number("maximum_iterations", icp.maximum_iterations, 1, 10000, "");
  visit.number("first_distance_limit_m", icp.first_distance_limit_m, 1e-3, 1e3,
               "of a correspondence, in the first iteration");
  visit.number("last_distance_limit_m", icp.last_distance_limit_m, 1e-3, 1e3, "what it shrinks to");
  visit.number("limit_factor", icp.limit_factor, 0.01, 1, "by this much an iteration");
  visit.number("translation_epsilon_m", icp.translation_epsilon_m, 0, 1, "converged when moving less");
  visit.number("rotation_epsilon_rad", icp.rotation_epsilon_rad, 0, 1, "and turning less");
  visit.number("minimum_correspondences", icp.minimum_correspondences, 3, 1e9, "fewer: no match");
  visit.number("coarse_stride", icp.coarse_stride, 1, 1000,
               "every so many samples, until the last distance limit is reached");
  visit.number("robust_factor", icp.robust_factor, 0, 1e6,
               "residuals above this many rms of the last iteration count little; 0: all alike");
  visit.number("robust_scale_m", icp.robust_scale_m, 0, 1e3, "but those below this never do");
  visit.number("rough_weight", icp.rough_weight, 0, 1, "weight of the distance where there is no plane");
  visit.number("fit_distance_m", icp.fit_distance_m, 0, 1e3, "nearer samples lie on the model");
  visit.number("degenerate_ratio", icp.degenerate_ratio, 0, 1,
               "smallest over largest curvature below this: a direction is undetermined");
  visit.flag("same_side", icp.same_side, "pair a sample only with what was seen from the same side");
  visit.flag("both_ways", icp.both_ways, "half of the samples are the model's, and ask the data");
  visit.number("finish_iterations", icp.finish_iterations, 0, 1000,
               "at most, of a match that has converged, with all samples of the data");
  visit.number("finish_robust_factor", icp.finish_robust_factor, 0, 1e6, "robust_factor of these");
  visit.number("noise", icp.uncertainty.noise, 0, 1e6, "independent errors, as a share of the residuals'");
  visit.number("pull", icp.uncertainty.pull, 0, 1e6, "errors in common, as a share of the correspondences");
}

/// Every number of a mapper, in the order of the file.
template <typename Config, typename Visitor>
void visit_mapper(Config& config, Visitor& visit) {
  visit.table("memory", "What does not fit the pool goes to the archive.");
  visit.number("scan_capacity", config.scan_capacity, 0, 1e8, "0: as many as there are, or as memory allows");
  visit.number("loop_capacity", config.loop_capacity, 0, 1e8, "loops closed");
  visit.number("pool_bytes", config.pool_bytes, 0, 1e15, "of stored scans; 0: what is left of the memory");
  visit.number("cache_slots", config.cache_slots, 1, 1e5, "scans unpacked at a time");
  visit.number("correspondence_capacity", config.correspondence_capacity, 1, 1e8, "of a match");

  visit.table("voxel", "A scan is downsampled to one point a cell.");
  visit.number("cell_size_m", config.voxel.cell_size_m, 1e-3, 100, "");
  visit.choice("representative", config.voxel.representative,
               {{"measured", CellRepresentative::measured},
                {"centroid", CellRepresentative::centroid},
                {"center", CellRepresentative::center}},
               "measured: the point nearest the centroid; or centroid, or center of the cell");
  visit.number(
      "cell_capacity", config.voxel.cell_capacity, 0, 1 << 24,
      "points that a thinned scan can have; for more, cells grow; 0: as the fullest has (vehicle: 32768)");
  visit.number("minimum_range_m", config.voxel.minimum_range_m, 0, 1e4, "nearer is the vehicle itself");
  visit.number("maximum_range_m", config.voxel.maximum_range_m, 0, 1e4, "farther points are left out");

  visit.table("surface", "Samples with normals: what moves in a match.");
  visit.number("sample_capacity", config.surface.sample_capacity, 1, 1 << 24, "a scan");
  visit.number("neighbors", config.surface.neighbors, 3, KdTree::maximum_neighbors, "of the plane fit");
  visit.retired("neighbor_radius_m");  // in recordings of drives made before; so are those below
  visit.number("neighbor_reach", config.surface.neighbor_reach, 1, 100,
               "times what is typical of the scan at that range; farther ones do not count");

  visit.table("scan_match", "A new scan onto the last ones.");
  visit.number("model_scans", config.model_scans, 1, Icp::maximum_model_scans, "how many; 1: pairwise");
  visit.number("model_points", config.model_points, 0, 1 << 24,
               "sparse scans: more of them until the model has so many; 0: never");
  visit.retired("learn_odometry_heading");
  visit.number("pair_reach", config.pair_reach, 0, 100,
               "pairs may be this many times a scan's typical spacing apart");
  visit.number("longest_reach_m", config.longest_reach_m, 1e-3, 1e3,
               "of the first iteration, however far predictions are off");
  visit_icp(config.scan_match, visit);

  visit.table("motion",
              "Where the next scan is predicted, and how far off that can be: at first, then as it is.");
  visit.flag("use_motion_prior", config.use_motion_prior,
             "odometry holds a match where the scans leave it open");
  visit.number("odometry_m_per_m", config.motion.odometry_m_per_m, 1e-6, 10, "standard deviation, each axis");
  visit.number("odometry_rad_per_m", config.motion.odometry_rad_per_m, 1e-6, 10, "the same of turns");
  visit.number("without_odometry_m", config.motion.without_odometry_m, 1e-6, 1e3,
               "from one step to the next, each axis");
  visit.number("without_odometry_rad", config.motion.without_odometry_rad, 1e-6, 10, "the same of turns");
  visit.number("steps_assumed", config.motion.steps_assumed, 0.1, 1e6, "so many steps weigh these numbers");
  visit.number("steps_remembered", config.motion.steps_remembered, 2, 1e6, "older steps fade");
  visit.flag("learn_heading", config.motion.learn_heading,
             "and scale: of the scanner's steps against the odometry's");
  visit.flag("learn_delay", config.motion.learn_delay, "of the odometry's stamps");

  visit.table("step_verification", "When the match of a scan is believed.");
  visit.flag("judge_steps", config.judge_steps, "else all are, as the paper does");
  visit.flag("search_steps", config.search_steps, "look for other starts where it is not, and for loops");
  visit.number("minimum_overlap", config.step_verification.minimum_overlap, 0, 1,
               "share of the samples with a partner");
  visit.number("usual_fit_share", config.step_verification.usual_fit_share, 0, 1,
               "of the fit that is usual on the drive; below: searched");
  visit.number("least_fit_share", config.step_verification.least_fit_share, 0, 1,
               "the same after the search: not believed");
  visit.number("held_fit_share", config.step_verification.held_fit_share, 0, 1,
               "the same where the odometry agrees");
  visit.number("minimum_fit", config.step_verification.minimum_fit, 0, 1, "anywhere");
  visit.number("maximum_mahalanobis2", config.step_verification.maximum_mahalanobis2, 0, 1e12,
               "of the deviation from the prediction");
  visit.number("reach_m", config.start_search.reach_m, 0, 60, "of the search, to each side");
  visit.number("turn_step_rad", config.start_search.turn_step_rad, 0.025, 3.2, "between the turns it tries");
  visit.number("cell_m", config.start_search.cell_m, 0.05, 100, "of its grid, and between its shifts");
  visit.number("start_iterations", config.start_search.iterations, 1, 10000, "of a match from each start");
  visit.number("start_gain", config.start_search.gain, 0, 1, "of the fit: less is chance");
  visit.number("start_gain_against_odometry", config.start_search.gain_against_odometry, 0, 1,
               "the same as a share of the usual fit");

  visit.table("edge_uncertainty", "What a match is believed to know.");
  visit.flag("label_with_appendix_a", config.label_with_appendix_a,
             "the paper's covariance instead of the curvature minimised on");
  visit.number("inflation", config.edge_uncertainty.inflation, 1e-6, 1e6, "factor on the covariance");
  visit.number("minimum_translation_m", config.edge_uncertainty.minimum_translation_m, 1e-12, 100,
               "standard deviation added on each axis");
  visit.number("minimum_rotation_rad", config.edge_uncertainty.minimum_rotation_rad, 1e-12, 10,
               "standard deviation added about each axis");
  visit.number("unconverged_factor", config.edge_uncertainty.unconverged_factor, 1, 1e6,
               "on the covariance of a match that used up its iterations");

  visit.table("detector", "Which earlier scan is near enough to close a loop with.");
  visit.number("radius_m", config.detector.radius_m, 1e-3, 1e4, "");
  visit.number("radius_cap_m", config.detector.radius_cap_m, 1e-3, 1e4,
               "of the reach that uncertainty widens");
  visit.number("sigma_factor", config.detector.sigma_factor, 0, 1e3,
               "reach = radius + factor * standard deviation; 0: always the radius");
  visit.number("minimum_gap_scans", config.detector.minimum_gap_scans, 1, 1e8, "in between");
  visit.number("minimum_gap_m", config.detector.minimum_gap_m, 0, 1e6, "driven in between");

  visit.table("trigger", "When a loop is closed: at the closest approach.");
  visit.flag("close_loops", config.close_loops, "");
  visit.number("hysteresis_m", config.trigger.hysteresis_m, 0, 1e4,
               "the distance grows when by more than this");
  visit.number("patience_scans", config.trigger.patience_scans, 0, 1e8,
               "or when so many scans came no nearer; 0: do not count them");
  visit.number("repeat_after_scans", config.trigger.repeat_after_scans, 0, 1e8,
               "further loops along the old track; 0: none");

  visit.table("loop_match", "The scans around the end of a loop onto those around its start.");
  visit.number("scans_around_first", config.scans_around_first, 0, 7, "on either side");
  visit.number("scans_before_last", config.scans_before_last, 0, 14, "");
  visit_icp(config.loop_match, visit);

  visit.table("loop_search", "Where the match of a loop starts, beside where the poses say.");
  visit.number("sure_overlap", config.loop_search.sure_overlap, 0, 1, "from here on no other start is tried");
  visit.retired("turn_step_rad");
  visit.retired("turn_steps");
  visit.number("sure_fit_share", config.loop_search.sure_fit_share, 0, 10,
               "if the surfaces fit so well, too, as a share of what is usual");
  visit.number("shift_step_m", config.loop_search.shift_step_m, 0.01, 100,
               "shifted along the weakest direction, to where what lies across it fits best");
  visit.number("shift_steps", config.loop_search.shift_steps, 0, Icp::maximum_shift_steps,
               "to each side; 0: none");
  visit.number("shift_gain", config.loop_search.shift_gain, 0, 1,
               "of the share of samples on the model: a smaller one is not followed");
  visit.number("iterations", config.loop_search.iterations, 1, 10000, "of each such start");
  visit.number("candidates", config.loop_search.candidates, 1, 100,
               "scans tried in all, when the nearest is refused");

  visit.table("loop_verification", "When a loop is believed before it bends the map.");
  visit.number("minimum_overlap", config.loop_verification.minimum_overlap, 0, 1,
               "share of the samples with a partner");
  visit.number("maximum_rms_m", config.loop_verification.maximum_rms_m, 0, 1e3, "of the residuals");
  visit.number("maximum_mahalanobis2", config.loop_verification.maximum_mahalanobis2, 0, 1e12,
               "of the correction, against the uncertainty accumulated along the loop");
  visit.number("minimum_wall_fit", config.loop_verification.minimum_wall_fit, 0, 1,
               "share that has to fit of the samples that face along the match's two weaker directions");
  visit.number("minimum_fit_share", config.loop_verification.minimum_fit_share, 0, 10,
               "of the fit that is usual on the drive");
  visit.number("small_correction_m", config.loop_verification.small_correction_m, 0, 1e3,
               "up to here neither walls nor fit are asked for");
  visit.number("ambiguity_sigmas", config.loop_verification.ambiguity_sigmas, 0, 100,
               "how far around the map can be off, where the scans must not fit as well; 0: not asked");
  visit.number("free_space_sigmas", config.loop_verification.free_space_sigmas, 0, 100,
               "beyond chance: surfaces in the other end's free space; 0: not asked");
  visit.number("known_m", config.loop_verification.known_m, 0, 1e3,
               "what the map knows as well already is not matched");

  visit.table("loop_correction", "How the error of a loop is shared out.");
  visit.choice("rule", config.correction_rule,
               {{"trails", CorrectionRule::trails}, {"paper", CorrectionRule::paper}},
               "trails: into the edges where it most likely arose; paper: by LOA's weights");
}

}  // namespace alces::settings
