// Where a driver's CAN frames go: a socket, a simulated bus, or nowhere (replay).
#pragma once

#include "alces_drivers/can_frame.h"

namespace alces {

class CanPort {
 public:
  /// Queues one frame; does not block. False: it was not taken (queue full, bus off, interface down); the
  /// driver tries again on a later tick.
  [[nodiscard]] virtual bool send(const CanFrame& frame) = 0;

 protected:
  ~CanPort() = default;
};

}  // namespace alces
