// Where a driver's bytes go: a serial line or a TCP connection.
#pragma once

#include <cstdint>
#include <span>

namespace alces {

class BytePort {
 public:
  /// Queues all of the bytes or none; does not block. False: not taken (line gone, buffer full).
  [[nodiscard]] virtual bool write(std::span<const std::uint8_t> bytes) = 0;

  /// The line's rate from the next byte on, after what is queued has left. False: the line cannot (TCP:
  /// always true).
  [[nodiscard]] virtual bool set_baud_rate(std::uint32_t baud) = 0;

  /// The peer sends nothing that makes sense: a connection is ended, and begun anew after a pause. A line
  /// cannot.
  virtual void drop() {}

 protected:
  ~BytePort() = default;
};

}  // namespace alces
