// A number inside a CAN frame, as a DBC file describes it (Vector, "DBC File Format Documentation"):
//   SG_ ... start|length@order sign (factor,offset) [minimum|maximum]
//
// Bits are numbered the same way for both byte orders: bit b is the one of weight 2^(b % 8) in byte b / 8.
//   intel    (@1)  start_bit is the signal's least significant bit; the next ones have the numbers above it.
//   motorola (@0)  start_bit is its MOST significant bit; the next ones lie below it in the byte and go on
//                  at the most significant bit of the byte that follows (7|16 is a big-endian number in
//                  bytes 0 and 1).
// value = raw * factor + offset. Multiplexed signals are not known here.
//
// Cost: O(bytes that the signal touches), no memory.
#pragma once

#include <cstdint>
#include <span>

#include "alces_drivers/can_frame.h"

namespace alces {

enum class ByteOrder : std::uint8_t { intel, motorola };

/// What the bits are. float_ieee (SIG_VALTYPE_ 1 and 2): length 32 or 64.
enum class RawType : std::uint8_t { unsigned_integer, signed_integer, float_ieee };

struct CanSignal {
  std::uint16_t start_bit = 0;
  std::uint8_t length = 0;  ///< bits, 1 to 64; 0: there is no such signal
  ByteOrder order = ByteOrder::intel;
  RawType type = RawType::unsigned_integer;
  double factor = 1;  ///< may bring the unit to SI: 1/3.6 for km/h
  double offset = 0;
  double minimum = 0;  ///< of the value; DBC's [0|0], or any empty range, means: no limits
  double maximum = 0;

  [[nodiscard]] bool has_limits() const { return minimum < maximum; }
};

enum class SignalStatus : std::uint8_t {
  ok,
  bad_signal,       ///< the description is impossible: see is_valid()
  frame_too_short,  ///< the frame has fewer bytes than the signal needs
  out_of_limits,    ///< outside [minimum|maximum], or no finite number
  does_not_fit,     ///< insert only: the raw number needs more bits than there are
};
[[nodiscard]] const char* to_string(SignalStatus status);

struct SignalValue {
  SignalStatus status = SignalStatus::bad_signal;
  double value = 0;  ///< only when ok, and then finite; integers beyond 2^53 are rounded to a double
};

/// Length 1 to 64 (float: 32 or 64), inside an FD frame's 64 bytes, factor finite and not 0, offset finite.
[[nodiscard]] bool is_valid(const CanSignal& signal);

/// How many bytes a frame must have to hold the signal.
[[nodiscard]] std::uint32_t bytes_needed(const CanSignal& signal);

/// The signal's bits in the low bits of a word. The frame must be long enough and the signal valid.
[[nodiscard]] std::uint64_t extract_bits(const CanSignal& signal, std::span<const std::uint8_t> bytes);
/// Writes them; the frame's other bits stay.
void insert_bits(const CanSignal& signal, std::uint64_t bits, std::span<std::uint8_t> bytes);

/// The signal's value in these bytes.
[[nodiscard]] SignalValue extract(const CanSignal& signal, std::span<const std::uint8_t> bytes);

/// Writes a value, rounded to the nearest raw number. When the answer is not ok, nothing was written.
[[nodiscard]] SignalStatus insert(const CanSignal& signal, double value, std::span<std::uint8_t> bytes);

/// A signal and the message that carries it.
struct CanSignalSource {
  std::uint32_t id = 0;
  bool is_extended = false;
  CanSignal signal;  ///< length 0: the vehicle has no such signal

  [[nodiscard]] bool exists() const { return signal.length != 0; }
  /// A data frame (classical or FD) with this identifier.
  [[nodiscard]] bool is_in(const CanFrame& frame) const {
    return exists() && frame.id == id && frame.is_extended == is_extended && !frame.is_remote &&
           !frame.is_error;
  }
};

}  // namespace alces
