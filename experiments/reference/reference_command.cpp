// alces reference: ground truth from a surveyed map.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "building_outlines.h"
#include "offline/evaluate/evaluation.h"
#include "offline/io/files/error.h"
#include "offline/io/files/json_text.h"
#include "offline/io/files/output_file.h"
#include "offline/io/files/stop_signal.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"
#include "offline/map/scan_progress.h"
#include "offline/program/command.h"
#include "reference_command.h"
#include "reference_map.h"
#include "reference_poses.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

struct ReferenceOptions {
  std::vector<std::string> inputs;
  std::string buildings;
  std::string airborne;
  std::string start;
  std::string out;
  double height_m = 0;
  double spacing_m = 0.2;
  double cell_m = 0.1;
  ReferenceSettings settings;
  bool all = false;
  bool json = false;
};

constexpr const char* reference_footer = R"(Examples:
  alces reference map.ply scans/ --out truth.tum                      scans matched to a surveyed cloud
  alces reference --buildings outlines.geojson --airborne ground.las scans/ --out truth.tum
                                                                      as the paper did: walls from outlines, and a flight
  alces reference map.ply scans/ --start rough.tum --out truth.tum    where the odometry does not begin in the map's frame
  alces compare scans/ --truth truth.tum --out tables                 what it is for

Every scan is matched to the map on its own, beginning where the last trusted one leads by the steps of --start or the
odometry; the first one must begin within some metres and degrees of its place. truth.tum gets the poses that can be
trusted, in the map's frame, and says of the others why not; truth.quality.csv has overlap, rms and more of every scan.

Outlines: GeoJSON polygons with a property "height", or text: 'building HEIGHT [BASE]', then a corner 'x y' a line.
Metres, and the same frame for outlines and cloud. Walls alone leave height and tilt open: scans are then not trusted.)";

std::vector<std::optional<Pose>> start_poses(const ReferenceOptions& options, const ScanSource& scans) {
  std::vector<std::optional<Pose>> start;
  bool has_any = false;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    start.push_back(scans.odometry(i));
    has_any |= start.back().has_value();
  }
  if (!has_any)
    throw InputError(options.inputs.back(),
                     "has no poses to start from; give --start TRAJECTORY, rough ones will do");
  return start;
}

/// Outlines in a national grid: whole kilometres, as of clouds.
Eigen::Vector3d origin_of(const std::vector<Building>& buildings) {
  constexpr double farthest_exact_m = 10'000;
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  if (buildings.empty() || buildings.front().rings.empty() || buildings.front().rings.front().empty())
    return origin_m;
  const Eigen::Vector2d& corner = buildings.front().rings.front().front();
  for (Eigen::Index axis = 0; axis < 2; ++axis)
    if (std::abs(corner(axis)) > farthest_exact_m) origin_m(axis) = std::floor(corner(axis) / 1000) * 1000;
  return origin_m;
}

