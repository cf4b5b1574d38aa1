#include "vehicle_check.h"

#include <set>

#include "mapper_check.h"
#include "toml_reader.h"

namespace alces::settings {
namespace {

constexpr std::array<const char*, ScannerConfig::maximum_lasers> laser_tables{"laser_a", "laser_b"};

/// `problem`: a driver's sentence, or null.
void refuse(const TomlReader& reader, const char* table, const char* problem) {
  if (problem != nullptr) reader.require(false, table, "", fmt::format("[{}]: {}", table, problem));
}

void check_encoder_lines(const VehicleSettings& vehicle, const TomlReader& reader) {
  const EncoderConfig& encoder = vehicle.scanner.encoder;
  const std::size_t count = vehicle.gpio_lines.size();
  const std::array<std::pair<const char*, std::uint8_t>, 4> lines{{{"index_line", encoder.index_line},
                                                                   {"a_line", encoder.a_line},
                                                                   {"b_line", encoder.b_line},
                                                                   {"sync_line", encoder.sync_line}}};
  for (const auto& [key, line] : lines) {
    reader.require(
        line == EncoderConfig::no_line || line < count, "encoder", key,
        fmt::format("encoder.{} is {}, but gpio.lines has {} entries, counted from 0", key, line, count));
  }
  const std::set<std::string> different(vehicle.gpio_lines.begin(), vehicle.gpio_lines.end());
  reader.require(different.size() == count && different.count("") == 0, "gpio", "lines",
                 "gpio.lines names a line twice, or none");
  reader.require(!vehicle.gpio_chip.empty() || count == 0, "gpio", "chip", "gpio.chip is empty");
}

void check_permit(const VehicleSettings& vehicle, const TomlReader& reader) {
  const std::size_t count = vehicle.gpio_lines.size();
  const PermitConfig& permit = vehicle.scanner.motor.permit;
  reader.require(!vehicle.scanner.has_motor || permit.source != PermitSource::gpio || permit.line < count,
                 "motor", "permit_line",
                 fmt::format("motor.permit_line is {}, but gpio.lines has {} entries, counted from 0",
                             permit.line, count));
  reader.require(permit.source != PermitSource::socket ||
                     (!vehicle.permit_socket.empty() && vehicle.permit_socket.size() < 108),
                 "motor", "permit_socket", "motor.permit_socket must name a file of 1 to 107 bytes");
}

/// Times that contradict each other: the driver refuses some of them, too, but knows no keys.
void check_motor_times(const MotorConfig& motor, const TomlReader& reader) {
  const double timeout_ms = static_cast<double>(motor.heartbeat_timeout_ns) * 1e-6;
  reader.require(motor.heartbeat_timeout_ns == 0 || motor.heartbeat_period_ms == 0 ||
                     timeout_ms > motor.heartbeat_period_ms,
                 "motor", "heartbeat_timeout_ms",
                 fmt::format("motor.heartbeat_timeout_ms is {}, but a heartbeat comes every {} ms "
                             "(heartbeat_period_ms); give at least twice that",
                             timeout_ms, motor.heartbeat_period_ms));
  const double own_period_ms = static_cast<double>(motor.own_heartbeat_period_ns) * 1e-6;
  reader.require(
      motor.own_heartbeat_timeout_ms == 0 || motor.own_heartbeat_period_ns > 0, "motor",
      "own_heartbeat_timeout_ms",
      fmt::format("motor.own_heartbeat_timeout_ms is {}, but own_heartbeat_period_ms is 0: the drive "
                  "would wait for heartbeats that nobody sends",
                  motor.own_heartbeat_timeout_ms));
  reader.require(motor.own_heartbeat_timeout_ms == 0 || own_period_ms < motor.own_heartbeat_timeout_ms,
                 "motor", "own_heartbeat_timeout_ms",
                 fmt::format("motor.own_heartbeat_timeout_ms is {}, but our heartbeat goes out every {} ms "
                             "(own_heartbeat_period_ms); give at least twice that",
                             motor.own_heartbeat_timeout_ms, own_period_ms));
  reader.require(motor.sync.period_ns == 0 || motor.sync.period_ns >= ns_per_ms, "motor", "sync_period_ms",
                 "motor.sync_period_ms is below 1 ms, which no bus and no timer here can keep; 0: no SYNC");
  reader.require(motor.own_heartbeat_period_ns == 0 || motor.own_heartbeat_period_ns >= 10 * ns_per_ms,
                 "motor", "own_heartbeat_period_ms",
                 "motor.own_heartbeat_period_ms is below the 10 ms of the program's ticks");
}

/// How many rays a profile of this laser has; 0: only the laser knows.
double rays_of(const ScannerConfig& scanner, std::size_t laser) {
  if (scanner.laser_makes[laser] == LaserMake::lms2xx) return scanner.lms2xx[laser].field_of_view_deg + 1.0;
  const ColaBConfig& cola_b = scanner.cola_b[laser];
  if (!cola_b.sets_scan) return 0;
  return std::floor((cola_b.stop_angle_deg - cola_b.start_angle_deg) / cola_b.angle_step_deg + 1e-6) + 1;
}

void check_laser(const VehicleSettings& vehicle, std::size_t number, const TomlReader& reader) {
  const ScannerConfig& scanner = vehicle.scanner;
  const char* const table = laser_tables[number];
  const bool is_lms2xx = scanner.laser_makes[number] == LaserMake::lms2xx;
  refuse(reader, table, is_lms2xx ? validate(scanner.lms2xx[number]) : validate(scanner.cola_b[number]));

  const LaserLine& line = vehicle.laser_lines[number];
  reader.require(!(line.is_tcp ? line.host : line.device).empty(), table, line.is_tcp ? "host" : "device",
                 fmt::format("{} has neither a device nor a host", table));
  const double rays = rays_of(scanner, number);
  const std::uint32_t room = scanner.assembler.capacity.rays_per_profile;
  reader.require(
      rays <= room, "assembler", "rays_per_profile",
      fmt::format("assembler.rays_per_profile is {}, but a profile of {} has {} rays", room, table, rays));
}

void check_serial_lines(const VehicleSettings& vehicle, const TomlReader& reader) {
  std::set<std::string> devices;
  for (std::uint32_t laser = 0; laser < vehicle.scanner.assembler.laser_count; ++laser) {
    const LaserLine& line = vehicle.laser_lines[laser];
    const std::string name = line.is_tcp ? fmt::format("{}:{}", line.host, line.port) : line.device;
    reader.require(devices.insert(name).second, laser_tables[laser], line.is_tcp ? "host" : "device",
                   fmt::format("two lasers are connected to {}", name));
  }
  if (!vehicle.scanner.has_gps) return;
  reader.require(!vehicle.gps_device.empty(), "gps", "device",
                 "gps.device is empty, though scanner.has_gps is true");
  reader.require(devices.count(vehicle.gps_device) == 0, "gps", "device",
                 fmt::format("the GPS receiver and a laser are both connected to {}", vehicle.gps_device));
}

}  // namespace

void check_vehicle(const VehicleSettings& vehicle, const TomlReader& reader) {
  const ScannerConfig& scanner = vehicle.scanner;
  if (scanner.has_motor) {
    check_motor_times(scanner.motor, reader);
    check_permit(vehicle, reader);
  }
  if (scanner.has_motor && validate(scanner.motor) != MotorConfigStatus::ok)
    refuse(reader, "motor", to_string(validate(scanner.motor)));
  check_encoder_lines(vehicle, reader);
  refuse(reader, "encoder", validate(scanner.encoder));
  reader.require(scanner.has_motor || scanner.encoder.shape != AngleShape::drive, "encoder", "shape",
                 "encoder.shape is \"drive\", but scanner.has_motor is false");
  for (std::uint32_t laser = 0; laser < scanner.assembler.laser_count; ++laser)
    check_laser(vehicle, laser, reader);
  check_serial_lines(vehicle, reader);
  if (scanner.has_odometry) refuse(reader, "odometry", validate(scanner.odometry));
  if (scanner.has_gps) refuse(reader, "gps", validate(scanner.gps));
  refuse(reader, "assembler", validate(scanner.assembler));
  reader.require(scanner.assembler.expected_profiles == 0 ||
                     scanner.assembler.minimum_profiles <= scanner.assembler.expected_profiles,
                 "assembler", "minimum_profiles",
                 "assembler.minimum_profiles is larger than assembler.expected_profiles");
  refuse(reader, "scanner", validate(scanner));
  check_mapper(vehicle.mapper, reader);
}

}  // namespace alces::settings
