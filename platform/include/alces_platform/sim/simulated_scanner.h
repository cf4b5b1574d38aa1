// All of the simulated vehicle: the rig with its wires (simulated_rig.h), a CiA 402 drive that turns the head
// through a gear, and one or two SICK LMS 291. The host's side is the rig's: can_port(), byte_port(),
// advance_to(), inject().
//
//   drive  node 1 like a TMCM-1636: 65536 counts a turn of the motor, velocities in rpm, gear 60
//   laser  switched on at 9600 baud, 180 deg, 1 deg; streams 75 sweeps a second once it was told to, at
//   500,000 baud
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "alces_platform/sim/motor/can_bus.h"
#include "alces_platform/sim/motor/head_motor.h"
#include "alces_platform/sim/motor/simulated_cia402_drive.h"
#include "alces_platform/sim/sensors/serial_line.h"
#include "alces_platform/sim/sensors/simulated_lms2xx.h"
#include "alces_platform/sim/simulated_rig.h"

namespace alces::sim {

struct SimulatedScannerSettings {
  RigSettings rig;
  SimulatedCia402Drive::Config drive{.motor_turns_per_head_turn = 60};
  double first_head_angle_rad = 1;  ///< where the head stands at power-on
  std::array<SimulatedLms2xxSettings, RigGeometry::maximum_lasers> lasers{};
  /// What each laser measures; null: the town, which costs rays. The caller's, as long as the scanner.
  std::array<SweepSource*, RigGeometry::maximum_lasers> sweeps{};
};

class SimulatedScanner {
 public:
  explicit SimulatedScanner(const SimulatedScannerSettings& settings);
  /// In a town that is there already: see SimulatedRig.
  SimulatedScanner(const SimulatedScannerSettings& settings, std::shared_ptr<const Town> town);
  SimulatedScanner(const SimulatedScanner&) = delete;
  SimulatedScanner& operator=(const SimulatedScanner&) = delete;
  ~SimulatedScanner() = default;

  [[nodiscard]] SimulatedRig& rig() { return rig_; }
  [[nodiscard]] const SimulatedRig& rig() const { return rig_; }
  [[nodiscard]] SimulatedCia402Drive& drive() { return drive_node_.drive; }
  [[nodiscard]] SimulatedLms2xx& laser(std::uint8_t number) { return lasers_.at(number)->laser; }

 private:
  /// The drive as a node on the rig's bus, and as what turns the rig's head.
  class DriveNode final : public CanNode, public HeadMotor {
   public:
    DriveNode(const SimulatedScannerSettings& settings);
    [[nodiscard]] std::uint8_t node_id() const override { return node_; }
    void on_frame(const CanFrame& frame, std::int64_t now_ns) override { drive.on_frame(frame, now_ns); }
    void poll(std::int64_t now_ns, std::vector<CanFrame>& frames) override;
    void on_fault(const Injection& injection) override;
    [[nodiscard]] double angle_rad(std::int64_t now_ns) override;
    [[nodiscard]] double velocity_rad_per_s(std::int64_t now_ns) override;

    SimulatedCia402Drive drive;

   private:
    std::uint8_t node_;
    double first_angle_rad_;
    std::int64_t sdo_abort_until_ns_ = INT64_MIN;
    std::uint32_t sdo_abort_code_ = 0;
  };
  class LaserLine final : public SerialDevice {
   public:
    LaserLine(const SimulatedLms2xxSettings& settings, SweepSource& sweeps) : laser(settings, sweeps) {}
    void on_bytes(std::span<const std::uint8_t> bytes, std::int64_t now_ns) override {
      laser.on_bytes(bytes, now_ns);
    }
    void poll(std::int64_t now_ns, SerialOutput& output) override;
    [[nodiscard]] std::uint32_t baud_rate() const override { return laser.baud(); }
    void on_fault(const Injection& injection) override;

    SimulatedLms2xx laser;
  };

  void attach(const SimulatedScannerSettings& settings);

  SimulatedRig rig_;
  DriveNode drive_node_;
  std::array<std::optional<LaserLine>, RigGeometry::maximum_lasers> lasers_;
};

}  // namespace alces::sim
