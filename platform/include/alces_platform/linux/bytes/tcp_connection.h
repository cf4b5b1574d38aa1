// A TCP connection to a device (CoLa lasers: port 2111 or 2112), kept up: connected without blocking, and
// again with back-off from 100 ms to 5 s whenever it is refused, times out or ends. The back-off starts over
// when a connection has held for steady_ns, so a device that accepts and hangs up is not hammered. One that
// is dropped for its garbage gets a pause of its own, 5 s to 80 s.
//
// TCP_NODELAY; keepalive after 3 s, every 1 s, 3 times, and TCP_USER_TIMEOUT 5 s: a cable pulled out shows
// within 6 s. In: bytes events with the time they were read; byte_link events. Out: a queue of 4096 bytes,
// all or nothing. Source: tcp(7), socket(7).
#pragma once

#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <span>

#include "alces_drivers/port/byte_port.h"
#include "alces_drivers/scanner/event.h"
#include "alces_platform/linux/bytes/byte_ring.h"
#include "alces_platform/linux/event_loop.h"
#include "alces_platform/linux/file_descriptor.h"
#include "alces_platform/linux/message.h"

namespace alces {

struct TcpConnectionConfig {
  const char* host =
      "";  ///< an address, IPv4 or IPv6, or a name, looked up once by open() (which then may block)
  std::uint16_t port = 2112;
  std::uint8_t channel = laser_a_channel;
  std::int64_t connect_limit_ns = 3 * ns_per_s;
};

class TcpConnection final : public BytePort, public EventSource {
 public:
  static constexpr std::size_t queue_capacity = 4096;
  static constexpr std::int64_t steady_ns = 2 * ns_per_s;

  struct Counters {
    std::uint64_t bytes_received = 0;
    std::uint64_t bytes_sent = 0;
    std::uint64_t bytes_refused = 0;    ///< write() answered false
    std::uint64_t bytes_discarded = 0;  ///< queued, and the connection was lost
    std::uint64_t connects = 0;
    std::uint64_t connects_failed = 0;
    std::uint64_t losses = 0;
    std::uint64_t drops = 0;  ///< of them, by us: garbage came

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("bytes_received", bytes_received);
      visit("bytes_sent", bytes_sent);
      visit("bytes_refused", bytes_refused);
      visit("bytes_discarded", bytes_discarded);
      visit("connects", connects);
      visit("connects_failed", connects_failed);
      visit("losses", losses);
      visit("drops", drops);
    }
  };

  TcpConnection(EventLoop& loop, const TcpConnectionConfig& config);
  TcpConnection(const TcpConnection&) = delete;
  TcpConnection& operator=(const TcpConnection&) = delete;
  ~TcpConnection() { close(); }

  /// Begins to connect; a byte_link event says when it is up. False: error() says why nothing can come of it
  /// (no such host, no port, no room in the loop).
  [[nodiscard]] bool open();
  /// Says nothing to the sink.
  void close();
  [[nodiscard]] bool is_up() const { return state_ == State::up; }
  [[nodiscard]] bool is_idle() const { return queue_.empty(); }
  /// Why there is no connection; empty while there is.
  [[nodiscard]] const char* error() const { return error_.text(); }

  [[nodiscard]] bool write(std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] bool set_baud_rate(std::uint32_t) override { return true; }

  /// Ends the connection once the event being handed on has been dealt with.
  void drop() override { is_drop_due_ = true; }

  [[nodiscard]] const Counters& counters() const { return counters_; }

  void on_ready(std::uint32_t token, std::uint32_t epoll_events) override;
  void on_tick(std::int64_t now_ns) override;
  void flush(std::int64_t now_ns) override;

 private:
  enum class State : std::uint8_t { closed, waiting, connecting, up };

  [[nodiscard]] bool resolve();
  void connect(std::int64_t now_ns);
  void on_connected(std::int64_t now_ns);
  void receive();
  void lose(std::int64_t now_ns, int error_number);
  void carry_out_drop(std::int64_t now_ns);
  void watch_for(std::uint32_t epoll_events);

  EventLoop& loop_;
  Name host_;
  TcpConnectionConfig config_;
  sockaddr_storage address_{};
  socklen_t address_size_ = 0;
  FileDescriptor socket_;
  EventLoop::Watch watch_;
  std::uint32_t watched_events_ = 0;
  State state_ = State::closed;
  std::int64_t connect_since_ns_ = 0;
  ByteRing<queue_capacity> queue_;
  std::array<std::uint8_t, 16384> received_{};
  RateLimiter full_notice_{10 * ns_per_s};
  bool is_drop_due_ = false;
  std::int64_t up_since_ns_ = 0;
  int last_error_number_ = 0;
  RetryDelay back_off_{100 * ns_per_ms, 5 * ns_per_s};
  RetryDelay drop_back_off_{5 * ns_per_s, 80 * ns_per_s};
  Counters counters_;
  Message error_;
};

}  // namespace alces
