// The power drive system's state machine: what a drive's statusword says and which controlword brings it on.
// CiA 402-2 (IEC 61800-7-201), objects 0x6040 and 0x6041, transitions 0 to 16.
#pragma once

#include <cstdint>

#include "alces_drivers/canopen/object.h"

namespace alces::cia402 {

inline constexpr std::uint16_t abort_connection_option_index = 0x6007;
inline constexpr std::uint16_t error_code_index = 0x603F;
inline constexpr std::uint16_t controlword_index = 0x6040;
inline constexpr std::uint16_t statusword_index = 0x6041;
inline constexpr std::uint16_t quick_stop_option_index = 0x605A;
inline constexpr std::uint16_t mode_index = 0x6060;
inline constexpr std::uint16_t mode_display_index = 0x6061;
inline constexpr std::uint16_t position_index = 0x6064;
inline constexpr std::uint16_t velocity_index = 0x606C;
inline constexpr std::uint16_t target_velocity_index = 0x60FF;
inline constexpr std::uint16_t supported_modes_index = 0x6502;

inline constexpr std::uint8_t profile_velocity_mode = 3;

enum class State : std::uint8_t {
  unknown,  ///< no statusword yet, or a pattern that CiA 402 does not know
  not_ready_to_switch_on,
  switch_on_disabled,
  ready_to_switch_on,
  switched_on,
  operation_enabled,
  quick_stop_active,
  fault_reaction_active,
  fault,
};
[[nodiscard]] const char* to_string(State state);

[[nodiscard]] State state_of(std::uint16_t statusword);

/// The power stage is off, and stays off until a controlword asks for more: what a drive that is to count as
/// stopped must say of itself.
[[nodiscard]] constexpr bool has_no_torque(State state) {
  return state == State::switch_on_disabled || state == State::ready_to_switch_on || state == State::fault;
}

/// Bits of the statusword beside the state.
inline constexpr std::uint16_t statusword_voltage_enabled = 0x0010;
inline constexpr std::uint16_t statusword_warning = 0x0080;
inline constexpr std::uint16_t statusword_remote =
    0x0200;  ///< clear: the drive does not obey the controlword
inline constexpr std::uint16_t statusword_target_reached = 0x0400;
inline constexpr std::uint16_t statusword_internal_limit = 0x0800;

namespace controlword {
inline constexpr std::uint16_t disable_voltage = 0x0000;
inline constexpr std::uint16_t quick_stop = 0x0002;
inline constexpr std::uint16_t shutdown = 0x0006;
inline constexpr std::uint16_t switch_on = 0x0007;  ///< from operation enabled: disable operation
inline constexpr std::uint16_t enable_operation = 0x000F;
inline constexpr std::uint16_t fault_reset = 0x0080;  ///< its rising edge counts
}  // namespace controlword

/// The controlword for the next transition on the way to `target`, one of switch_on_disabled,
/// ready_to_switch_on, switched_on, operation_enabled and quick_stop_active. States that a drive leaves by
/// itself get disable_voltage; so does a fault, which takes a rising edge of fault_reset (the caller's,
/// because it takes two frames). Out of a quick stop the way leads through switch_on_disabled, which every
/// drive can (transition 16 is optional).
[[nodiscard]] std::uint16_t controlword_towards(State target, State now);

}  // namespace alces::cia402
