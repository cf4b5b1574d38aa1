// alces simulate: a drive through a procedural town, recorded as alcesd would have.
#include <fmt/core.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "alces_platform/settings/settings_error.h"
#include "drive_simulation.h"
#include "offline/io/files/byte_size.h"
#include "offline/io/files/error.h"
#include "offline/io/files/stop_signal.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/program/command.h"

namespace alces::offline {
namespace {

struct SimulateOptions {
  DriveSimulationSettings settings;
  std::string out;
  std::string truth;
  std::string config;
  std::vector<std::string> faults;
  bool prints_config = false;
};

constexpr const char* simulate_footer = R"(Examples:
  alces simulate --scans 924 --seed 1 --out drive.mcap   the paper's drive: 1.24 km, five loops, 924 scans
  alces simulate --scans 40 --out short.mcap             around one block
  alces simulate --out drive.mcap --fault laser_unplugged@120+5 --fault node_reset@200
  alces simulate --scans 300 --rings 16 --out rings.mcap      a sensor of 16 rings, 2 deg apart
  alces simulate --scans 300 --snow 0.1 --crowd 20 --out bad.mcap   one ray of ten meets a snowflake, 20 people walk along
  alces simulate --scans 300 --out drive.mcap --fault odometry_frozen@60+60=2   for a minute the wheels say that they stand
  alces simulate --print-config > vehicle.toml           how the simulated vehicle is configured

A town of streets, houses, trees and cars; a vehicle with wheels, gyro and GPS that err like real ones; a head turned by a
CiA 402 motor drive, with an index pulse; two SICK LMS 291 on serial lines. Our drivers bring all of it up over the same
frames, edges and bytes as on a vehicle, and everything on the wires is recorded. The truth is written beside the recording,
as DRIVE.truth.tum: the pose of every whole scan, for alces evaluate. What errs how much: docs/simulation.md.

Ctrl-C ends the drive early; the recording is whole.

Exit status: 0 done, 2 usage, 3 invalid configuration, 5 a device failed or a file cannot be written, 130 Ctrl-C.)";

void simulate(SimulateOptions& options) {
  DriveSimulationSettings& settings = options.settings;
  try {
    settings.vehicle = options.config.empty() ? settings::default_vehicle_settings()
                                              : settings::read_vehicle_settings(options.config);
  } catch (const settings::Error& error) {
    throw InputError(error.what());
  }
  if (settings.vehicle.text.empty()) settings.vehicle.text = settings::to_toml(settings.vehicle);
  if (options.prints_config) {
    fmt::print("{}", settings.vehicle.text);
    return;
  }
  if (options.out.empty())
    throw UsageError("--out is missing; name the recording to write, for instance drive.mcap");
  for (const std::string& fault : options.faults) settings.faults.push_back(parse_fault(fault));
  std::filesystem::path truth = options.truth;
  if (truth.empty()) truth = std::filesystem::path(options.out).replace_extension(".truth.tum");

  const StopSignal stop;
  DriveSimulationResult result;
  {
    Progress progress("of the drive");
    result = simulate_drive(
        settings, options.out,
        [&progress](double done_s, double all_s) {
          progress(static_cast<std::size_t>(done_s), static_cast<std::size_t>(all_s));
        },
        [&stop] { return stop.received() != 0; });
  }
  write_tum(truth, result.truth);
  for (const std::string& notice : result.notices) fmt::print(stderr, "alces: {}\n", notice);
  fmt::print("{} scans of {:.0f} points and {} incomplete ones, {:.0f} m in {:.0f} s\n", result.scans,
             result.mean_points, result.scans_incomplete, result.way_m, result.duration_s);
  fmt::print("{}: {} events, {}; the truth: {}\n", options.out, result.events, format_byte_size(result.bytes),
             truth.string());
  if (result.was_stopped) {
    std::fflush(stdout);
    throw Error("interrupted; the recording ends there", 128 + stop.received());
  }
}

}  // namespace

void add_simulate_command(CLI::App& alces) {
  auto options = std::make_shared<SimulateOptions>();
  CLI::App* verb =
      alces.add_subcommand("simulate", "A recorded drive of a simulated vehicle, with its ground truth.");
  verb->footer(simulate_footer);
  verb->add_option("--out", options->out, "the recording to write (MCAP)");
  verb->add_option("--truth", options->truth, "where the true poses go, instead of beside the recording");
  verb->add_option("--scans", options->settings.scans, "how long the drive is, in scans of 1.2 s")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  verb->add_option("--seed", options->settings.seed, "another seed is another town, drive and noise")
      ->capture_default_str();
  verb->add_option("--speed", options->settings.speed_m_per_s, "mean speed in m/s; 0: about 1.1")
      ->check(CLI::Range(0.0, 5.0))
      ->capture_default_str();
  verb->add_option("--standstill", options->settings.standstill_s,
                   "seconds that the vehicle stands before it drives; alces calibrate wants 15 or more")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  verb->add_option(
          "--rings", options->settings.rings,
          "of each sweep only so many rays measure, spread over 30 deg about the horizon, as the beams of a "
          "multi-beam lidar; 0: all")
      ->check(CLI::Range(0, 31))
      ->capture_default_str();
  verb->add_option("--snow", options->settings.snow_share,
                   "share of the rays that meet a snowflake, 1 to 6 m away")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  verb->add_option("--crowd", options->settings.people,
                   "so many people walk around the vehicle, 1.5 to 8 m away")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  verb->add_option("--fault", options->faults,
                   "what goes wrong: NAME@SECONDS[+SECONDS][=NUMBER]; may be repeated");
  verb->add_option("--config", options->config, "a vehicle.toml for the drivers instead of the matching one");
  verb->add_flag("--print-config", options->prints_config,
                 "print the vehicle's configuration and simulate nothing");
  verb->callback([options] { simulate(*options); });
}

}  // namespace alces::offline
