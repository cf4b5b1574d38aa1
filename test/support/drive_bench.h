// A motor driver and a simulated drive, joined by a cable that can be cut, in steps of one millisecond: what
// the shaft does is the truth, whatever the driver says.
#pragma once

#include <cmath>
#include <memory>
#include <utility>

#include "alces_drivers/motor/motor.h"
#include "alces_platform/settings/vehicle_settings.h"
#include "alces_platform/sim/motor/simulated_cia402_drive.h"
#include "support/fake_node.h"
#include "support/motor_bench.h"

namespace alces::test {

struct DriveBench {
  using Drive = sim::SimulatedCia402Drive;

  explicit DriveBench(const MotorConfig& motor_config = settings::default_vehicle_settings().scanner.motor,
                      const Drive::Config& drive_config = {.motor_turns_per_head_turn = 60})
      : config(motor_config), drive(drive_config) {
    drive.power_on(0);
    begin_program();
  }

  /// alcesd starts, or starts anew after kill -9: a motor that knows nothing.
  void begin_program() { motor = std::make_unique<Motor>(config, port, notices, feedback); }
  void kill_program() { motor.reset(); }

  void step() {
    now_ns += ns_per_ms;
    CanFrame frame;
    while (drive.poll(now_ns, frame)) {
      if (motor && !is_cable_cut) motor->on_frame(frame, now_ns);
    }
    // Ticks of the event loop.
    if (motor && now_ns / ns_per_ms % 10 == 0) motor->on_tick(now_ns);
    for (const CanFrame& sent : std::exchange(port.sent, {})) {
      if (!is_cable_cut) drive.on_frame(sent, now_ns);
    }
  }
  void run_ms(std::int64_t ms) {
    for (std::int64_t i = 0; i < ms; ++i) step();
  }
  bool run_until(MotorState state, std::int64_t limit_ms = 30000) {
    for (std::int64_t i = 0; i < limit_ms && motor->state() != state; ++i) step();
    return motor->state() == state;
  }
  bool spin_up() {
    motor->start(now_ns);
    return run_until(MotorState::running);
  }
  /// Until it says something; how long that took.
  std::int64_t stop_ms(bool is_quick = false) {
    const std::int64_t begin_ns = now_ns;
    if (is_quick) {
      motor->quick_stop(now_ns);
    } else {
      motor->stop(now_ns);
    }
    while (!motor->has_ended() && now_ns - begin_ns < Motor::stop_limit_ns(config) + ns_per_s) step();
    return (now_ns - begin_ns) / ns_per_ms;
  }

  // The truth.
  [[nodiscard]] double turns_per_s() const { return std::abs(drive.head_turns_per_s_at(now_ns)); }
  [[nodiscard]] bool has_torque() const {
    using enum sim::Cia402State;
    return drive.state() == operation_enabled || drive.state() == quick_stop_active ||
           drive.state() == fault_reaction_active || drive.state() == switched_on;
  }
  [[nodiscard]] bool is_shaft_free() const { return turns_per_s() == 0 && !has_torque(); }

  MotorConfig config;
  FakeCanPort port;
  NoticeLog notices;
  FeedbackLog feedback;
  Drive drive;
  std::unique_ptr<Motor> motor;
  std::int64_t now_ns = 0;
  bool is_cable_cut = false;
};

}  // namespace alces::test
