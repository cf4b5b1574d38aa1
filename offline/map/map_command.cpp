// alces map: scans in, a loop-closed map out.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "alces_platform/bags/bag_reader.h"
#include "map_and_write.h"
#include "map_run.h"
#include "mapper_settings.h"
#include "offline/io/files/byte_size.h"
#include "offline/io/files/error.h"
#include "offline/io/scans/scan_source.h"
#include "offline/optimize/graph/loop_back_end.h"
#include "offline/program/bag_options.h"
#include "offline/program/command.h"

namespace alces::offline {
namespace {

#ifndef ALCES_VERSION
#define ALCES_VERSION "0.1.0"
#endif

struct MapOptions {
  std::vector<std::filesystem::path> scans;
  std::string out;
  std::string odometry;
  std::string deskew = "auto";
  double scan_interval_s = 0;
  double scale = 1;
  std::string format;
  BagTopics bag;
  std::string front_end = "default";
  std::string loop_optimizer = "elch";
  std::string memory = "64MiB";
  std::string archive;
  std::string config;
  bool prints_config = false;
  bool json = false;
};

constexpr const char* map_footer = R"(Examples:
  alces map scans/ --out town                            a folder of scans -> the map folder town/
  alces map scans/ --out town --odometry drive.tum       poses from a file instead of those beside the scans
  alces map scans/ --out town --odometry none            without poses, also where some lie beside the scans
  alces map scans/ --out town --scale 0.001              scans whose coordinates are millimetres
  alces map sweeps/ --out town --format float32x5        five float32 a point and no header, as nuScenes has them
  alces map scans/ --out town --scan-interval 0.1        scans without stamps that come ten a second: their motion is taken out
  alces map scans/ --out town --deskew none              points have times, and their motion is taken out already
  alces map scans/ --out town --front-end paper          ICP and sharing out as they were published
  alces map scans/ --out town --memory 16MiB             as on a small board: what does not fit goes to the disk
  alces map drive/ --out town --topic /points --tf odom  a bag of ROS (MCAP, rosbag2, .db3, .bag), its topics named
  alces map --print-config > map.toml                    every number, to be changed and given with --config

SCANS is a folder or several files: 3DTK uos, PCD, PLY, LAS, KITTI .bin, CSV; or a bag. Poses belong to scans by the stamps in the files'
names (a number with decimals, or since 1970), else by their numbers, else by their order; a line says which. run.json keeps which
file was the odometry, so that 'alces evaluate' can tell when it is taken for the truth, too. The map folder holds trajectory.tum (the poses),
graph.g2o, frames/ (for 3DTK), map.ply (the points) and run.json (settings, times, memory, loops). It is written beside OUT and takes
its place when it is whole; files of others in OUT stay. The frame is REP 103's, metres, the origin is the first scan.

A bag needs no options where it has one lidar and one odometry; 'alces info BAG' shows what would be taken, and why. Scans are
sensor_msgs/PointCloud2, odometry is nav_msgs/Odometry or /tf, the mounting is in /tf_static. --odometry BAG:TOPIC takes the poses of
another bag.

Points with times (fields t, time, timestamp, offset_time, GPS time, ...) are deskewed: by the odometry between the stamps of the
scans, else by the motion of the last steps. A line says how their unit was found and how far points were moved. Files that were
deskewed already and kept their times cannot be told from others: --deskew none. Intensities are kept, 8 bits a point.

--loop-optimizer none closes no loops. toro or hogman, where alces has them, put the optimisers that ELCH's paper compares
with into LOA's place; they work outside of --memory. Detecting, matching and believing loops stay as they are.

--memory is all that the mapper has: one block, planned before the first scan. Scans that do not fit go to a file in OUT that is
removed at the end, or to --archive FILE, which stays and may be removed afterwards. Its voxel table has room for the fullest scan; only
where the memory is too small for that (a warning says so) are scans downsampled coarser, and poses depend on it.

Ctrl-C ends the map after the scan that is being matched and writes it, a second one ends the program at once.

Exit status: 0 done, 2 usage, 3 unreadable or invalid input, 4 a capacity reached, 5 a device failed or a file cannot be written,
130 Ctrl-C, 143 told to stop. With 3, 4, 130 and 143, and with 5 where the archive is what cannot be written, the scans mapped so
far are in OUT.)";

MapRequest request(const MapOptions& options) {
  MapRequest request;
  request.config = default_settings(options.front_end == "paper" ? FrontEnd::paper : FrontEnd::standard);
  if (!options.config.empty()) read_settings(options.config, request.config);
  request.deskew = deskew_mode_called(options.deskew).value_or(DeskewMode::automatic);
  request.loop_back_end = options.loop_optimizer;
  const auto memory = parse_byte_size(options.memory);
  if (!memory) throw UsageError(fmt::format("--memory {}: write a size as 64MiB", options.memory));
  request.memory_bytes = *memory;
  if (!options.archive.empty()) request.archive = options.archive;
  return request;
}

void map_scans(const MapOptions& options) {
  if (options.prints_config) {
    fmt::print("{}", to_toml(request(options).config));
    return;
  }
  if (options.scans.empty()) throw UsageError("SCANS is missing; name a folder of scans, or scan files");
  if (options.out.empty()) throw UsageError("--out is missing; name the folder that the map is written to");

  const MapRequest map_request = request(options);
  ScanSourceOptions source_options = {.scale = options.scale,
                                      .scan_interval_s = options.scan_interval_s,
                                      .format = options.format,
                                      .bag = options.bag};
  choose_odometry(options.odometry, source_options);
  std::optional<Progress> surveying(std::in_place, "reading the bag");
  source_options.survey_progress = std::ref(*surveying);
  PrefetchingScanSource scans(open_scans(options.scans, source_options));
  surveying.reset();
  nlohmann::json source = {
      {"paths", nlohmann::json::array()},
      {"reading",
       {{"scale", options.scale}, {"format", options.format}, {"scan_interval_s", options.scan_interval_s}}}};
  if (bags::is_bag(options.scans.front())) source["reading"]["bag"] = to_json(options.bag);
  for (const std::filesystem::path& path : options.scans)
    source["paths"].push_back(std::filesystem::absolute(path).lexically_normal().string());
  map_and_write(scans, map_request, options.out,
                {ALCES_VERSION, command_line(), options.front_end, {}, source}, options.json);
}

}  // namespace

