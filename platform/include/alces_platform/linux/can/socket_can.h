// One CAN interface of the kernel (SocketCAN, CAN_RAW socket): frames in as events, frames out.
//
// In: data, remote, extended, FD and error frames, in batches. Stamped by the kernel when the controller's
// driver handed them on (SO_TIMESTAMPING, CLOCK_REALTIME), through a ClockBridge; frames without a stamp get
// their arrival time and are counted (some do right after the socket was opened). Hardware stamps are taken
// on request and only where they lie within 5 ms of the software's: adapters' own clocks start at the
// realtime clock and drift away from it. Out: a queue of 64; the kernel's is some 10 long (txqueuelen) and
// answers ENOBUFS, then the queue waits for the next round. What waits when the bus goes down is thrown away
// and counted: a controlword of before an outage is no good after.
//
// Where the controller's driver echoes what it has sent (CAN_RAW_RECV_OWN_MSGS), each echo of a SYNC becomes
// an event with the kernel's stamp: when it left, not when it was queued.
//
// The interface may be absent, down, unplugged or renamed away at any time; it is bound again by name when it
// is back. Sources: Documentation/networking/can.rst, timestamping.rst; linux/net/can/raw.c.
#pragma once

#include <linux/can.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <array>
#include <cstdint>
#include <span>

#include "alces_drivers/port/can_port.h"
#include "alces_platform/linux/can/can_bus.h"
#include "alces_platform/linux/clock_bridge.h"
#include "alces_platform/linux/event_loop.h"
#include "alces_platform/linux/file_descriptor.h"
#include "alces_platform/linux/message.h"

namespace alces {

/// Lets a frame through when (its identifier ^ id) & mask is 0 and its format is the one said.
struct CanFilter {
  std::uint32_t id = 0;
  std::uint32_t mask = CAN_SFF_MASK;
  bool is_extended = false;
};

struct SocketCanConfig {
  const char* interface_name = "can0";  ///< copied
  std::uint8_t channel = 0;             ///< of the events
  std::span<const CanFilter> filters =
      {};  ///< copied, at most filter_capacity; none: everything passes. Errors always do
  std::uint32_t receive_buffer_bytes =
      1U << 20;  ///< asked for; without CAP_NET_ADMIN net.core.rmem_max is the limit
  bool use_hardware_stamps = false;
};

class SocketCan final : public CanPort, public EventSource {
 public:
  static constexpr std::size_t filter_capacity = 32;
  static constexpr std::size_t queue_capacity = 64;
  static constexpr std::size_t batch = 16;
  static constexpr std::int64_t look_every_ns = 100 * ns_per_ms;  ///< at the interface's flags

  struct Counters {
    std::uint64_t sent = 0;
    std::uint64_t send_waits = 0;         ///< the kernel's queue was full; tried again
    std::uint64_t send_refused = 0;       ///< send() answered false
    std::uint64_t send_discarded = 0;     ///< queued, and the bus went down
    std::uint64_t receive_overflows = 0;  ///< frames the kernel dropped because we read too slowly
    std::uint64_t receive_malformed = 0;
    std::uint64_t receive_without_stamp = 0;
    std::uint64_t hardware_stamps_refused = 0;
    std::uint64_t opens = 0;
    std::uint64_t echoes = 0;  ///< of frames of ours, after they were on the wire

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("sent", sent);
      visit("send_waits", send_waits);
      visit("send_refused", send_refused);
      visit("send_discarded", send_discarded);
      visit("receive_overflows", receive_overflows);
      visit("receive_malformed", receive_malformed);
      visit("receive_without_stamp", receive_without_stamp);
      visit("hardware_stamps_refused", hardware_stamps_refused);
      visit("opens", opens);
      visit("echoes", echoes);
    }
  };

  SocketCan(EventLoop& loop, const SocketCanConfig& config, ClockReader& clocks = system_clocks);
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;
  ~SocketCan() { close(); }

  /// Tries at once, and then again and again until close(). False: the bus is not up now, and error() says
  /// why; whether that is reason to give up is the caller's to say.
  [[nodiscard]] bool open();
  /// Takes a datagram socket that is there already and carries the same structs (tests, a gateway); its bus
  /// counts as up.
  [[nodiscard]] bool adopt(FileDescriptor socket);
  /// Says nothing to the sink.
  void close();
  [[nodiscard]] const char* error() const { return error_.text(); }

  /// False: bus down, queue full, or a frame that cannot be sent.
  [[nodiscard]] bool send(const CanFrame& frame) override;

  [[nodiscard]] const CanBus& bus() const { return bus_; }
  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] const ClockBridge::Counters& clock_counters() const { return bridge_.counters(); }

  void on_ready(std::uint32_t token, std::uint32_t epoll_events) override;
  void on_tick(std::int64_t now_ns) override;
  void flush(std::int64_t now_ns) override;

 private:
  [[nodiscard]] bool try_open(std::int64_t now_ns);
  [[nodiscard]] bool fail(int error_number);
  [[nodiscard]] bool watch();
  void look(std::int64_t now_ns);
  void receive();
  void accept(const msghdr& header, std::size_t size, std::int64_t arrival_ns, std::size_t slot);
  void on_socket_error(int error_number, std::int64_t now_ns);
  void lose(std::int64_t now_ns);
  void discard_queue();

  EventLoop& loop_;
  Name name_;
  SocketCanConfig config_;
  std::array<CanFilter, filter_capacity> filters_{};
  std::size_t filter_count_ = 0;
  bool has_too_many_filters_ = false;
  ClockReader& clocks_;
  ClockBridge bridge_;
  CanBus bus_;

  FileDescriptor socket_;
  EventLoop::Watch watch_;
  bool is_open_ = false;     ///< between open() and close()
  bool is_adopted_ = false;  ///< there is no interface to look at
  bool waits_for_room_ = false;
  int interface_index_ = 0;
  std::uint32_t dropped_before_ = 0;  ///< SO_RXQ_OVFL's running count
  std::int64_t looked_ns_ = no_stamp_ns;
  int last_error_number_ = 0;
  RetryDelay back_off_{100 * ns_per_ms, ns_per_s};
  RateLimiter overflow_notice_{10 * ns_per_s};
  RateLimiter kind_notice_{10 * ns_per_s};

  std::array<CanFrame, queue_capacity> queue_{};
  std::size_t queue_begin_ = 0;
  std::size_t queue_size_ = 0;

  // Of recvmmsg().
  static constexpr std::size_t control_bytes = 256;
  std::array<canfd_frame, batch> wires_{};
  alignas(cmsghdr) std::array<std::array<std::uint8_t, control_bytes>, batch> controls_{};
  std::array<iovec, batch> vectors_{};
  std::array<mmsghdr, batch> headers_{};

  Counters counters_;
  Message error_;
};

}  // namespace alces
