#include "alces_platform/sim/simulated_scanner.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace alces::sim {

SimulatedScanner::SimulatedScanner(const SimulatedScannerSettings& settings)
    : rig_(settings.rig), drive_node_(settings) {
  attach(settings);
}

SimulatedScanner::SimulatedScanner(const SimulatedScannerSettings& settings, std::shared_ptr<const Town> town)
    : rig_(settings.rig, std::move(town)), drive_node_(settings) {
  attach(settings);
}

void SimulatedScanner::attach(const SimulatedScannerSettings& settings) {
  rig_.attach(static_cast<CanNode&>(drive_node_));
  rig_.attach(static_cast<HeadMotor&>(drive_node_));
  for (std::uint8_t number = 0; number < settings.rig.lasers; ++number) {
    // The mirrors of two lasers do not turn in step.
    SimulatedLms2xxSettings laser = settings.lasers.at(number);
    laser.first_ray_stamp_ns = settings.rig.motion.start_stamp_ns + 3'100'000 + 5'700'000 * number;
    SweepSource* const sweeps = settings.sweeps.at(number);
    lasers_.at(number).emplace(laser, sweeps != nullptr ? *sweeps : rig_.sweeps(number));
    rig_.attach(number, *lasers_.at(number));
  }
}

SimulatedScanner::DriveNode::DriveNode(const SimulatedScannerSettings& settings)
    : drive(settings.drive),
      node_(settings.drive.slave.node),
      first_angle_rad_(settings.first_head_angle_rad) {
  drive.power_on(settings.rig.motion.start_stamp_ns);
}

void SimulatedScanner::DriveNode::poll(std::int64_t now_ns, std::vector<CanFrame>& frames) {
  drive.abort_every_sdo(now_ns < sdo_abort_until_ns_ ? sdo_abort_code_ : 0);
  CanFrame frame;
  while (drive.poll(now_ns, frame)) frames.push_back(frame);
}

void SimulatedScanner::DriveNode::on_fault(const Injection& injection) {
  switch (injection.fault) {
    case Fault::late_boot_up:
      drive.power_off(injection.at_ns);
      drive.set_boot_ns(injection.duration_ns);
      drive.power_on(injection.at_ns);
      break;
    case Fault::node_reset:
      drive.reset(injection.at_ns);
      break;
    case Fault::sdo_abort:
      sdo_abort_until_ns_ = injection.at_ns + injection.duration_ns;
      sdo_abort_code_ = static_cast<std::uint32_t>(argument_or(injection, 0x08000000));
      break;
    case Fault::drive_fault_once:
      drive.raise_fault(static_cast<std::uint16_t>(argument_or(injection, 0x3210)), injection.at_ns);
      break;
    case Fault::drive_fault_for_ever:
      drive.raise_fault(static_cast<std::uint16_t>(argument_or(injection, 0x3210)), injection.at_ns,
                        SimulatedCia402Drive::Clearing::never);
      break;
    default:
      break;  // happens on the wire
  }
}

double SimulatedScanner::DriveNode::angle_rad(std::int64_t now_ns) {
  return first_angle_rad_ + 2 * std::numbers::pi * drive.head_turns_at(now_ns);
}

double SimulatedScanner::DriveNode::velocity_rad_per_s(std::int64_t now_ns) {
  return 2 * std::numbers::pi * drive.head_turns_per_s_at(now_ns);
}

void SimulatedScanner::LaserLine::poll(std::int64_t now_ns, SerialOutput& output) {
  while (const std::optional<SimulatedLms2xx::Chunk> chunk = laser.poll(now_ns)) {
    const double wire_ns = 1e10 / chunk->baud * static_cast<double>(chunk->bytes.size());
    output.write(chunk->bytes, chunk->stamp_ns - std::llround(wire_ns), chunk->baud);
  }
}

void SimulatedScanner::LaserLine::on_fault(const Injection& injection) {
  switch (injection.fault) {
    case Fault::laser_wrong_baud:
      laser.switch_off();
      laser.switch_on(injection.at_ns, static_cast<std::uint32_t>(number_or(injection, 9600)));
      break;
    case Fault::laser_reset:
      laser.switch_off();
      laser.switch_on(injection.at_ns);
      break;
    default:
      break;  // happens on the wire
  }
}

}  // namespace alces::sim