void add_map_command(CLI::App& alces) {
  auto options = std::make_shared<MapOptions>();
  CLI::App* verb = alces.add_subcommand("map", "A consistent map from a folder of scans.");
  verb->footer(map_footer);
  verb->add_option("SCANS", options->scans, "a folder of scans, scan files, or a bag of ROS");
  verb->add_option("--out", options->out, "the map folder to write");
  verb->add_option("--odometry", options->odometry,
                   "rough poses: TUM, KITTI, 3DTK or 4x4 matrices; none: not those beside the scans either");
  verb->add_option("--deskew", options->deskew, "which motion is taken out of scans whose points have times")
      ->check(CLI::IsMember(deskew_mode_names()))
      ->capture_default_str();
  verb->add_option("--scan-interval", options->scan_interval_s,
                   "s from one scan to the next, where neither names nor poses have stamps")
      ->check(CLI::Range(1e-4, 1e4));
  verb->add_option("--scale", options->scale, "of the scans' coordinates: 0.001 where they are mm")
      ->check(CLI::Range(1e-9, 1e9))
      ->capture_default_str();
  verb->add_option("--format", options->format,
                   "of the scans, where their names do not say it: " +
                       fmt::format("{}", fmt::join(scan_format_names(), ", ")) +
                       ", or float32xN, float64xN: N numbers a point, the first three x y z");
  add_bag_options(*verb, options->bag);
  verb->add_option("--front-end", options->front_end, "how scans are matched")
      ->check(CLI::IsMember({"default", "paper"}))
      ->capture_default_str();
  verb->add_option("--loop-optimizer", options->loop_optimizer, "how loops are closed, or none")
      ->check(CLI::IsMember(loop_back_end_names()))
      ->capture_default_str();
  verb->add_option("--memory", options->memory, "for the mapper, all in all")->capture_default_str();
  verb->add_option(
      "--archive", options->archive,
      "a file for the scans that do not fit the memory; not given: one in OUT, removed at the end");
  verb->add_option("--config", options->config, "a TOML file with the numbers that differ from the defaults");
  verb->add_flag("--print-config", options->prints_config, "print all numbers as TOML and map nothing");
  verb->add_flag("--json", options->json, "print run.json instead of lines for people");
  verb->callback([options] { map_scans(*options); });
}

}  // namespace alces::offline
