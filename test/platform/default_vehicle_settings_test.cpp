// The default vehicle is the simulated one: its numbers are written down twice, and must agree.
#include <catch2/catch.hpp>
#include <memory>
#include <numbers>
#include <span>
#include <vector>

#include "alces_platform/settings/vehicle_settings.h"
#include "alces_platform/sim/simulated_scanner.h"

using namespace alces;

namespace {

void check_same(const Pose& a, const Pose& b) {
  CHECK(angle_between_rad(a.rotation, b.rotation) < 1e-12);
  CHECK((a.translation_m - b.translation_m).norm() < 1e-12);
}

void check_same(const CanSignalSource& ours, const sim::OdometrySensorSettings& sensor,
                sim::OdometryQuantity quantity) {
  for (const sim::OdometrySignal& signal : sensor.signals) {
    if (signal.quantity != quantity || signal.can_id != ours.id) continue;
    CHECK(signal.signal.start_bit == ours.signal.start_bit);
    CHECK(signal.signal.length == ours.signal.length);
    CHECK(signal.signal.order == ours.signal.order);
    CHECK(signal.signal.type == ours.signal.type);
    CHECK(signal.signal.factor == ours.signal.factor);
    CHECK(signal.signal.offset == ours.signal.offset);
    CHECK_FALSE(ours.is_extended);
    return;
  }
  FAIL("the simulated vehicle has no such signal");
}

const sim::SimulatedScannerSettings simulated;
const sim::RigSettings& rig = simulated.rig;

}  // namespace

TEST_CASE("the default vehicle's scanner is mounted as the simulated one") {
  const ScanAssemblerConfig assembler = settings::default_vehicle_settings().scanner.assembler;
  REQUIRE(assembler.laser_count == rig.lasers);
  for (std::uint8_t laser = 0; laser < 2; ++laser) {
    check_same(assembler.lasers[laser].head_from_laser, rig.geometry.head_from_laser(laser));
    CHECK(assembler.lasers[laser].minimum_range_m >= rig.geometry.own_vehicle_range_m());
    CHECK(assembler.lasers[laser].minimum_range_m < rig.geometry.own_vehicle_range_m() + 0.02);
    CHECK(assembler.lasers[laser].maximum_range_m == rig.range_errors.max_range_m);
  }
  check_same(assembler.body_from_head, rig.geometry.body_from_head);
}

TEST_CASE("the default vehicle's head turns and is seen as the simulated one") {
  const settings::VehicleSettings vehicle = settings::default_vehicle_settings();
  const ScannerConfig& scanner = vehicle.scanner;
  const sim::Cia402AxisConfig& axis = simulated.drive.axis;
  CHECK(scanner.motor.node == simulated.drive.slave.node);
  CHECK(scanner.encoder.index_line == sim::HeadEncoderSettings::index_line);
  CHECK(scanner.encoder.index_angle_rad == rig.geometry.index_angle_rad);
  CHECK(scanner.encoder.index_width_rad == rig.encoder.index_width_rad);
  CHECK(scanner.encoder.expected_speed_rad_s == Approx(rig.head_speed_rad_per_s).epsilon(1e-12));
  CHECK(scanner.encoder.drive_counts_per_turn ==
        axis.counts_per_turn * simulated.drive.motor_turns_per_head_turn);
  const double head_rpm = scanner.motor.target_velocity_units * axis.rpm_per_velocity_unit /
                          simulated.drive.motor_turns_per_head_turn;
  CHECK(head_rpm * 2 * std::numbers::pi / 60 == Approx(rig.head_speed_rad_per_s).epsilon(1e-9));
  const double scan_s = scanner.assembler.turn_rad / rig.head_speed_rad_per_s;
  for (std::size_t laser = 0; laser < 2; ++laser)
    CHECK(scanner.lms2xx[laser].turns_per_s == simulated.lasers[laser].turns_per_s);
  CHECK(scanner.assembler.expected_profiles == Approx(scan_s * simulated.lasers[0].turns_per_s * rig.lasers));
  CHECK(scanner.assembler.capacity.points_per_scan >= scanner.assembler.expected_profiles * 181);
}

