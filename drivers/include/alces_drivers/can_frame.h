// One frame on a CAN bus: classical, remote, FD, or the kernel's error frame (SocketCAN's linux/can.h: what
// candump shows). Drivers use classical data frames; the others are carried so that a recording loses
// nothing.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace alces {

struct CanFrame {
  static constexpr std::uint8_t maximum_bytes = 64;  ///< of FD; 8 in a classical frame

  std::uint32_t id = 0;   ///< 11 or 29 bits, no flags; of an error frame: the error class bits (CAN_ERR_...)
  std::uint8_t size = 0;  ///< bytes of data; of a remote frame: the length asked for
  bool is_extended = false;  ///< 29-bit identifier
  bool is_remote = false;
  bool is_error = false;
  bool is_fd = false;
  bool is_bit_rate_switched = false;      ///< FD's BRS
  bool is_error_state_indicated = false;  ///< FD's ESI
  std::array<std::uint8_t, maximum_bytes> data{};

  [[nodiscard]] std::span<const std::uint8_t> bytes() const {
    return {data.data(), is_remote ? std::size_t{0} : size};
  }
  /// A data frame with an 11-bit identifier and at most 8 bytes: all that CANopen uses.
  [[nodiscard]] bool is_classical_data() const {
    return !is_extended && !is_remote && !is_error && !is_fd && size <= 8;
  }

  friend bool operator==(const CanFrame&, const CanFrame&) = default;
};

}  // namespace alces
