// The state of one CAN bus, from what comes in: data frames, the kernel's error frames, the interface's
// flags. Turns them into events and notices; a state machine without a socket, so that it can be tested and
// replayed.
//
//   down           the interface is absent, or not up: `ip link set can0 up type can bitrate 1000000`
//   bus_off        the controller has left the bus after too many errors. It comes back by itself if the
//                  interface has a restart-ms, otherwise by `ip link set can0 type can restart`
//   error_passive, error_warning, error_active   it takes part
//
// A can_link event is delivered when the bus goes from the first two states to the others (is_up) or back.
// Every frame, error frames included, is delivered as a can_frame event before what it means.
#pragma once

#include <cstdint>

#include "alces_drivers/can_frame.h"
#include "alces_drivers/scanner/event.h"
#include "alces_platform/linux/event_loop.h"
#include "alces_platform/linux/retry_delay.h"

namespace alces {

enum class CanBusState : std::uint8_t { down, bus_off, error_passive, error_warning, error_active };
[[nodiscard]] const char* to_string(CanBusState state);

class CanBus {
 public:
  /// After the frame that says "bus off" the interface's flags still look well for a while (linkwatch); only
  /// this much later they are believed against it.
  static constexpr std::int64_t flags_lag_ns = 2 * ns_per_s;

  struct Counters {
    std::uint64_t frames = 0;  ///< data and remote frames received
    std::uint64_t error_frames = 0;
    std::uint64_t bus_offs = 0;
    std::uint64_t restarts = 0;
    std::uint64_t error_passives = 0;  ///< times the state was entered
    std::uint64_t error_warnings = 0;
    std::uint64_t bus_errors = 0;
    std::uint64_t missing_acknowledges = 0;
    std::uint64_t lost_arbitrations = 0;
    std::uint64_t transceiver_faults = 0;
    std::uint64_t controller_receive_overflows = 0;
    std::uint64_t controller_transmit_overflows = 0;
    std::uint64_t interface_downs = 0;

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("frames", frames);
      visit("error_frames", error_frames);
      visit("bus_offs", bus_offs);
      visit("restarts", restarts);
      visit("error_passives", error_passives);
      visit("error_warnings", error_warnings);
      visit("bus_errors", bus_errors);
      visit("missing_acknowledges", missing_acknowledges);
      visit("lost_arbitrations", lost_arbitrations);
      visit("transceiver_faults", transceiver_faults);
      visit("controller_receive_overflows", controller_receive_overflows);
      visit("controller_transmit_overflows", controller_transmit_overflows);
      visit("interface_downs", interface_downs);
    }
  };

  /// `name`: the source of notices, e.g. "can0"; not copied. The bus begins down.
  CanBus(EventLoop& loop, const char* name, std::uint8_t channel)
      : loop_(loop), name_(name), channel_(channel) {}

  void on_frame(const CanFrame& frame, std::int64_t stamp_ns);
  /// The interface's flags: IFF_UP, and IFF_RUNNING (false: no carrier, which on CAN means bus-off).
  void on_interface(bool is_interface_up, bool is_running, std::int64_t now_ns);
  /// Down, without a word: the program closes it.
  void reset() { state_ = CanBusState::down; }

  [[nodiscard]] CanBusState state() const { return state_; }
  [[nodiscard]] bool is_up() const { return state_ != CanBusState::down && state_ != CanBusState::bus_off; }
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  void on_error_frame(const CanFrame& frame, std::int64_t stamp_ns);
  void enter(CanBusState state, std::int64_t stamp_ns);

  EventLoop& loop_;
  const char* name_;
  std::uint8_t channel_;
  CanBusState state_ = CanBusState::down;
  std::int64_t bus_off_stamp_ns_ = no_stamp_ns;
  RateLimiter state_notice_{10 * ns_per_s};  ///< for passive and warning, which come and go on a bad cable
  RateLimiter acknowledge_notice_{10 * ns_per_s};
  RateLimiter overflow_notice_{10 * ns_per_s};
  RateLimiter transceiver_notice_{10 * ns_per_s};
  RateLimiter bus_off_notice_{10 * ns_per_s};
  Counters counters_;
};

}  // namespace alces
