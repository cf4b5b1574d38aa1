// Lines of one GPIO chip: their edges as events, in the order of their stamps.
//
// Chips are named by path ("/dev/gpiochip0"), name ("gpiochip0"), number ("0") or label ("pinctrl-bcm2711");
// lines by number or name. Edges are stamped in the interrupt by the kernel. Lost edges become an edges_lost
// event (of that line) at the place in the order where they are missing, or as near as can be told: see
// edge_check.h. With libgpiod 1 each line has a buffer of its own in the kernel; all are read together and
// merged, so that A and B of a quadrature encoder keep their order but for edges a few microseconds apart
// that straddle a read. A chip that vanishes (a USB adapter) is requested again once a second; only that and
// open() use the heap. Sources: libgpiod 1.6.3 and 2.1 to 2.2, gpiod.h; linux/gpio.h.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "alces_platform/linux/clock_bridge.h"
#include "alces_platform/linux/event_loop.h"
#include "alces_platform/linux/gpio/edge_check.h"
#include "alces_platform/linux/gpio/gpio_request.h"
#include "alces_platform/linux/message.h"
#include "alces_platform/linux/retry_delay.h"

namespace alces {

struct GpioConfig {
  const char* chip = "gpiochip0";        ///< copied
  std::span<const GpioLine> lines = {};  ///< copied, at most GpioRequest::line_capacity
  std::uint8_t first_line =
      0;  ///< GpioEdge::line of the first; for lines on several chips, one GpioLines each
  const char* consumer = "alces";  ///< what gpioinfo shows
};

class GpioLines final : public EventSource {
 public:
  static constexpr std::int64_t look_every_ns = ns_per_s;  ///< at whether the chip is there

  struct Counters {
    std::uint64_t edges = 0;
    std::uint64_t losses = 0;              ///< edges_lost events
    std::uint64_t edges_lost = 0;          ///< as far as known
    std::uint64_t full_buffers = 0;        ///< libgpiod 1: reads that found the kernel's buffer full
    std::uint64_t implausible_stamps = 0;  ///< replaced by the time of reading
    std::uint64_t opens = 0;

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("edges", edges);
      visit("losses", losses);
      visit("edges_lost", edges_lost);
      visit("full_buffers", full_buffers);
      visit("implausible_stamps", implausible_stamps);
      visit("opens", opens);
    }
  };

  GpioLines(EventLoop& loop, const GpioConfig& config, ClockReader& clocks = system_clocks);
  GpioLines(const GpioLines&) = delete;
  GpioLines& operator=(const GpioLines&) = delete;
  ~GpioLines() { close(); }

  /// False: error() says which chip or line, and what to do; it is tried again once a second until close(). A
  /// mistake in the configuration (no such line) does not heal by itself: the caller may want to give up.
  [[nodiscard]] bool open();
  void close();
  [[nodiscard]] bool is_open() const { return request_.is_open(); }
  [[nodiscard]] const char* error() const { return error_.text(); }
  [[nodiscard]] const Counters& counters() const { return counters_; }

  void on_ready(std::uint32_t token, std::uint32_t epoll_events) override;
  void on_tick(std::int64_t now_ns) override;
  void flush(std::int64_t) override {}

 private:
  [[nodiscard]] bool try_open();
  void release();
  void lose(std::int64_t now_ns, int error_number);
  void deliver(const StampedEdge& stamped, std::int64_t now_ns);
  void report_loss(std::uint8_t line, std::uint32_t count, std::int64_t stamp_ns);

  EventLoop& loop_;
  Name chip_;
  Name consumer_;
  std::array<Name, GpioRequest::line_capacity> line_names_;
  std::array<GpioLine, GpioRequest::line_capacity> lines_;
  std::size_t line_count_ = 0;
  bool has_too_many_lines_ = false;
  std::uint8_t first_line_ = 0;
  ClockReader& clocks_;
  ClockBridge bridge_;

  bool is_wanted_ = false;  ///< between open() and close()
  GpioRequest request_;
  Name path_;               ///< of the chip's file
  std::uint64_t file_ = 0;  ///< its inode, when it was opened
  std::int64_t looked_ns_ = 0;
  std::array<EventLoop::Watch, GpioRequest::line_capacity> watches_{};
  std::array<EdgeCheck, GpioRequest::line_capacity> checks_;
  std::array<StampedEdge, GpioRequest::line_capacity * GpioRequest::buffer_v1> edges_{};
  std::array<bool, GpioRequest::line_capacity> was_full_{};
  RetryDelay back_off_{ns_per_s, ns_per_s};
  RateLimiter loss_notice_{10 * ns_per_s};
  Counters counters_;
  Message error_;
};

/// "/dev/gpiochipN" for a chip named by path, name, number or label. False: `error` says why. Asks the
/// kernel, so it works with any libgpiod and with none.
[[nodiscard]] bool find_gpio_chip(const char* chip, Name& path, Message& error);

}  // namespace alces
