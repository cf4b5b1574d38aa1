// alces replay: a recorded drive through the drivers and the mapper.
#include <fmt/core.h>

#include <filesystem>
#include <memory>
#include <string>

#include "drive_replay.h"
#include "offline/io/bags/own_recording.h"
#include "offline/io/files/byte_size.h"
#include "offline/io/files/error.h"
#include "offline/map/map_and_write.h"
#include "offline/optimize/graph/loop_back_end.h"
#include "offline/program/command.h"

namespace alces::offline {
namespace {

#ifndef ALCES_VERSION
#define ALCES_VERSION "0.1.0"
#endif

struct ReplayOptions {
  std::string drive;
  std::string out;
  std::string config;
  std::string loop_optimizer = "elch";
  std::string memory;
  std::string archive;
  bool no_deskew = false;
  bool all_scans = false;
  double speed = 0;
  bool json = false;
};

constexpr const char* replay_footer = R"(Examples:
  alces replay drive.mcap --out town                     a recorded drive -> the map folder town/
  alces replay traces/ --out town                        candump, gpiomon and raw laser traces, with a vehicle.toml
  alces replay traces/ --config vehicle.toml --out town  ... or with one given here
  alces replay drive.mcap --out town --speed 1           at the pace of the drive
  alces replay drive.mcap --out skewed --no-deskew       what the motion during a scan would do

DRIVE is a recording (MCAP, of alcesd or alces simulate), a folder of traces, or one trace; bags of ROS go to 'alces map'. Every event goes through the
same drivers as on the vehicle and in the same order: the same recording gives the same poses, run after run, and those of
the vehicle itself. The stamps of trajectory.tum are seconds of the vehicle's monotonic clock.

Beside what 'alces map' writes, run.json has the drive's counters and notices: what the motor, the encoder, the lasers, the
odometry and the GPS went through.

Exit status: 0 done, 2 usage, 3 unreadable or invalid input, 4 a capacity reached, 5 a device failed or a file cannot be written,
130 Ctrl-C.)";

void replay_drive(const ReplayOptions& options) {
  if (is_ros_bag(options.drive))
    throw InputError(options.drive,
                     fmt::format("is a bag of ROS, whose scans no drivers are needed for: 'alces map {} "
                                 "--out {}' maps it",
                                 options.drive, options.out));
  DriveReplayOptions replay_options;
  if (!options.config.empty()) replay_options.config = options.config;
  replay_options.deskew = !options.no_deskew;
  replay_options.maps_dropped_scans = options.all_scans;
  replay_options.speed = options.speed;
  auto owned = std::make_unique<DriveReplay>(options.drive, replay_options);
  const DriveReplay& drive = *owned;

  MapRequest request;
  request.config = drive.settings().mapper;
  request.memory_bytes = drive.settings().memory_bytes;
  if (!options.memory.empty()) {
    const auto memory = parse_byte_size(options.memory);
    if (!memory) throw UsageError(fmt::format("--memory {}: write a size as 64MiB", options.memory));
    request.memory_bytes = *memory;
  }
  if (!options.archive.empty()) request.archive = options.archive;
  request.loop_back_end = options.loop_optimizer;

  PrefetchingScanSource scans(std::move(owned));
  const auto absolute = [](const std::string& path) {
    return std::filesystem::absolute(path).lexically_normal().string();
  };
  const nlohmann::json source = {{"paths", {absolute(options.drive)}},
                                 {"replay",
                                  {{"config", options.config.empty() ? "" : absolute(options.config)},
                                   {"deskew", !options.no_deskew},
                                   {"all_scans", options.all_scans}}}};
  map_and_write(scans, request, options.out, {ALCES_VERSION, command_line(), "default", {}, source},
                options.json, [&drive](ProgramFacts& program) {
                  program.drive = drive.report();
                  program.drive_counters_csv = drive.counters_csv();
                });
}

}  // namespace

void add_replay_command(CLI::App& alces) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* verb =
      alces.add_subcommand("replay", "A map from a recorded drive: through the drivers and the mapper.");
  verb->footer(replay_footer);
  verb->add_option("DRIVE", options->drive, "a recording, or a folder of traces")->required();
  verb->add_option("--out", options->out, "the map folder to write")->required();
  verb->add_option("--config", options->config, "a vehicle.toml instead of the recording's own");
  verb->add_option("--loop-optimizer", options->loop_optimizer, "how loops are closed, or none")
      ->check(CLI::IsMember(loop_back_end_names()))
      ->capture_default_str();
  verb->add_option("--memory", options->memory, "for the mapper, instead of the configuration's");
  verb->add_option(
      "--archive", options->archive,
      "a file for the scans that do not fit the memory; not given: one in OUT, removed at the end");
  verb->add_option("--speed", options->speed, "seconds of the drive in a second; 0: as fast as possible")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  verb->add_flag("--no-deskew", options->no_deskew,
                 "leave the vehicle's motion in the scans, to see what it does");
  verb->add_flag("--all-scans", options->all_scans, "map those, too, that the vehicle had no time for");
  verb->add_flag("--json", options->json, "print run.json instead of lines for people");
  verb->callback([options] { replay_drive(*options); });
}

}  // namespace alces::offline
