// The numbers that CANopen nodes complain with, in words: SDO abort codes (CiA 301, table "SDO abort codes"),
// emergency error codes (CiA 301, table "emergency error codes", with the drives' ones of CiA 402 / IEC
// 61800-7-201, annex "error codes") and the bits of the error register (0x1001).
#pragma once

#include <cstdint>

namespace alces::canopen {

/// Why a node refused an SDO transfer. Codes that CiA 301 does not list: "unknown abort code".
[[nodiscard]] const char* sdo_abort_text(std::uint32_t code);

/// What an EMCY frame reports; 0x0000 is the all-clear. A code that is not listed gets the text of the
/// narrowest class it belongs to (0x2313 that of 0x2310, 0x31FF that of 0x3100): manufacturers number within
/// the classes.
[[nodiscard]] const char* emcy_text(std::uint16_t code);

/// True when emcy_text() answers for this very code and not for its class.
[[nodiscard]] bool is_listed_emcy(std::uint16_t code);

/// Bit 0..7 of the error register.
[[nodiscard]] const char* error_register_bit_text(unsigned bit);

}  // namespace alces::canopen
