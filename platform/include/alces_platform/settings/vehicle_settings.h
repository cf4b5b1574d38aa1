// One TOML file describes a vehicle: what hangs on which wire, how it is mounted, and how the program runs;
// beside the tables of map.toml, which say how to map. `alcesd` runs by it, `alces simulate` builds the
// simulated vehicle by it, and every recording carries it, so that a drive replays alone.
// docs/examples/vehicle.toml holds all of it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "alces/mapper.h"
#include "alces_drivers/scanner/scanner.h"

namespace alces::settings {

/// Where a laser is connected.
struct LaserLine {
  bool is_tcp = false;
  std::string device;  ///< serial: a path, better by-id
  std::string host;    ///< TCP
  std::uint16_t port = 2112;
};

/// The shared page for programs beside alcesd (alces/page.h).
struct PageSettings {
  std::string path;           ///< on tmpfs; empty: there is none
  std::string group;          ///< that may read it; empty: alcesd's own
  std::string mode = "0640";  ///< 0600, 0640 or 0644: readers never write
};

struct VehicleSettings {
  ScannerConfig scanner;
  /// scan_capacity 0: as many as memory allows or the drive has; pool_bytes 0: what is left of memory_bytes.
  MapperConfig mapper;

  // The wires.
  std::string can_interface = "can0";
  std::string gpio_chip = "gpiochip0";
  std::string permit_socket = "/run/alces/permit";  ///< with [motor] permit = "socket"
  std::vector<std::string> gpio_lines;              ///< in the order of GpioEdge::line; numbers or names
  std::array<LaserLine, ScannerConfig::maximum_lasers> laser_lines;
  std::string gps_device;
  std::uint32_t gps_baud = 4800;

  // The program.
  std::size_t memory_bytes = std::size_t{64} << 20;  ///< of the mapper's block
  std::string archive;                               ///< a file for scans that do not fit; empty: none
  std::uint32_t scan_slots = 4;                      ///< scans that may wait for the mapper
  bool maps_incomplete_scans = false;
  std::int64_t mapping_timeout_ns = 20 * ns_per_s;  ///< a scan that takes the mapper longer: it hangs
  std::string recording;  ///< a file, %t in it becomes the UTC time of the start; empty: nothing is recorded
  std::uint64_t recording_limit_bytes = 0;  ///< then recording ends, and is told; 0: none
  std::uint64_t recording_reserve_bytes = std::uint64_t{1} << 30;  ///< of its disk stays free; 0: none
  int fifo_priority = 0;  ///< of the acquisition thread; 0: not real-time
  int processor = -1;     ///< of the acquisition thread; -1: any
  bool locks_memory = false;
  PageSettings page;

  /// The file as it was read: what a recording carries.
  std::string text;
};

/// A vehicle that answers to `alces simulate`'s: a TMCM-1636 as node 1 behind a gear of 60, index pulse on
/// line 0, two LMS 291, wheels and gyro on CAN, GPS.
[[nodiscard]] VehicleSettings default_vehicle_settings();

/// Error, with the line, for unknown tables and keys, wrong types, and values that cannot be or do not go
/// together.
[[nodiscard]] VehicleSettings read_vehicle_settings(const std::filesystem::path& file);
/// The same from text; `name` stands for the file in errors.
[[nodiscard]] VehicleSettings parse_vehicle_settings(const std::string& text, const std::string& name);

/// A whole TOML file with comments, such that parse_vehicle_settings() gives the same settings.
[[nodiscard]] std::string to_toml(const VehicleSettings& settings);

}  // namespace alces::settings
