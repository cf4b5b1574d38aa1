// alces evaluate: how far from the truth, or how consistent with itself.
#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "circular_truth.h"
#include "evaluation.h"
#include "map_entropy.h"
#include "offline/io/files/error.h"
#include "offline/io/files/json_text.h"
#include "offline/io/files/output_file.h"
#include "offline/io/map_folder/statistics_json.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"
#include "offline/program/command.h"

namespace alces::offline {
namespace {

struct EvaluateOptions {
  std::string trajectory;
  std::string truth;
  Alignment alignment = Alignment::none;
  double max_time_difference_s = 0.02;
  std::size_t rpe_delta = 1;
  std::string per_scan;
  std::string scans;
  std::string pairs;
  bool json = false;
};

constexpr const char* evaluate_footer = R"(Examples:
  alces evaluate town --truth truth.tum                 Table 1 of the paper: mean and standard deviation
  alces evaluate town --truth truth.tum --align se3     after the best rigid fit of the two trajectories
  alces evaluate estimate.txt --truth 00.txt --json     KITTI against KITTI, for machines
  alces evaluate town --consistency scans/              residuals between scans of the same place, no truth needed

Absolute errors compare scan by scan. 'rotation' is the angle between the two orientations; the paper's figure,
arccos|q . q_ref| of the quaternions, is half of it and stands beside it. RPE is the error of the motion over
--rpe-delta scans and does not depend on --align. Where the truth is what the map took as odometry (the same file, or the same
poses), the figures are no measure of accuracy, and the evaluation says so.

Consistency: for a pair of scans at their map poses, the distance of every third point of the one to its nearest
neighbour in the other (within 1 m), along that neighbour's normal; the median over the points, then over the pairs.
Beside it the mean map entropy and mean plane variance: how crisp surfaces are, lower is better; they compare maps of the
same scans.)";

void print_row(const char* name, const char* unit, const Statistics& s) {
  fmt::print("  {:<34}{:>10.4f} ± {:<10.4f}{:>10.4f}{:>10.4f}{:>10.4f}  {}\n", name, s.mean,
             s.standard_deviation, s.median, s.rmse, s.max, unit);
}

const char* name(Alignment alignment) {
  switch (alignment) {
    case Alignment::none:
      return "none";
    case Alignment::first:
      return "first";
    case Alignment::se3:
      return "se3";
  }
  return "";
}

void write_per_scan(const std::string& path, const Trajectory& estimate, const Association& association,
                    const AbsoluteError& error) {
  OutputFile file(path);
  file.write("scan,stamp,translation_m,translation_xy_m,quaternion_angle_deg,rotation_deg\n");
  for (std::size_t i = 0; i < error.scans.size(); ++i) {
    const ScanError& scan = error.scans[i];
    const std::size_t index = association.pairs[i].estimate;
    file.write(fmt::format("{},{:.9f},{:.6f},{:.6f},{:.6f},{:.6f}\n", index, estimate.stamps_s[index],
                           scan.translation_m, scan.translation_xy_m, scan.quaternion_angle_deg,
                           scan.rotation_deg));
  }
  file.commit();
}

void evaluate_against_truth(const EvaluateOptions& options) {
  const Trajectory estimate = read_trajectory(options.trajectory);
  const Trajectory truth = read_trajectory(options.truth);
  for (const Trajectory* read : {&estimate, &truth})
    for (const std::string& note : read->notes) fmt::print(stderr, "alces: {}\n", note);
  const Association association = associate(estimate, truth, options.max_time_difference_s);
  const std::optional<std::string> circular =
      why_circular(options.trajectory, options.truth, truth, association);
  if (circular) fmt::print(stderr, "alces: warning: {}\n", *circular);

  std::vector<Pose> estimate_poses;
  std::vector<Pose> truth_poses;
  for (const Association::Pair& pair : association.pairs) {
    estimate_poses.push_back(estimate.poses[pair.estimate]);
    truth_poses.push_back(truth.poses[pair.truth]);
  }
  const Pose alignment = truth_from_map(estimate_poses, truth_poses, options.alignment);
  for (Pose& pose : estimate_poses) pose = alignment * pose;
  const AbsoluteError absolute = absolute_error(estimate_poses, truth_poses);
  const RelativeError relative = relative_error(estimate_poses, truth_poses, options.rpe_delta);
  if (!options.per_scan.empty()) write_per_scan(options.per_scan, estimate, association, absolute);

  const std::size_t unassociated = estimate.size() - association.pairs.size();
  if (options.json) {
    const nlohmann::json json = {{"trajectory", options.trajectory},
                                 {"truth", options.truth},
                                 {"align", name(options.alignment)},
                                 {"associated", association.pairs.size()},
                                 {"unassociated", unassociated},
                                 {"associated_by", association.by_index    ? "index"
                                                   : association.by_number ? "number"
                                                                           : "stamp"},
                                 {"largest_time_difference_s", association.largest_time_difference_s},
                                 {"truth_was_odometry", circular.has_value()},
                                 {"circular", circular ? nlohmann::json(*circular) : nlohmann::json()},
                                 {"absolute",
                                  {{"translation_m", to_json(absolute.translation_m)},
                                   {"translation_xy_m", to_json(absolute.translation_xy_m)},
                                   {"rotation_arccos_q_qref_deg", to_json(absolute.quaternion_angle_deg)},
                                   {"rotation_deg", to_json(absolute.rotation_deg)}}},
                                 {"relative",
                                  {{"delta_scans", relative.delta},
                                   {"translation_m", to_json(relative.translation_m)},
                                   {"rotation_deg", to_json(relative.rotation_deg)}}}};
    fmt::print("{}\n", json_text(json));
    return;
  }
  fmt::print("{}", to_string(association));
  if (unassociated > 0) fmt::print(", {} without a counterpart left out", unassociated);
  fmt::print("; alignment: {}\n", name(options.alignment));
  if (circular) fmt::print("NO MEASURE OF ACCURACY: {}\n", *circular);
  fmt::print("\n");
  fmt::print("  {:<34}{:>10}   {:<10}{:>10}{:>10}{:>10}\n", "", "mean", "std.dev.", "median", "rmse", "max");
  print_row("translation", "m", absolute.translation_m);
  print_row("translation, x and y only", "m", absolute.translation_xy_m);
  print_row("rotation, arccos|q . q_ref|", "deg", absolute.quaternion_angle_deg);
  print_row("rotation, angle (twice that)", "deg", absolute.rotation_deg);
  if (relative.translation_m.count == 0) {
    fmt::print("\nRPE: the trajectory is not longer than {} scans\n", relative.delta);
    return;
  }
  const std::string over = fmt::format(" over {} scan{}", relative.delta, relative.delta == 1 ? "" : "s");
  print_row(("RPE translation" + over).c_str(), "m", relative.translation_m);
  print_row(("RPE rotation" + over).c_str(), "deg", relative.rotation_deg);
}

void evaluate_consistency(const EvaluateOptions& options) {
  const Trajectory trajectory = read_trajectory(options.trajectory);
  const std::unique_ptr<ScanSource> scans = open_scans(options.scans);
  std::vector<PairGroup> groups = neighbour_pairs(scans->size());
  std::size_t thinned_from = 0;
  if (options.pairs.empty()) {
    Revisits revisits = find_revisits(trajectory.poses);
    if (revisits.found > revisits.pairs.size()) thinned_from = revisits.found;
    groups.push_back({"revisits", std::move(revisits.pairs)});
  } else {
    groups.push_back({"revisits", read_pairs(options.pairs, scans->size())});
  }

  const auto start = std::chrono::steady_clock::now();
  std::vector<GroupConsistency> results;
  {
    Progress progress("residuals between scans");
    results = measure_consistency(*scans, trajectory.poses, groups, {}, std::ref(progress));
  }
  MapEntropy entropy;
  {
    Progress progress("map entropy");
    entropy = measure_map_entropy(*scans, trajectory.poses, {}, std::ref(progress));
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const std::string& warning : scans->warnings()) fmt::print(stderr, "alces: {}\n", warning);

  if (options.json) {
    nlohmann::json json = {
        {"trajectory", options.trajectory},
        {"scans", options.scans},
        {"revisits_from", options.pairs.empty() ? "the trajectory's own poses" : options.pairs},
        {"revisits_found", thinned_from > 0 ? thinned_from : groups.back().pairs.size()},
        {"seconds", seconds},
        {"map_entropy",
         {{"points", entropy.points},
          {"measured", entropy.measured},
          {"mean_entropy", entropy.mean_entropy},
          {"mean_plane_variance_m2", entropy.mean_plane_variance_m2}}},
        {"groups", nlohmann::json::array()}};
    for (const GroupConsistency& group : results) {
      nlohmann::json pairs = nlohmann::json::array();
      for (const PairConsistency& pair : group.pairs) {
        pairs.push_back(
            {{"a", pair.pair.first},
             {"b", pair.pair.second},
             {"correspondences", pair.correspondences},
             {"median_m", pair.median_residual_m ? nlohmann::json(*pair.median_residual_m) : nullptr}});
      }
      json["groups"].push_back({{"name", group.name},
                                {"pairs", group.pairs.size()},
                                {"without_overlap", group.without_overlap},
                                {"median_m", group.median_m ? nlohmann::json(*group.median_m) : nullptr},
                                {"residuals", std::move(pairs)}});
    }
    fmt::print("{}\n", json_text(json));
    return;
  }
  fmt::print("{} scans, median residual along normals ({:.1f} s)\n\n", scans->size(), seconds);
  for (const GroupConsistency& group : results) {
    const std::string figure =
        group.median_m ? fmt::format("{:8.2f} cm", *group.median_m * 100) : "       -   ";
    fmt::print("  {:<12}{}   {} pairs", group.name, figure, group.pairs.size());
    if (group.without_overlap > 0)
      fmt::print(", {} of them without overlap (not in the figure)", group.without_overlap);
    fmt::print("\n");
  }
  fmt::print(
      "\n  mean map entropy {:.3f}, mean plane variance {:.2f} cm2 (of {} points of {}, radius {} m)\n",
      entropy.mean_entropy, entropy.mean_plane_variance_m2 * 1e4, entropy.measured, entropy.points,
      MapEntropySettings{}.radius_m);
  if (options.pairs.empty()) {
    fmt::print("\nRevisits are pairs within 3 m, at least 30 scans apart, at the poses given");
    if (thinned_from > 0) fmt::print(" (every {:.1f}th of {})", double(thinned_from) / 500, thinned_from);
    fmt::print(".\nA map that tears its loops open has fewer: compare maps with the same --pairs FILE.\n");
  }
}

}  // namespace

