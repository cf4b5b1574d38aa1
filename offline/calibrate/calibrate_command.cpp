// alces calibrate: how lasers and head are mounted, from a recorded full turn.
#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "calibration.h"
#include "offline/io/files/error.h"
#include "offline/io/files/json_text.h"
#include "offline/io/files/output_file.h"
#include "offline/io/files/stop_signal.h"
#include "offline/program/command.h"
#include "slice_picture.h"

namespace alces::offline {
namespace {

struct CalibrateOptions {
  std::string drive;
  std::string config;
  std::string out;
  std::string pictures;
  double ground_z_m = 0;
  std::size_t turns = 8;
  bool is_standing = false;
  bool is_flat = false;
  bool no_drive = false;
  bool json = false;
};

constexpr const char* calibrate_footer = R"(Examples:
  alcesd --config vehicle.toml --record standing.mcap       the head turns, the vehicle stands, for 15 s and more; Ctrl-C
  alces calibrate standing.mcap --out mounting.toml         how lasers and head are mounted, as tables to paste
  alces calibrate standing.mcap --pictures calibration      ... and calibration/before.png, after.png to look at
  alces calibrate hall.mcap --flat                          in a hall: the tilt of all lasers, too
  alces calibrate drive.mcap                                stands, then drives: yaw of the head, too
  alces calibrate again.mcap --config corrected.toml        does the pasted configuration hold?

Where a surface is seen twice - by two lasers, or by both halves of a scan plane of more than half a turn - a wrong mounting
shows it double; the mounting is changed until the views agree. The ground gives the head's roll, pitch and height: the wheels
must stand on the plane that is seen around the vehicle. A drive, if the recording has one, gives the head's yaw from straight
ways, and its x and y from bends.

Start within 10 cm and 3 deg of the truth, stand within 10 m of large walls on several sides, keep people away. What a
recording does not determine keeps its configured value and is named. The height of all lasers along the axis and their turn
about it are the same as the head's z and yaw. Two lasers back to back show their difference: the second is brought into line
with the first, which is taken as configured; in a hall, --flat finds its tilt, too. docs/calibration.md says more.

DRIVE is a recording (MCAP, of alcesd or alces simulate) or a folder of traces, as for alces replay. +- is one standard deviation.

Exit status: 0 done, 2 usage, 3 unreadable or invalid input, 5 a device failed or a file cannot be written, 130 Ctrl-C.)";

constexpr double degrees_a_radian = 180 / std::numbers::pi;

/// What is said of one key, of a laser or of the head.
struct Row {
  std::string table;
  MountingKey key = key_x;
  double configured = 0;
  double estimated = 0;
  double sigma = 0;
  bool is_estimated = false;
  std::string why_not;
};

std::vector<Row> rows_of(const Calibration& calibration) {
  std::vector<Row> rows;
  for (const MountingParameter& parameter : calibration.lasers.parameters) {
    Row row{fmt::format("laser_{}", static_cast<char>('a' + parameter.laser)),
            parameter.key,
            parameter.configured,
            parameter.estimated,
            parameter.sigma,
            parameter.fate == Fate::estimated,
            ""};
    if (parameter.fate == Fate::same_as_head)
      row.why_not = fmt::format("kept: cannot be told from {} of the head", name(parameter.key));
    if (parameter.fate == Fate::undetermined)
      row.why_not = is_angle(parameter.key)
                        ? fmt::format("kept: would be +- {:.2f} deg here", parameter.sigma * degrees_a_radian)
                        : fmt::format("kept: would be +- {:.0f} mm here", parameter.sigma * 1000);
    rows.push_back(row);
  }
  const GroundEstimate& ground = calibration.ground;
  const DriveGeometry drive = calibration.drive.value_or(DriveGeometry{});
  const std::string no_ground = "kept: no ground was found where the configuration has it";
  std::string no_drive = "kept: " + calibration.why_no_drive;
  if (calibration.drive)
    no_drive = drive.steps == 0 ? "kept: no scans of the drive could be matched"
                                : "kept: the drive does not determine it";
  const auto add = [&](MountingKey key, bool is_estimated, double sigma, const std::string& why_not) {
    rows.push_back({"head", key, calibration.configured_head[key], calibration.head[key], sigma, is_estimated,
                    is_estimated ? "" : why_not});
  };
  add(key_x, drive.has_x, drive.sigma_x_m, no_drive);
  add(key_y, drive.has_y, drive.sigma_y_m, no_drive);
  add(key_z, ground.is_found, ground.sigma_z_m, no_ground);
  add(key_roll, ground.is_found, ground.sigma_roll_rad, no_ground);
  add(key_pitch, ground.is_found, ground.sigma_pitch_rad, no_ground);
  add(key_yaw, drive.has_yaw, drive.sigma_yaw_rad, no_drive);
  return rows;
}

nlohmann::json json_of(const Calibration& calibration) {
  nlohmann::json json;
  const auto agreement = [](const ViewAgreement& views) {
    return nlohmann::json{
        {"rms_m", views.rms_m}, {"median_gap_m", views.median_gap_m}, {"rms_gap_m", views.rms_gap_m}};
  };
  json["turns"] = calibration.turns;
  json["rays"] = calibration.lasers.rays;
  json["patches"] = calibration.lasers.patches;
  json["patches_seen_twice"] = calibration.lasers.patches_seen_twice;
  json["iterations"] = calibration.lasers.iterations;
  json["has_converged"] = calibration.lasers.has_converged;
  json["before"] = agreement(calibration.lasers.before);
  json["after"] = agreement(calibration.lasers.after);
  if (calibration.ground.is_found)
    json["ground"] = {{"points", calibration.ground.points}, {"rms_m", calibration.ground.rms_m}};
  if (calibration.drive)
    json["drive"] = {{"steps", calibration.drive->steps},
                     {"way_m", calibration.drive->way_m},
                     {"turned_rad", calibration.drive->turned_rad},
                     {"odometry_scale", calibration.drive->odometry_scale},
                     {"odometry_scale_sigma", calibration.drive->sigma_scale}};
  for (const Row& row : rows_of(calibration)) {
    const double unit = is_angle(row.key) ? degrees_a_radian : 1;
    nlohmann::json& entry = json["mounting"][row.table][name(row.key)];
    entry = {{"configured", row.configured * unit}, {"value", row.estimated * unit}};
    if (row.is_estimated)
      entry["sigma"] = row.sigma * unit;
    else
      entry["kept"] = row.why_not;
  }
  return json;
}

void print(const Calibration& calibration) {
  std::size_t turns = 0;
  for (const std::size_t of_stand : calibration.turns) turns += of_stand;
  const MountingEstimate& lasers = calibration.lasers;
  fmt::print("{} full turns of the head in {} {}, {} rays; {} flat surfaces, {} of them seen twice\n", turns,
             calibration.turns.size(), calibration.turns.size() == 1 ? "stand" : "stands", lasers.rays,
             lasers.patches, lasers.patches_seen_twice);
  fmt::print("{:34}{:>10}{:>10}\n", "", "before", "after");
  fmt::print("{:34}{:>7.1f} mm{:>7.1f} mm\n", "points off their surfaces, rms", lasers.before.rms_m * 1000,
             lasers.after.rms_m * 1000);
  if (lasers.patches_seen_twice > 0) {
    fmt::print("{:34}{:>7.1f} mm{:>7.1f} mm\n", "gap between the views, median",
               lasers.before.median_gap_m * 1000, lasers.after.median_gap_m * 1000);
    fmt::print("{:34}{:>7.1f} mm{:>7.1f} mm\n", "gap between the views, rms", lasers.before.rms_gap_m * 1000,
               lasers.after.rms_gap_m * 1000);
  }
  if (calibration.ground.is_found)
    fmt::print("ground: {} points of {} {} in its plane, rms {:.1f} mm\n", calibration.ground.points,
               calibration.ground.stands, calibration.ground.stands == 1 ? "stand" : "stands",
               calibration.ground.rms_m * 1000);
  if (calibration.drive)
    fmt::print(
        "drive: {} steps, {:.0f} m, {:.0f} deg of bends; matching sees {:.4f} +- {:.4f} of odometry's way\n",
        calibration.drive->steps, calibration.drive->way_m, calibration.drive->turned_rad * degrees_a_radian,
        calibration.drive->odometry_scale, calibration.drive->sigma_scale);
  std::string table;
  for (const Row& row : rows_of(calibration)) {
    if (row.table != table) fmt::print("\n[{}]{:>23}{:>12}\n", row.table, "configured", "now");
    if (row.table != table) table = row.table;
    const double unit = is_angle(row.key) ? degrees_a_radian : 1000;
    const int digits = is_angle(row.key) ? 3 : 1;
    std::string key = name(row.key);
    key = key.substr(0, key.find('_')) + (is_angle(row.key) ? ", deg" : ", mm");
    const std::string now =
        row.is_estimated ? fmt::format("{:.{}f}", row.estimated * unit + 0.0, digits) : "";
    const std::string note =
        row.is_estimated ? fmt::format("+- {:.{}f}", row.sigma * unit, digits) : row.why_not;
    fmt::print("{:12}{:>18.{}f}{:>12}  {}\n", key, row.configured * unit + 0.0, digits, now, note);
  }
}

void draw(const Calibration& calibration, const std::filesystem::path& folder) {
  make_folder(folder);
  std::vector<Mounting> configured;
  for (std::size_t laser = 0; laser < calibration.lasers.lasers.size(); ++laser)
    configured.push_back(mounting_of(calibration.configured.scanner.assembler.lasers[laser].head_from_laser));
  std::vector<int> views;
  for (const StandingRay& ray : calibration.rays)
    views.push_back(2 * ray.laser +
                    half_of_plane(configured[ray.laser], static_cast<double>(ray.ray_angle_rad)));
  draw_slices(folder / "before.png", calibration.rays, ray_ends_m(calibration.rays, configured), views,
              "before");
  draw_slices(folder / "after.png", calibration.rays, ray_ends_m(calibration.rays, calibration.lasers.lasers),
              views, "after");
}

void calibrate_drive(const CalibrateOptions& options) {
  CalibrationOptions calibration_options;
  if (!options.config.empty()) calibration_options.config = options.config;
  calibration_options.turns.most_turns = options.turns;
  calibration_options.turns.is_vouched_for = options.is_standing;
  calibration_options.mounting.surfaces_are_flat = options.is_flat;
  calibration_options.ground.ground_z_m = options.ground_z_m;
  calibration_options.uses_drive = !options.no_drive && !options.is_standing;
  const StopSignal stop;
  Calibration calibration;
  {
    Progress progress("of the calibration");
    // Reading is about half of the work, the rest is shared by what follows.
    calibration =
        calibrate(options.drive, calibration_options,
                  {[&progress](const char* stage, std::size_t done, std::size_t total) {
                     const std::string_view name(stage);
                     const std::size_t from = name == "reading" ? 0 : name == "lasers" ? 50 : 75;
                     const std::size_t share = name == "reading" ? 50 : 25;
                     progress(from + share * std::min(done, total) / std::max<std::size_t>(1, total), 100);
                   },
                   [&stop] { return stop.received(); }});
  }
  for (const std::string& warning : calibration.warnings) fmt::print(stderr, "alces: warning: {}\n", warning);
  if (!calibration.lasers.has_converged)
    fmt::print(stderr, "alces: warning: the iteration did not come to rest; look at the pictures\n");
  if (options.json)
    fmt::print("{}\n", json_text(json_of(calibration)));
  else
    print(calibration);
  if (!options.pictures.empty()) draw(calibration, options.pictures);
  if (options.out.empty()) return;
  OutputFile file(options.out);
  file.write(to_toml(calibration));
  file.commit();
  if (!options.json) fmt::print("\n{}: to be pasted over the same keys of vehicle.toml\n", options.out);
}

}  // namespace

