// Emergency messages: a node says that an error came or went. CiA 301 version 4.2, 7.2.7 and table 26; the
// finer codes of drives: CiA 402 (IEC 61800-7-201), error codes, which object 0x603F shows too.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "alces_drivers/can_frame.h"

namespace alces::canopen {

struct Emcy {
  std::uint8_t node = 0;
  std::uint16_t code = 0;           ///< 0: the error, or all errors, went
  std::uint8_t error_register = 0;  ///< object 0x1001
  std::array<std::uint8_t, 5> manufacturer{};

  [[nodiscard]] bool is_reset() const { return (code & 0xFF00) == 0; }
};

/// Nothing: not the COB-ID of an EMCY, or not 8 bytes.
[[nodiscard]] std::optional<Emcy> decode_emcy(const CanFrame& frame);
[[nodiscard]] CanFrame emcy_frame(const Emcy& emcy);

/// The code's meaning, or that of its class when only the class is known; never null, static storage.
[[nodiscard]] const char* emcy_text(std::uint16_t code);

inline constexpr std::uint8_t error_register_bits = 8;
/// Bit 0 to 7 of the error register.
[[nodiscard]] const char* error_register_text(std::uint8_t bit);

}  // namespace alces::canopen
