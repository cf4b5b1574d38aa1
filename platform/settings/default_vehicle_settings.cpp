// The numbers of the simulated vehicle (platform/sim: RigGeometry, RigSettings, SimulatedCia402Drive as a
// TMCM-1636), which are those of a real one of its kind: test/platform/default_vehicle_settings_test.cpp
// holds them against each other.
#include <numbers>

#include "alces_platform/settings/mapper_settings.h"
#include "alces_platform/settings/vehicle_settings.h"
#include "quantities.h"

namespace alces::settings {
namespace {

constexpr double half_turn_s = 1.2;
constexpr double sweeps_per_s = 75;
constexpr int gear = 60;  // turns of the motor a turn of the head

/// Trinamic TMCM-1636, firmware manual for CANopen: velocities in rpm, accelerations in rpm/s, 65536 counts a
/// turn.
MotorConfig tmcm1636() {
  canopen::PdoConfig position;
  position.number = 1;
  position.forbids_remote_frames = true;  // its COB-IDs have bit 30 set
  position.entries = {{0x6041, 0, 16}, {0x6064, 0, 32}};
  canopen::PdoConfig velocity = position;
  velocity.number = 2;
  velocity.entries = {{0x606C, 0, 32}};
  canopen::PdoConfig control;
  control.number = 1;
  control.entries = {{0x6040, 0, 16}, {0x60FF, 0, 32}};
  const auto unwanted = [](std::uint16_t number, bool forbids_remote_frames) {
    canopen::PdoConfig pdo;
    pdo.number = number;
    pdo.forbids_remote_frames = forbids_remote_frames;
    return pdo;
  };

  MotorConfig motor;
  motor.node = 1;
  motor.checks = {{0x1000, 0, 0xFFFF, 0x0192}, {0x1018, 1, 0xFFFFFFFF, 0x286}};  // CiA 402; Trinamic
  motor.writes = {{0x6083, 0, 4, 1500}, {0x6084, 0, 4, 1500}, {0x6085, 0, 4, 6000}};
  motor.tpdos = {position, velocity};
  motor.rpdos = {control};
  motor.tpdos_to_disable = {unwanted(3, true), unwanted(4, true)};
  motor.rpdos_to_disable = {unwanted(2, false), unwanted(3, false), unwanted(4, false)};
  motor.own_heartbeat_period_ns = 100 * ns_per_ms;
  motor.own_heartbeat_timeout_ms = 1000;
  motor.target_velocity_units = 25 * gear;  // half a turn in 1.2 s
  motor.velocity_tolerance_units = 75;
  motor.stall_velocity_units = 30;
  return motor;
}

EncoderConfig head_encoder() {
  EncoderConfig encoder;
  encoder.index_line = 0;
  encoder.index_angle_rad = 0.4;
  encoder.index_width_rad = 0.035;
  encoder.drive_counts_per_turn = 65536 * gear;
  encoder.expected_speed_rad_s = std::numbers::pi / half_turn_s;
  return encoder;
}

OdometryConfig wheels_and_gyro() {
  const auto wheel = [](std::uint16_t start_bit) {
    return CanSignalSource{
        0x110, false, {start_bit, 16, ByteOrder::intel, RawType::signed_integer, 0.001, 0, 0, 0}};
  };
  OdometryConfig odometry;
  odometry.kind = OdometryKind::wheels;
  odometry.left_speed_m_s = wheel(0);
  odometry.right_speed_m_s = wheel(16);
  odometry.wheel_base_m = 0.6;
  odometry.yaw_rate_rad_s = {
      0x111, false, {7, 16, ByteOrder::motorola, RawType::signed_integer, 0.0001, 0, 0, 0}};
  odometry.alive_counter = {0x110, false, {32, 8, ByteOrder::intel, RawType::unsigned_integer, 1, 0, 0, 0}};
  odometry.latency_ns = 7'500'000;  // means over 20 ms and 10 ms, so they are 10 and 5 ms old
  odometry.learn_rate_bias = true;
  return odometry;
}

ScanAssemblerConfig two_lasers_back_to_back() {
  ScanAssemblerConfig assembler;
  assembler.laser_count = 2;
  for (std::size_t number = 0; number < 2; ++number) {
    LaserMounting& laser = assembler.lasers[number];
    const double away_from_axis_m = number == 0 ? 0.08 : -0.08;
    laser.head_from_laser = pose_of({{away_from_axis_m, 0, 0}, 90, 0, number == 0 ? 0.0 : 180.0});
    laser.minimum_range_m = 0.96;  // its deck
    laser.maximum_range_m = 40;
  }
  assembler.body_from_head = pose_of({{0.05, 0, 1}, 0, 0, 0});
  assembler.turn_rad = std::numbers::pi;
  assembler.expected_profiles = static_cast<std::uint32_t>(2 * sweeps_per_s * half_turn_s + 0.5);
  assembler.minimum_profiles = assembler.expected_profiles * 2 / 3;
  assembler.capacity = {.rays_per_profile = 181, .waiting_profiles = 160, .points_per_scan = 40000};
  return assembler;
}

}  // namespace

VehicleSettings default_vehicle_settings() {
  VehicleSettings vehicle;
  ScannerConfig& scanner = vehicle.scanner;
  scanner.motor = tmcm1636();
  scanner.encoder = head_encoder();
  constexpr std::array<const char*, ScannerConfig::maximum_lasers> names{"laser a", "laser b"};
  for (std::uint8_t laser = 0; laser < ScannerConfig::maximum_lasers; ++laser) {
    scanner.laser_makes[laser] = LaserMake::lms2xx;
    scanner.lms2xx[laser].name = scanner.cola_b[laser].name = names[laser];
    scanner.lms2xx[laser].laser = scanner.cola_b[laser].laser = laser;
    vehicle.laser_lines[laser].device = laser == 0 ? "/dev/ttyUSB0" : "/dev/ttyUSB1";
  }
  scanner.odometry = wheels_and_gyro();
  scanner.has_gps = true;
  scanner.gps.delay_ns = 200 * ns_per_ms;  // 120 ms of thinking and 75 characters at 9600 baud
  vehicle.gps_device = "/dev/ttyUSB2";
  vehicle.gps_baud = 9600;
  scanner.assembler = two_lasers_back_to_back();
  vehicle.gpio_lines = {"17"};
  vehicle.mapper = default_mapper_settings();
  vehicle.text = to_toml(vehicle);
  return vehicle;
}

}  // namespace alces::settings