void add_calibrate_command(CLI::App& alces) {
  auto options = std::make_shared<CalibrateOptions>();
  CLI::App* verb = alces.add_subcommand(
      "calibrate", "How lasers and head are mounted, from a recorded full turn of the head.");
  verb->footer(calibrate_footer);
  verb->add_option("DRIVE", options->drive, "a recording, or a folder of traces")->required();
  verb->add_option("--out", options->out, "a TOML file for what was found: [laser_a], [laser_b], [head]");
  verb->add_option("--pictures", options->pictures, "a folder for before.png and after.png");
  verb->add_option("--config", options->config, "a vehicle.toml instead of the recording's own");
  verb->add_option("--ground", options->ground_z_m,
                   "height of the ground under the wheels in the body frame, m")
      ->check(CLI::Range(-10.0, 10.0))
      ->capture_default_str();
  verb->add_option("--turns", options->turns, "at most so many of each stand")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  verb->add_flag(
      "--flat", options->is_flat,
      "floor and walls are flat to millimetres (a hall): what is wrong with all views alike shows, too");
  verb->add_flag("--standing", options->is_standing,
                 "the vehicle stood all the time: ask no odometry, and do not use a drive");
  verb->add_flag("--no-drive", options->no_drive, "leave the head's x, y and yaw as they are");
  verb->add_flag("--json", options->json, "for machines");
  verb->callback([options] { calibrate_drive(*options); });
}

}  // namespace alces::offline
