// A drive of the simulated vehicle (alces_platform/sim) with our drivers on its wires, as a recording and its
// ground truth: what `alces simulate` makes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "alces_platform/settings/vehicle_settings.h"
#include "alces_platform/sim/fault.h"
#include "offline/io/map_folder/trajectory.h"

namespace alces::offline {

struct DriveSimulationSettings {
  std::size_t scans = 924;  ///< the paper's drive: 1.24 km with five loops
  std::uint64_t seed = 1;
  double speed_m_per_s = 0;            ///< while driving, mean; 0: about 1.1
  double standstill_s = 6;             ///< before the vehicle drives; the scanner is up after about 4 s
  std::uint32_t rings = 0;             ///< of each sweep only so many rays measure, within 30 deg; 0: all
  double snow_share = 0;               ///< of the rays that meet a snowflake, 1 to 6 m away
  std::size_t people = 0;              ///< who walk around the vehicle, 1.5 to 8 m away
  std::vector<sim::Injection> faults;  ///< at_ns counted from the start of the drive
  settings::VehicleSettings vehicle;   ///< what the drivers go by
};

struct DriveSimulationResult {
  std::uint64_t events = 0;
  std::uint64_t bytes = 0;  ///< of the recording
  double duration_s = 0;
  double way_m = 0;
  std::uint32_t scans = 0;  ///< whole ones
  std::uint32_t scans_incomplete = 0;
  double mean_points = 0;  ///< of the whole ones
  Trajectory truth;        ///< of the whole scans, at their reference times, in the first one's frame
  std::vector<std::string> notices;  ///< warnings and errors, with their time
  bool was_stopped = false;          ///< before the end, by the caller
};

/// `progress` is told seconds done and seconds in all; `is_stopped` is asked as often: true ends the drive
/// early, and the recording is whole all the same. OutputError.
[[nodiscard]] DriveSimulationResult simulate_drive(const DriveSimulationSettings& settings,
                                                   const std::filesystem::path& recording,
                                                   const std::function<void(double, double)>& progress,
                                                   const std::function<bool()>& is_stopped);

/// "laser_unplugged@120", "laser_unplugged@120+5", "bus_load@10+20=90": a fault's name, when it begins, for
/// how long (s), and its argument. UsageError.
[[nodiscard]] sim::Injection parse_fault(const std::string& text);

}  // namespace alces::offline
