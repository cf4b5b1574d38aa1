// What enters from the world, with the time it happened: the one stream that drivers are fed from, live,
// replayed or simulated, and that a recording keeps. The order of events is the order in which they were
// handed on; their stamps may run slightly against it (a CAN frame's stamp is the kernel's).
#pragma once

#include <cstdint>
#include <span>

#include "alces_drivers/can_frame.h"
#include "alces_drivers/encoder/edge.h"

namespace alces {

enum class EventKind : std::uint8_t {
  tick,        ///< time passes; nothing else happened
  can_frame,   ///< received on CAN bus `channel`
  can_sent,    ///< we sent it; recorded, ignored by drivers
  can_link,    ///< the bus came up or went down (interface down, bus-off): is_up
  edge,        ///< on a GPIO line
  edges_lost,  ///< the kernel's buffer overflowed: `lost_count` edges are missing (0: not known how many)
  bytes,       ///< received on byte channel `channel` (laser a, laser b, gps)
  bytes_sent,  ///< we sent them; recorded, ignored by drivers
  byte_link,   ///< a serial line or connection came up or went down: is_up
  stop,        ///< the scanner is to stop, in order: an event, so that a replay stops where the drive did
  order,       ///< a person, or the machine, about the motor: `order`, and is_up for a permit
  sync_sent,   ///< a SYNC of ours left on CAN bus `channel`: the stamp is that of its echo
};

enum class MotorOrder : std::uint8_t {
  permit,   ///< a message of the permit's socket: is_up gives it, otherwise it is withdrawn
  reset,    ///< a person lets a motor that was given up begin anew
  resumed,  ///< the machine was suspended, and goes on
};

/// Byte channels.
inline constexpr std::uint8_t laser_a_channel = 0;
inline constexpr std::uint8_t laser_b_channel = 1;
inline constexpr std::uint8_t gps_channel = 2;
inline constexpr std::uint8_t byte_channel_count = 3;

struct Event {
  std::int64_t stamp_ns = 0;
  EventKind kind = EventKind::tick;
  std::uint8_t channel = 0;
  bool is_up = false;
  MotorOrder order = MotorOrder::permit;
  std::uint32_t lost_count = 0;
  GpioEdge edge;
  CanFrame frame;
  std::span<const std::uint8_t> bytes;  ///< the caller's, valid during the call
};

class EventSink {
 public:
  virtual void on_event(const Event& event) = 0;

 protected:
  ~EventSink() = default;
};

}  // namespace alces