void reference(const ReferenceOptions& options) {
  const bool has_parts = !options.buildings.empty() || !options.airborne.empty();
  if (options.inputs.size() != (has_parts ? 1U : 2U))
    throw UsageError(has_parts ? "with --buildings or --airborne there is one more argument: SCANS"
                               : "two arguments are needed: the reference MAP and the SCANS");
  ScanSourceOptions source_options;
  if (!options.start.empty()) source_options.odometry = options.start;
  PrefetchingScanSource scans(open_scans(fs::path(options.inputs.back()), source_options));
  std::vector<std::optional<Pose>> start = start_poses(options, scans);
  { const OutputFile trial(options.out); }  // can it be written? never committed

  std::vector<std::string> warnings;
  std::vector<Point> points;
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  // of clouds, outlines and poses alike
  if (!has_parts || !options.airborne.empty()) {
    ReferenceCloud cloud =
        read_cloud(has_parts ? fs::path(options.airborne) : fs::path(options.inputs.front()), warnings);
    points = std::move(cloud.points);
    origin_m = cloud.origin_m;
  }
  if (!options.buildings.empty()) {
    std::vector<Building> buildings = read_building_outlines(
        options.buildings, options.height_m > 0 ? std::optional<double>(options.height_m) : std::nullopt);
    if (options.airborne.empty()) origin_m = origin_of(buildings);
    for (Building& building : buildings) {
      building.base_m -= origin_m.z();
      for (auto& ring : building.rings)
        for (Eigen::Vector2d& corner : ring) corner -= origin_m.head<2>();
    }
    const std::vector<Point> walls = extrude_walls(buildings, options.spacing_m);
    points.insert(points.end(), walls.begin(), walls.end());
  }
  const ReferenceMap map(points, options.cell_m);
  points = {};
  for (const std::string& warning : warnings) fmt::print(stderr, "alces: warning: {}\n", warning);

  for (std::optional<Pose>& pose : start)
    if (pose) pose->translation_m -= origin_m;
  const StopSignal stop;
  ReferenceRun run;
  {
    ScanProgress progress;
    run = find_reference_poses(
        scans, start, map, options.settings,
        [&](std::size_t done, std::size_t total) { progress(done, total); },
        [&] { return stop.received() != 0; });
  }
  for (ReferencePose& pose : run.poses) pose.map_from_body.translation_m += origin_m;
  write_reference_poses(options.out, scans, run, options.all);

  std::size_t trusted = 0;
  std::vector<double> overlaps;
  std::vector<double> rms_m;
  for (const ReferencePose& pose : run.poses) {
    if (pose.verdict != ReferenceVerdict::trusted) continue;
    ++trusted;
    overlaps.push_back(pose.overlap);
    rms_m.push_back(pose.rms_m);
  }
  if (options.json) {
    const nlohmann::json json = {
        {"out", options.out},           {"map_points", map.given()}, {"map_points_kept", map.tree().size()},
        {"scans", run.poses.size()},    {"trusted", trusted},        {"median_overlap", median(overlaps)},
        {"median_rms_m", median(rms_m)}};
    fmt::print("{}\n", json_text(json));
  } else {
    fmt::print("map: {} points, {} of them kept\n{} of {} scans have a pose to be trusted", map.given(),
               map.tree().size(), trusted, run.poses.size());
    if (trusted > 0)
      fmt::print(" (median overlap {:.0f} %, rms {:.3f} m)", 100 * median(overlaps), median(rms_m));
    fmt::print("\n");
    for (std::size_t i = 0; i < run.poses.size() && trusted > 0; ++i)
      if (run.poses[i].verdict != ReferenceVerdict::trusted)
        fmt::print("  {}: {} (overlap {:.0f} %, rms {:.3f} m)\n", scans.name(i),
                   to_string(run.poses[i].verdict), 100 * run.poses[i].overlap, run.poses[i].rms_m);
  }
  if (run.was_stopped) {
    std::fflush(stdout);
    throw Error(fmt::format("stopped after {} of {} scans; their poses are in {}", run.poses.size(),
                            scans.size(), options.out),
                128 + stop.received());
  }
  if (trusted == 0)
    throw InputError(
        fmt::format("no scan could be matched to the map; does {} begin in the map's frame, within some "
                    "metres? ({} says more)",
                    options.start.empty() ? "the odometry" : options.start, options.out));
}

}  // namespace

void add_reference_command(CLI::App& alces) {
  auto options = std::make_shared<ReferenceOptions>();
  CLI::App* verb = alces.add_subcommand("reference", "Ground truth: scans matched to a surveyed map.");
  verb->footer(reference_footer);
  verb->add_option("[MAP] SCANS", options->inputs, "a cloud (PLY, PCD, LAS, CSV), then a folder of scans")
      ->required()
      ->expected(1, 2);
  verb->add_option("--buildings", options->buildings, "outlines to extrude walls from");
  verb->add_option("--airborne", options->airborne, "a cloud to join them with");
  verb->add_option("--start", options->start,
                   "rough poses in the map's frame, instead of those beside the scans");
  verb->add_option("--out", options->out, "the ground truth to write, TUM")->required();
  verb->add_option("--height", options->height_m, "m, of buildings whose outline has none")
      ->check(CLI::PositiveNumber);
  verb->add_option("--spacing", options->spacing_m, "m, between points on walls")
      ->check(CLI::Range(0.01, 10.0))
      ->capture_default_str();
  verb->add_option("--cell", options->cell_m, "m, the map is downsampled to one point a cell; 0: not at all")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  verb->add_option("--min-overlap", options->settings.minimum_overlap, "of a scan that is trusted")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  verb->add_option("--max-rms", options->settings.maximum_rms_m, "m, of a scan that is trusted")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb->add_flag("--all", options->all, "write poses that are not to be trusted, too");
  verb->add_flag("--json", options->json, "for machines");
  verb->callback([options] { reference(*options); });
}

}  // namespace alces::offline
