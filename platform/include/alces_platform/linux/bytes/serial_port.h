// A serial line (RS-232, RS-422 or USB adapter), raw: no echo, no flow control, no translation of any byte.
//
// Any baud rate (termios2, BOTHER); the rate that the driver settled on is read back, and one more than 3 %
// off is refused in words. Exclusive: TIOCEXCL, and flock() against another of our own as root.
// ASYNC_LOW_LATENCY where the driver has it (FTDI: 1 ms instead of 16).
//
// Out: a queue of 4096 bytes; a change of rate waits in that queue until the bytes before it have left the
// wire, without blocking: until the driver's queue is empty, the time those bytes take has passed and, where
// the driver can tell (TIOCSERGETLSR), its shift register is empty. On request each byte is followed by a
// pause, for devices that want one. In: bytes events with the time they were read; an unplugged line (EIO,
// hang-up) is opened again by path, with back-off from 100 ms to 2 s, at the configured rate. Name the line
// by /dev/serial/by-id/...: ttyUSB numbers change. Sources: termios(3), ioctl_tty(2),
// Documentation/driver-api/serial.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "alces_drivers/port/byte_port.h"
#include "alces_drivers/scanner/event.h"
#include "alces_platform/linux/bytes/byte_ring.h"
#include "alces_platform/linux/clock.h"
#include "alces_platform/linux/event_loop.h"
#include "alces_platform/linux/file_descriptor.h"
#include "alces_platform/linux/message.h"

namespace alces {

enum class SerialParity : std::uint8_t { none, even, odd };

struct SerialPortConfig {
  const char* path = "";  ///< copied
  std::uint8_t channel = laser_a_channel;
  std::uint32_t baud = 9600;  ///< at each opening; 50 to 4,000,000
  SerialParity parity = SerialParity::none;
  std::int64_t byte_gap_ns = 0;  ///< pause after each byte sent (LMS 2xx: 55,000); at most 10 ms
  std::uint32_t byte_gap_baud =
      0;  ///< only while the line has this rate (LMS 2xx at power-up: 9600); 0: at every rate
};

class SerialPort final : public BytePort, public EventSource {
 public:
  static constexpr std::size_t queue_capacity = 4096;
  static constexpr std::size_t change_capacity = 4;  ///< of rate, waiting
  static constexpr std::int64_t drain_limit_ns = 2 * ns_per_s;

  struct Counters {
    std::uint64_t bytes_received = 0;
    std::uint64_t bytes_sent = 0;
    std::uint64_t bytes_refused = 0;    ///< write() answered false
    std::uint64_t bytes_discarded = 0;  ///< queued, and the line was lost or would not drain
    std::uint64_t opens = 0;
    std::uint64_t losses = 0;
    std::uint64_t rates_refused = 0;  ///< the driver cannot
    std::uint64_t framing_errors =
        0;  ///< the driver's counts, where it has them (TIOCGICOUNT); looked at once a second
    std::uint64_t parity_errors = 0;
    std::uint64_t overruns = 0;  ///< bytes lost in the UART or in the kernel's buffer
    std::uint64_t breaks = 0;

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("bytes_received", bytes_received);
      visit("bytes_sent", bytes_sent);
      visit("bytes_refused", bytes_refused);
      visit("bytes_discarded", bytes_discarded);
      visit("opens", opens);
      visit("losses", losses);
      visit("rates_refused", rates_refused);
      visit("framing_errors", framing_errors);
      visit("parity_errors", parity_errors);
      visit("overruns", overruns);
      visit("breaks", breaks);
    }
  };

  SerialPort(EventLoop& loop, const SerialPortConfig& config);
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;
  ~SerialPort() { close(); }

  /// Tries at once, and then again and again until close(). False: the line is not there now, and error()
  /// says why; whether that is reason to give up is the caller's to say. Up: a byte_link event.
  [[nodiscard]] bool open();
  /// Says nothing to the sink; what is queued is thrown away. Wait for is_idle() before an orderly end.
  void close();
  [[nodiscard]] bool is_open() const { return static_cast<bool>(line_); }
  [[nodiscard]] bool is_idle() const { return queue_.empty() && change_count_ == 0; }
  [[nodiscard]] const char* error() const { return error_.text(); }
  /// What the line has now; 0: not open.
  [[nodiscard]] std::uint32_t baud() const { return line_ ? baud_ : 0; }

  [[nodiscard]] bool write(std::span<const std::uint8_t> bytes) override;
  /// False also: change_capacity changes are waiting. That the driver cannot do the rate shows only when its
  /// turn has come: as a notice and in rates_refused; the line keeps the rate it had.
  [[nodiscard]] bool set_baud_rate(std::uint32_t baud) override;

  [[nodiscard]] const Counters& counters() const { return counters_; }

  void on_ready(std::uint32_t token, std::uint32_t epoll_events) override;
  void on_tick(std::int64_t now_ns) override;
  void flush(std::int64_t now_ns) override;

 private:
  struct Change {
    std::uint64_t position = 0;  ///< after so many bytes since the line was opened
    std::uint32_t baud = 0;
  };
  enum Token : std::uint32_t { line_token, timer_token };
  enum class Drained : std::uint8_t { no, yes, never };

  [[nodiscard]] bool try_open(std::int64_t now_ns);
  [[nodiscard]] bool fail(int error_number, std::int64_t now_ns);
  [[nodiscard]] bool set_line(std::uint32_t baud);
  [[nodiscard]] Drained drained(std::int64_t now_ns);
  void change_rate(std::int64_t now_ns);
  void receive();
  void lose(std::int64_t now_ns, int error_number);
  void drop_queue();
  void wake_at(std::int64_t time_ns);
  void wait_for_room(bool waits);
  void read_error_counts(std::int64_t now_ns);
  void deliver_link(bool is_up, std::int64_t now_ns);

  EventLoop& loop_;
  Name path_;
  SerialPortConfig config_;
  FileDescriptor line_;
  FileDescriptor timer_;  ///< paces bytes and looks after draining, finer than ticks
  EventLoop::Watch line_watch_;
  EventLoop::Watch timer_watch_;
  bool is_wanted_ = false;  ///< between open() and close()
  bool waits_for_room_ = false;

  ByteRing<queue_capacity> queue_;
  std::uint64_t position_ = 0;  ///< bytes handed to the driver since the line was opened
  std::array<Change, change_capacity> changes_{};
  std::size_t change_count_ = 0;
  std::uint32_t baud_ = 0;
  std::int64_t byte_ns_ = 0;       ///< one byte on the wire
  std::int64_t wire_free_ns_ = 0;  ///< when what was handed to the driver has left, at the line's rate
  std::int64_t next_byte_ns_ = 0;  ///< not before, where bytes are paced
  std::int64_t drain_since_ns_ = no_stamp_ns;

  std::array<std::uint8_t, 4096> received_{};
  std::array<std::uint32_t, 5> error_counts_{};  ///< the driver's, when last looked at
  bool has_error_counts_ = false;
  std::int64_t counts_read_ns_ = 0;
  int last_error_number_ = 0;
  RetryDelay back_off_{100 * ns_per_ms, 2 * ns_per_s};
  RateLimiter full_notice_{10 * ns_per_s};
  RateLimiter line_error_notice_{10 * ns_per_s};
  Counters counters_;
  Message error_;
};

}  // namespace alces
