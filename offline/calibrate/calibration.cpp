#include "calibration.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "offline/io/files/error.h"
#include "offline/map/map_run.h"
#include "offline/replay/drive_replay.h"

namespace alces::offline {
namespace {

constexpr double degrees_a_radian = 180 / std::numbers::pi;
constexpr double longest_gap_m = 5;  // between scans that follow each other

std::vector<Mounting> lasers_of(const settings::VehicleSettings& settings) {
  std::vector<Mounting> lasers;
  for (std::uint32_t laser = 0; laser < settings.scanner.assembler.laser_count; ++laser)
    lasers.push_back(mounting_of(settings.scanner.assembler.lasers[laser].head_from_laser));
  return lasers;
}

void refuse_to_stop(const CalibrationCallbacks& callbacks) {
  const int signal = callbacks.stop_signal ? callbacks.stop_signal() : 0;
  if (signal != 0) throw Error("interrupted; nothing is written", 128 + signal);
}

// Why there is no stand, in one sentence.
[[noreturn]] void refuse(const std::filesystem::path& drive, const StandingTurns& turns,
                         const DriveReplay& replay) {
  const std::vector<std::string> problems = replay.warnings();
  const std::string hint = problems.empty() ? "" : "; the recording says: " + problems.front();
  if (turns.profiles() == 0)
    throw InputError(drive, "no laser profile with a known angle of the head is in it" + hint);
  for (std::uint32_t laser = 0; laser < replay.settings().scanner.assembler.laser_count; ++laser)
    if (turns.profiles_of()[laser] == 0)
      throw InputError(drive,
                       fmt::format("laser_{} sent no profile{}", static_cast<char>('a' + laser), hint));
  const double longest_deg = turns.longest_turn_rad() * degrees_a_radian;
  if (longest_deg < 356)
    throw InputError(drive,
                     fmt::format("holds no full turn of the head, the longest is {:.0f} deg; record 15 s and "
                                 "more with the head turning and the vehicle standing{}",
                                 longest_deg, hint));
  if (turns.profiles_without_motion() == turns.profiles())
    throw InputError(drive,
                     "holds no odometry, so that nobody knows whether the vehicle stood; when you do, say so "
                     "with --standing");
  throw InputError(drive,
                   fmt::format("the vehicle moved: the head turned {:.0f} deg at most while it stood; let it "
                               "stand for 15 s and more",
                               turns.longest_standing_turn_rad() * degrees_a_radian));
}

// The scans of the drive matched one to the other, with the mounting as it is now known.
std::vector<DriveStep> match_drive(const std::filesystem::path& drive,
                                   const settings::VehicleSettings& settings,
                                   const CalibrationOptions& options, const CalibrationCallbacks& callbacks) {
  DriveReplayOptions replay;
  replay.settings = settings;
  replay.maps_dropped_scans = true;
  DriveReplay scans(drive, replay);
  MapRequest request;
  request.config = settings.mapper;
  request.memory_bytes = std::size_t{512} << 20;
  request.loop_back_end = LoopBackEnd::none;
  MapRun run(scans, request);
  std::size_t done = 0;
  run.run({[&](std::size_t now, std::size_t) {
             done = now;
             if (callbacks.progress) callbacks.progress("driving", now, options.most_driven_scans);
           },
           [&] {
             const int signal = callbacks.stop_signal ? callbacks.stop_signal() : 0;
             return signal != 0 ? signal : (done >= options.most_driven_scans ? 1 : 0);
           }});
  refuse_to_stop(callbacks);
  const Trajectory matched = run.trajectory_without_loops();
  std::vector<DriveStep> steps;
  for (std::size_t i = 1; i < run.mapped().size(); ++i) {
    const MappedScan& scan = run.mapped()[i];
    const MappedScan& before = run.mapped()[i - 1];
    if (scan.is_predicted || scan.source_index != before.source_index + 1) continue;
    const auto odometry = scans.odometry(scan.source_index);
    const auto odometry_before = scans.odometry(before.source_index);
    if (!odometry || !odometry_before) continue;
    DriveStep step;
    step.odometry = odometry_before->inverse() * *odometry;
    step.matched = matched.poses[i - 1].inverse() * matched.poses[i];
    if (step.odometry.translation_m.norm() > longest_gap_m) continue;
    steps.push_back(step);
  }
  return steps;
}

}  // namespace

Calibration calibrate(const std::filesystem::path& drive, const CalibrationOptions& options,
                      const CalibrationCallbacks& callbacks) {
  Calibration result;
  StandingTurns turns(options.turns);
  DriveReplayOptions replay_options;
  replay_options.config = options.config;
  replay_options.maps_dropped_scans = true;
  replay_options.profiles = &turns;
  DriveReplay replay(drive, replay_options);
  result.configured = replay.settings();
  turns.set_mounting(result.configured.scanner.assembler);
  ScanPoints scan;
  std::optional<Pose> before;
  for (std::size_t i = 0; replay.read(i, scan); ++i) {
    refuse_to_stop(callbacks);
    if (callbacks.progress) callbacks.progress("reading", i + 1, replay.size());
    const std::optional<Pose> odometry = replay.odometry(i);
    if (odometry && before) result.way_m += (odometry->translation_m - before->translation_m).norm();
    before = odometry;
  }
  turns.finish();
  if (turns.stands() == 0) refuse(drive, turns, replay);
  result.warnings = replay.warnings();
  result.rays = turns.rays();
  result.turns = turns.turns();

  const std::vector<Mounting> configured = lasers_of(result.configured);
  result.lasers = estimate_mounting(result.rays, configured, options.mounting,
                                    [&callbacks](std::size_t done, std::size_t total) {
                                      refuse_to_stop(callbacks);
                                      if (callbacks.progress) callbacks.progress("lasers", done, total);
                                    });
  settings::VehicleSettings corrected = result.configured;
  ScanAssemblerConfig& assembler = corrected.scanner.assembler;
  for (std::size_t laser = 0; laser < result.lasers.lasers.size(); ++laser)
    assembler.lasers[laser].head_from_laser = pose_of(result.lasers.lasers[laser]);

  result.configured_head = mounting_of(assembler.body_from_head);
  const std::vector<Eigen::Vector3d> ends_m = ray_ends_m(result.rays, result.lasers.lasers);
  result.ground = estimate_ground(result.rays, ends_m, result.configured_head, options.ground);
  result.head = result.ground.head;
  assembler.body_from_head = pose_of(result.head);

  if (!options.uses_drive) {
    result.why_no_drive = "a drive was not to be used";
  } else if (result.way_m < options.least_way_m) {
    result.why_no_drive =
        fmt::format("the recording drives {:.0f} m, {:.0f} are needed", result.way_m, options.least_way_m);
  } else {
    const std::vector<DriveStep> steps = match_drive(drive, corrected, options, callbacks);
    result.drive = estimate_drive_geometry(steps, result.head, options.drive);
    for (const MountingKey key : {key_x, key_y, key_yaw}) result.head[key] = result.drive->head[key];
  }
  return result;
}

std::string to_toml(const Calibration& calibration) {
  const auto line = [](MountingKey key, double value, const std::string& comment) {
    const double shown = is_angle(key) ? value * degrees_a_radian : value;
    return fmt::format("{:<35} # {}\n", fmt::format("{} = {:.4f}", name(key), shown + 0.0), comment);
  };
  const auto sigma_of = [](MountingKey key, double sigma) {
    return is_angle(key) ? fmt::format("+- {:.3f} deg", sigma * degrees_a_radian)
                         : fmt::format("+- {:.1f} mm", sigma * 1000);
  };
  std::string toml = "# By alces calibrate: to be pasted over the keys of vehicle.toml. m and deg.\n";
  for (const MountingParameter& parameter : calibration.lasers.parameters) {
    if (parameter.key == key_x)
      toml += fmt::format("\n[laser_{}]\n", static_cast<char>('a' + parameter.laser));
    std::string comment = sigma_of(parameter.key, parameter.sigma);
    if (parameter.fate == Fate::same_as_head) comment = "as configured: the same as the head's";
    if (parameter.fate == Fate::undetermined) comment = "as configured: not determined by this recording";
    toml += line(parameter.key, parameter.estimated, comment);
  }
  const std::string kept = "as configured: not determined by this recording";
  const GroundEstimate& ground = calibration.ground;
  const DriveGeometry drive = calibration.drive.value_or(DriveGeometry{});
  const auto head = [&](MountingKey key, bool is_estimated, double sigma) {
    toml += line(key, calibration.head[key], is_estimated ? sigma_of(key, sigma) : kept);
  };
  toml += "\n[head]\n";
  head(key_x, drive.has_x, drive.sigma_x_m);
  head(key_y, drive.has_y, drive.sigma_y_m);
  head(key_z, ground.is_found, ground.sigma_z_m);
  head(key_roll, ground.is_found, ground.sigma_roll_rad);
  head(key_pitch, ground.is_found, ground.sigma_pitch_rad);
  head(key_yaw, drive.has_yaw, drive.sigma_yaw_rad);
  return toml;
}

}  // namespace alces::offline
