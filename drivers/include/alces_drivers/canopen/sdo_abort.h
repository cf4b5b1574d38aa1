// Why a service data transfer was given up: the abort codes of CiA 301 version 4.2, table 22.
#pragma once

#include <cstdint>

namespace alces::canopen {

inline constexpr std::uint32_t sdo_abort_toggle = 0x05030000;
inline constexpr std::uint32_t sdo_abort_timed_out = 0x05040000;
inline constexpr std::uint32_t sdo_abort_out_of_memory = 0x05040005;
inline constexpr std::uint32_t sdo_abort_size_mismatch = 0x06070010;
inline constexpr std::uint32_t sdo_abort_no_object = 0x06020000;
inline constexpr std::uint32_t sdo_abort_no_subindex = 0x06090011;
inline constexpr std::uint32_t sdo_abort_general = 0x08000000;

/// Never null; static storage. A code that is not in the table says so.
[[nodiscard]] const char* sdo_abort_text(std::uint32_t abort_code);

}  // namespace alces::canopen