void add_evaluate_command(CLI::App& alces) {
  auto options = std::make_shared<EvaluateOptions>();
  CLI::App* verb = alces.add_subcommand("evaluate", "Error against ground truth, or consistency without it.");
  verb->footer(evaluate_footer);
  verb->add_option("OUT|TRAJECTORY", options->trajectory,
                   "a map folder, or a trajectory (TUM, KITTI, 3DTK, 4x4)")
      ->required();
  CLI::Option* truth =
      verb->add_option("--truth", options->truth, "the true trajectory, in any of these formats");
  verb->add_option("--align", options->alignment,
                   "how to lay the trajectory on the truth: none, first or se3")
      ->transform(CLI::CheckedTransformer(std::map<std::string, Alignment>{{"none", Alignment::none},
                                                                           {"first", Alignment::first},
                                                                           {"se3", Alignment::se3}})
                      .description("{none|first|se3}"))
      ->default_str("none")
      ->needs(truth);
  verb->add_option("--max-time-difference", options->max_time_difference_s, "s, for poses to belong together")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->needs(truth);
  verb->add_option("--rpe-delta", options->rpe_delta, "scans from one end of a motion to the other")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->needs(truth);
  verb->add_option("--per-scan", options->per_scan, "write every scan's error to this CSV")->needs(truth);
  CLI::Option* consistency =
      verb->add_option("--consistency", options->scans, "the scans that the map was made of");
  consistency->excludes(truth);
  verb->add_option("--pairs", options->pairs,
                   "revisits as JSON [[a, b], ...] instead of those found in the poses")
      ->needs(consistency);
  verb->add_flag("--json", options->json, "for machines");
  verb->callback([options] {
    if (!options->truth.empty()) {
      evaluate_against_truth(*options);
    } else if (!options->scans.empty()) {
      evaluate_consistency(*options);
    } else {
      throw UsageError("evaluate needs something to measure by: --truth FILE or --consistency SCANS");
    }
  });
}

}  // namespace alces::offline