TEST_CASE("the default vehicle's odometry and GPS are the simulated ones") {
  const settings::VehicleSettings vehicle = settings::default_vehicle_settings();
  const OdometryConfig& odometry = vehicle.scanner.odometry;
  check_same(odometry.left_speed_m_s, rig.odometry, sim::OdometryQuantity::left_speed);
  check_same(odometry.right_speed_m_s, rig.odometry, sim::OdometryQuantity::right_speed);
  check_same(odometry.yaw_rate_rad_s, rig.odometry, sim::OdometryQuantity::gyro_yaw_rate);
  check_same(odometry.alive_counter, rig.odometry, sim::OdometryQuantity::counter);
  CHECK(odometry.wheel_base_m == rig.odometry.track_m);
  CHECK(odometry.learn_rate_bias);
  CHECK(vehicle.scanner.has_gps == rig.has_gps);
  CHECK(vehicle.gps_baud == rig.gps.baud_rate);
}

TEST_CASE("what the default vehicle writes to its drive is in the simulated drive's object dictionary") {
  const MotorConfig motor = settings::default_vehicle_settings().scanner.motor;
  const sim::ObjectDictionary objects = sim::tmcm1636_objects(motor.node);
  for (const canopen::ObjectWrite& write : motor.writes)
    CHECK(objects.find(write.index, write.subindex) != nullptr);
  for (const canopen::ObjectCheck& check : motor.checks) {
    const sim::ObjectEntry* entry = objects.find(check.index, check.subindex);
    REQUIRE(entry != nullptr);
    CHECK((static_cast<std::uint32_t>(entry->default_value) & check.mask) == check.value);
  }
}

TEST_CASE("the default vehicle's scanner gets whole scans from the simulated one") {
  struct Scans final : ScanSink {
    void on_scan(const Scan& scan) override {
      ++count;
      if (!scan.is_incomplete && scan.has_odometry) ++complete;
    }
    int count = 0;
    int complete = 0;
  } scans;
  struct Notices final : NoticePort {
    void raise(const Notice& notice) override {
      if (notice.severity == Severity::error) FAIL_CHECK(notice.source << ": " << notice.text);
    }
  } notices;

  sim::SimulatedScannerSettings scanner_settings;
  scanner_settings.rig.is_parallel = false;
  sim::SimulatedScanner simulated_scanner(scanner_settings);
  sim::SimulatedRig& simulated_rig = simulated_scanner.rig();
  const settings::VehicleSettings vehicle = settings::default_vehicle_settings();
  const ScannerConfig& config = vehicle.scanner;
  REQUIRE(simulated_rig.byte_port(2).set_baud_rate(vehicle.gps_baud));
  REQUIRE(validate(config) == nullptr);
  std::vector<std::byte> memory(Scanner::memory_required(config) + Arena::alignment);
  void* start = memory.data();
  std::size_t space = memory.size();
  std::align(Arena::alignment, Scanner::memory_required(config), start, space);
  AssemblerStatus status = AssemblerStatus::ok;
  Scanner* const scanner =
      Scanner::create({static_cast<std::byte*>(start), space}, config,
                      {.can = &simulated_rig.can_port(),
                       .lasers = {&simulated_rig.byte_port(0), &simulated_rig.byte_port(1)}},
                      scans, notices, status);
  REQUIRE(scanner != nullptr);
  scanner->start();
  const std::int64_t begin_ns = simulated_rig.now_ns();
  for (int second = 1; second <= 60 && (scans.complete < 3 || scanner->gps().counters().fixes == 0); ++second)
    simulated_rig.advance_to(begin_ns + second * ns_per_s, *scanner);
  INFO(to_string(scanner->phase()) << ": " << scanner->reason() << ", " << scans.count << " scans");
  CHECK(scans.complete >= 3);
  CHECK(scanner->encoder().is_speed_in_tolerance());
  CHECK(scanner->encoder().counters().index_relocks == 0);
  CHECK(scanner->gps().counters().fixes > 0);
}
