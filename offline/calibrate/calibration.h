// What `alces calibrate` does: a recording through the drivers, its stands to the mounting of the lasers
// (mounting_estimate.h), the ground around them to the tilt and height of the head (ground_plane.h), and what
// it drives to the head's yaw and place (drive_geometry.h).
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "alces_platform/settings/vehicle_settings.h"
#include "drive_geometry.h"
#include "ground_plane.h"
#include "mounting_estimate.h"
#include "standing_turns.h"

namespace alces::offline {

struct CalibrationOptions {
  std::optional<std::filesystem::path> config;  ///< instead of the recording's own
  StandingTurnsSettings turns;
  MountingSettings mounting;
  GroundSettings ground;
  DriveGeometrySettings drive;
  bool uses_drive = true;
  double least_way_m = 15;              ///< a recording that drives less tells nothing of ahead
  std::size_t most_driven_scans = 300;  ///< that are matched; the first ones
};

struct Calibration {
  settings::VehicleSettings configured;
  std::vector<StandingRay> rays;
  std::vector<std::size_t> turns;  ///< of every stand
  MountingEstimate lasers;
  GroundEstimate ground;
  std::optional<DriveGeometry> drive;  ///< none: the recording has no drive, or it was not to be used
  std::string why_no_drive;            ///< one clause
  Mounting configured_head{};
  Mounting head{};  ///< with what ground and drive say
  double way_m = 0;
  std::vector<std::string> warnings;
};

struct CalibrationCallbacks {
  /// Of a stage ("reading", "lasers", "driving"); may be empty.
  std::function<void(const char* stage, std::size_t done, std::size_t total)> progress;
  std::function<int()> stop_signal;  ///< the signal that asks for an end, 0 for none; may be empty
};

/// InputError: what cannot be read, has no full turn at rest, or shows too little; Error 130 when stopped.
[[nodiscard]] Calibration calibrate(const std::filesystem::path& drive, const CalibrationOptions& options,
                                    const CalibrationCallbacks& callbacks = {});

/// [laser_a], [laser_b] and [head] with their six keys, each with where it comes from: to be pasted over
/// those of vehicle.toml.
[[nodiscard]] std::string to_toml(const Calibration& calibration);

}  // namespace alces::offline
