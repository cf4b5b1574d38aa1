// The motor of a simulated drive: CiA 402's state machine (figure "state machine", transitions 0 to 16),
// profile velocity mode with ramps, halt, quick stop and fault reaction by their option codes, and the shaft
// that all of it moves. Parameters are read from the object dictionary whenever they count:
//   0x605A..0x605E option codes, 0x6060 mode, 0x607F fastest speed, 0x6083/0x6084 ramps, 0x6085 quick stop,
//   0x60FF target.
#pragma once

#include <cstdint>
#include <optional>

#include "alces_platform/sim/motor/object_dictionary.h"
#include "alces_platform/sim/motor/shaft_motion.h"

namespace alces::sim {

enum class Cia402State : std::uint8_t {
  not_ready_to_switch_on,
  switch_on_disabled,
  ready_to_switch_on,
  switched_on,
  operation_enabled,
  quick_stop_active,
  fault_reaction_active,
  fault,
};
[[nodiscard]] const char* to_string(Cia402State state);

struct Cia402AxisConfig {
  double counts_per_turn = 65536;              ///< of the motor's shaft, in 0x6064
  double rpm_per_velocity_unit = 1;            ///< of 0x60FF, 0x606C, 0x607F
  double rpm_per_s_per_acceleration_unit = 1;  ///< of 0x6083, 0x6084, 0x6085
  double fastest_rpm_per_s = 50'000;      ///< what the motor can; also the meaning of an acceleration of 0
  double coasting_rpm_per_s = 500;        ///< friction, when no current flows
  std::int32_t position_at_power_on = 0;  ///< what 0x6064 begins with
  bool keeps_position = false;            ///< an absolute encoder: 0x6064 goes on after a reset
};

class Cia402Axis {
 public:
  enum class CommandResult : std::uint8_t { done, fault_reset, fault_reset_refused };

  Cia402Axis(const Cia402AxisConfig& config, ObjectDictionary& objects)
      : config_(config), objects_(&objects) {}

  /// No current, the shaft coasts; not ready to switch on.
  void power_off(std::int64_t now_ns);
  /// Self-test passed: transition 1.
  void become_ready(std::int64_t now_ns);

  /// Transitions 2 to 12, 15 and 16. Bits 0..3 and 7 are the command, bit 8 is halt.
  CommandResult command(std::uint16_t controlword, std::int64_t now_ns);
  /// A parameter, the mode or the target was written.
  void replan(std::int64_t now_ns);
  /// Transition 13, and 14 when the fault reaction has ended.
  void raise_fault(std::int64_t now_ns, bool is_clearable);
  /// A fault that was for ever can be reset from now on.
  void remove_cause() { is_clearable_ = true; }
  /// Something holds the shaft, whatever is commanded.
  void set_stalled(bool is_stalled, std::int64_t now_ns);

  /// When a ramp ends at which the state changes; INT64_MAX: none.
  [[nodiscard]] std::int64_t next_event_ns() const;
  void advance(std::int64_t now_ns);

  [[nodiscard]] Cia402State state() const { return state_; }
  [[nodiscard]] std::uint16_t statusword(std::int64_t now_ns) const;
  /// Measured values into the dictionary: 0x6041, 0x6061..0x6064, 0x606B, 0x606C.
  void refresh(std::int64_t now_ns);

  /// The truth: continuous, not wrapped, not reset; 0 at the beginning.
  [[nodiscard]] double shaft_counts_at(std::int64_t at_ns) const { return motion_.position_counts(at_ns); }
  [[nodiscard]] double shaft_counts_per_s_at(std::int64_t at_ns) const {
    return motion_.speed_counts_per_s(at_ns);
  }

 private:
  enum class Braking : std::uint8_t { coast, slow_ramp, quick_ramp, fastest };
  struct Demand {
    double speed = 0;
    double acceleration = 0;
    double deceleration = 0;
    bool is_limited = false;
    friend bool operator==(const Demand&, const Demand&) = default;
  };

  [[nodiscard]] static Braking braking(std::int64_t option_code);
  [[nodiscard]] double rate_counts(std::uint16_t index) const;
  [[nodiscard]] double rate_counts(Braking braking) const;
  [[nodiscard]] double speed_counts(double velocity_units) const;
  [[nodiscard]] Demand demand() const;
  void enter(Cia402State state, std::int64_t now_ns);
  /// Brakes by the option code; `after` follows at standstill, none: the state stays.
  void brake(Braking braking, std::optional<Cia402State> after, std::int64_t now_ns);
  void quick_stop(std::int64_t now_ns);
  void disable(std::uint16_t option_index, Cia402State after, std::int64_t now_ns);

  Cia402AxisConfig config_;
  ObjectDictionary* objects_;
  ShaftMotion motion_;
  Demand demand_;
  Cia402State state_ = Cia402State::not_ready_to_switch_on;
  std::optional<Cia402State> after_standstill_;
  Braking braking_ = Braking::coast;
  std::uint16_t controlword_ = 0;
  double zero_counts_ = 0;  ///< where the shaft was when 0x6064 was position_at_power_on
  bool is_clearable_ = true;
  bool is_stalled_ = false;
};

}  // namespace alces::sim
