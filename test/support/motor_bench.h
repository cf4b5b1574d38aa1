// A motor driver, a bus with faults and a fake drive, in steps of one millisecond.
#pragma once

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "alces_drivers/motor/motor.h"
#include "support/fake_node.h"

namespace alces::test {

struct FeedbackLog final : DriveFeedbackSink {
  std::vector<DriveFeedback> feedback;

  void on_drive_feedback(const DriveFeedback& one) override { feedback.push_back(one); }
};

/// A drive with statusword and position in TPDO 1, velocity in TPDO 2, both on every SYNC.
inline MotorConfig motor_config() {
  MotorConfig config;
  config.checks = {{0x1000, 0, 0xFFFF, 0x0192}};
  config.writes = {{0x6083, 0, 4, 5000}, {0x6084, 0, 4, 5000}, {0x6085, 0, 4, 20000}};
  canopen::PdoConfig position;
  position.number = 1;
  position.forbids_remote_frames = true;
  position.entries = {{0x6041, 0, 16}, {0x6064, 0, 32}};
  canopen::PdoConfig velocity = position;
  velocity.number = 2;
  velocity.entries = {{0x606C, 0, 32}};
  canopen::PdoConfig control;
  control.number = 1;
  control.entries = {{0x6040, 0, 16}, {0x60FF, 0, 32}};
  config.tpdos = {position, velocity};
  config.rpdos = {control};
  config.target_velocity_units = 4000;
  config.velocity_tolerance_units = 200;
  config.stall_velocity_units = 20;
  config.boot_timeout_ns = 1 * ns_per_s;
  config.sdo = {.response_timeout_ns = 50 * ns_per_ms, .retry_limit = 1};
  config.transition_timeout_ns = 500 * ns_per_ms;
  config.attempt_limit = 3;
  config.back_off = {.first_ns = 100 * ns_per_ms, .maximum_ns = 400 * ns_per_ms};
  config.spin_up_timeout_ns = 3 * ns_per_s;
  config.stop_timeout_ns = 2 * ns_per_s;
  return config;
}

struct MotorBench {
  explicit MotorBench(const MotorConfig& motor_config)
      : config(motor_config), motor(config, port, notices, feedback) {}
  MotorBench() : MotorBench(motor_config()) {}

  MotorConfig config;
  FakeCanPort port;
  NoticeLog notices;
  FeedbackLog feedback;
  FakeNode node{1};
  Motor motor;
  std::int64_t now_ns = 0;
  std::vector<CanFrame> from_motor;  ///< all that it sent
  std::vector<MotorState> states;    ///< it went through
  std::vector<CanFrame> orders;      ///< NMT
  /// What the bus makes of a frame of the node; the frames that come now. Without it: that frame.
  std::function<std::vector<CanFrame>(const CanFrame&, std::int64_t)> bus;

  void step() {
    now_ns += ns_per_ms;
    node.tick(now_ns);
    auto from_node = std::exchange(node.out, {});
    for (const CanFrame& frame : from_node) {
      const auto arriving = bus ? bus(frame, now_ns) : std::vector<CanFrame>{frame};
      for (const CanFrame& one : arriving) {
        stamp_ns = std::max(stamp_ns + ns_per_us, now_ns);
        motor.on_frame(one, stamp_ns);
      }
    }
    motor.on_tick(now_ns);
    note_state();
    for (const CanFrame& frame : std::exchange(port.sent, {})) {
      from_motor.push_back(frame);
      if (frame.id == 0) orders.push_back(frame);
      if (is_wire_whole) node.on_frame(frame, now_ns);
    }
  }
  void note_state() {
    if (states.empty() || states.back() != motor.state()) states.push_back(motor.state());
  }
  void run_ms(std::int64_t ms) {
    for (std::int64_t step_number = 0; step_number < ms; ++step_number) step();
  }
  /// False: not within the time.
  bool run_until(MotorState state, std::int64_t limit_ms = 20000) {
    for (std::int64_t ms = 0; ms < limit_ms; ++ms) {
      if (motor.state() == state) return true;
      step();
    }
    return motor.state() == state;
  }
  /// Starts and comes to speed.
  bool spin_up() {
    motor.start(now_ns);
    note_state();
    return run_until(MotorState::running);
  }

  bool is_wire_whole = true;
  std::int64_t stamp_ns = 0;
};

}  // namespace alces::test
