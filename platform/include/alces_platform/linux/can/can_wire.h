// CAN frames as SocketCAN carries them (linux/can.h: struct can_frame, 16 bytes; struct canfd_frame, 72
// bytes) and as Alces does, and what the kernel's error frames say (linux/can/error.h). Pure: no socket here.
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <optional>
#include <span>

#include "alces_drivers/can_frame.h"

namespace alces {

/// One datagram of a CAN_RAW socket. Nothing: it has the size of neither struct, or states more data than it
/// can hold.
[[nodiscard]] std::optional<CanFrame> from_wire(std::span<const std::uint8_t> datagram);

/// Fills `wire` and returns how many of its bytes are the datagram (CAN_MTU, CANFD_MTU). 0: no such frame can
/// be sent (too long, an identifier that does not fit, an FD length that does not exist, remote FD, an error
/// frame).
[[nodiscard]] std::size_t to_wire(const CanFrame& frame, canfd_frame& wire);

/// An error frame in words. Several may be true at once.
struct CanErrorReport {
  bool is_bus_off = false;
  bool is_restarted = false;        ///< the controller came back from bus-off
  bool is_error_active = false;     ///< recovered to error-active
  bool is_error_warning = false;    ///< an error counter passed 96
  bool is_error_passive = false;    ///< an error counter passed 127
  bool has_lost_received = false;   ///< the controller's receive buffer overflowed
  bool has_lost_sent = false;       ///< its transmit buffer did, or sending timed out
  bool has_no_acknowledge = false;  ///< nobody acknowledged a frame of ours
  bool is_bus_error = false;        ///< bit, stuff, form or CRC error on the wire
  bool has_lost_arbitration = false;
  bool is_transceiver_fault = false;  ///< a wire broken or shorted
  std::optional<std::uint8_t>
      transmit_error_count;  ///< the controller's error counters, where the driver tells
  std::optional<std::uint8_t> receive_error_count;
};

/// Of a frame with is_error. Short ones (size < 8) are read as if the rest were 0.
[[nodiscard]] CanErrorReport read_error_frame(const CanFrame& frame);

}  // namespace alces
