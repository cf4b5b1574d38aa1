#include "alces_platform/linux/bytes/serial_port.h"

// <termios.h> has no termios2 and cannot be included beside the kernel's header that has.
#include <asm/termbits.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <sys/epoll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace alces {
namespace {

constexpr std::uint32_t lowest_baud = 50;
constexpr std::uint32_t highest_baud = 4'000'000;
constexpr std::int64_t longest_gap_ns = 10 * ns_per_ms;
constexpr int reads_at_once = 8;
/// What an adapter on USB may still hold when the kernel's queue is empty.
constexpr std::int64_t adapter_delay_ns = 2 * ns_per_ms;
constexpr std::int64_t drain_look_ns = ns_per_ms;

bool can_be(std::uint32_t baud) {
  return baud >= lowest_baud && baud <= highest_baud;
}

/// Whether the rate that the driver took is near enough for a UART: within 3 %.
bool is_near(std::uint32_t got, std::uint32_t wanted) {
  const std::uint64_t difference = got > wanted ? got - wanted : wanted - got;
  return difference * 100 <= std::uint64_t{wanted} * 3;
}

}  // namespace

SerialPort::SerialPort(EventLoop& loop, const SerialPortConfig& config)
    : loop_(loop), path_(config.path), config_(config) {
  config_.path = path_.text();
}

bool SerialPort::open() {
  close();
  if (!can_be(config_.baud)) {
    error_.set("%s: %u baud is not between %u and %u", path_.text(), config_.baud, lowest_baud, highest_baud);
    return false;
  }
  if (config_.byte_gap_ns < 0 || config_.byte_gap_ns > longest_gap_ns) {
    error_.set("%s: the gap between bytes is not between 0 and 10 ms", path_.text());
    return false;
  }
  if (path_.is_cut()) {
    error_.set("%s: the path is longer than %zu bytes", path_.text(), Name::capacity - 1);
    return false;
  }
  timer_ = FileDescriptor(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
  if (timer_) timer_watch_ = loop_.watch(timer_.number(), EPOLLIN, *this, timer_token);
  if (!timer_watch_ || !loop_.attach(*this)) {
    error_.set("%s: the event loop has no room for one more device", path_.text());
    loop_.unwatch(timer_watch_);
    timer_.reset();
    return false;
  }
  is_wanted_ = true;
  const std::int64_t now = now_ns();
  if (try_open(now)) return true;
  back_off_.failed(now);
  return false;
}

void SerialPort::close() {
  loop_.unwatch(line_watch_);
  loop_.unwatch(timer_watch_);
  drop_queue();
  if (line_)
    ioctl(line_.number(), TCFLSH, TCOFLUSH);  // or close() waits for the driver to send it, up to 30 s
  line_.reset();
  timer_.reset();
  if (is_wanted_) loop_.detach(*this);
  is_wanted_ = false;
  last_error_number_ = 0;
  back_off_.reset();
}

bool SerialPort::fail(int error_number, std::int64_t now_ns) {
  const char* const path = path_.text();
  const char* brief = "cannot open the line; trying again";
  switch (error_number) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      error_.set("%s: no such serial line; is the adapter plugged in? `ls /dev/serial/by-id` lists them",
                 path);
      brief = "no such serial line; waiting for it";
      break;
    case EACCES:
    case EPERM:
      error_.set("%s: no permission; add the user to the group of this file (Debian: dialout)", path);
      brief = "no permission to open the line; add the user to the group dialout";
      break;
    case EBUSY:
    case EWOULDBLOCK:
      error_.set("%s: in use by another program; `fuser -v %s` names it", path, path);
      brief = "in use by another program; waiting for it";
      break;
    case ENOTTY:
    case EINVAL:
      error_.set("%s: is no serial line", path);
      brief = "is no serial line";
      break;
    case ERANGE:
      error_.set("%s: the driver cannot do %u baud", path, config_.baud);
      brief = "the driver cannot do this baud rate";
      break;
    default:
      error_.set("%s: cannot open the line: %s", path, std::strerror(error_number));
      break;
  }
  if (error_number != last_error_number_) {
    last_error_number_ = error_number;
    loop_.raise(now_ns, Severity::error, path, brief, error_number);
  }
  line_.reset();
  return false;
}

bool SerialPort::set_line(std::uint32_t baud) {
  termios2 line{};
  if (ioctl(line_.number(), TCGETS2, &line) != 0) return false;
  line.c_iflag = IGNBRK;
  line.c_oflag = 0;
  line.c_lflag = 0;
  constexpr tcflag_t output_rate = CBAUD;
  constexpr tcflag_t input_rate = output_rate << IBSHIFT;
  constexpr tcflag_t other_rate = BOTHER;
  line.c_cflag &=
      ~(output_rate | input_rate | tcflag_t{CSIZE | CSTOPB | PARENB | PARODD | CMSPAR} | tcflag_t{CRTSCTS});
  line.c_cflag |= tcflag_t{CS8 | CREAD | CLOCAL} | other_rate | (other_rate << IBSHIFT);
  if (config_.parity != SerialParity::none) {
    line.c_cflag |= PARENB;
    line.c_iflag |=
        tcflag_t{INPCK} | tcflag_t{IGNPAR};  // a byte with wrong parity is dropped; the driver counts it
    if (config_.parity == SerialParity::odd) line.c_cflag |= PARODD;
  }
  line.c_cc[VMIN] = 1;  // 0 would make "nothing there" look like a hang-up
  line.c_cc[VTIME] = 0;
  line.c_ispeed = baud;
  line.c_ospeed = baud;
  if (ioctl(line_.number(), TCSETS2, &line) != 0) return false;
  if (ioctl(line_.number(), TCGETS2, &line) != 0) return false;
  if (!is_near(line.c_ospeed, baud)) {
    errno = ERANGE;
    return false;
  }
  baud_ = baud;
  const std::int64_t bits = config_.parity == SerialParity::none ? 10 : 11;
  byte_ns_ = bits * ns_per_s / baud;
  return true;
}

bool SerialPort::try_open(std::int64_t now_ns) {
  line_ = FileDescriptor(::open(path_.text(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!line_) return fail(errno, now_ns);
  const int descriptor = line_.number();
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) return fail(errno, now_ns);
  if (!set_line(config_.baud)) return fail(errno, now_ns);
  ioctl(descriptor, TIOCEXCL);
  serial_struct settings{};
  if (ioctl(descriptor, TIOCGSERIAL, &settings) == 0) {
    settings.flags = static_cast<int>(static_cast<unsigned>(settings.flags) | ASYNC_LOW_LATENCY);
    ioctl(descriptor, TIOCSSERIAL, &settings);
  }
  ioctl(descriptor, TCFLSH, TCIOFLUSH);  // what came before is of an unknown rate and time
  waits_for_room_ = false;
  line_watch_ = loop_.watch(descriptor, EPOLLIN, *this, line_token);
  if (!line_watch_) {
    error_.set("%s: the event loop has no room for one more descriptor", path_.text());
    line_.reset();
    return false;
  }
  position_ = 0;
  wire_free_ns_ = now_ns;
  next_byte_ns_ = now_ns;
  has_error_counts_ = false;
  counts_read_ns_ = now_ns;
  read_error_counts(now_ns);
  ++counters_.opens;
  last_error_number_ = 0;
  error_.clear();
  deliver_link(true, now_ns);
  return true;
}

void SerialPort::deliver_link(bool is_up, std::int64_t now_ns) {
  Event event;
  event.stamp_ns = now_ns;
  event.kind = EventKind::byte_link;
  event.channel = config_.channel;
  event.is_up = is_up;
  loop_.sink().on_event(event);
}

void SerialPort::drop_queue() {
  counters_.bytes_discarded += queue_.size();
  queue_.clear();
  change_count_ = 0;
  drain_since_ns_ = no_stamp_ns;
}

void SerialPort::lose(std::int64_t now_ns, int error_number) {
  loop_.unwatch(line_watch_);
  drop_queue();
  ioctl(line_.number(), TCFLSH, TCOFLUSH);
  line_.reset();
  ++counters_.losses;
  error_.set("%s: the line is gone: %s", path_.text(),
             error_number == 0 ? "hang-up" : std::strerror(error_number));
  loop_.raise(now_ns, Severity::error, path_.text(), "the line is gone (unplugged?); waiting for it",
              error_number);
  back_off_.failed(now_ns);
  deliver_link(false, now_ns);
}

void SerialPort::on_ready(std::uint32_t token, std::uint32_t epoll_events) {
  if (token == timer_token) {
    std::uint64_t times = 0;
    if (read(timer_.number(), &times, sizeof times) < 0) return;
    return;  // flush() follows
  }
  if ((epoll_events & EPOLLOUT) != 0) wait_for_room(false);
  if ((epoll_events & (EPOLLIN | EPOLLERR | EPOLLHUP)) != 0) receive();
}

void SerialPort::receive() {
  for (int i = 0; i < reads_at_once && line_; ++i) {
    const ssize_t count = read(line_.number(), received_.data(), received_.size());
    const std::int64_t now = now_ns();
    if (count < 0) {
      if (errno != EAGAIN && errno != EINTR) lose(now, errno);
      return;
    }
    if (count == 0) {
      lose(now, 0);
      return;
    }
    const auto size = static_cast<std::size_t>(count);
    counters_.bytes_received += size;
    back_off_.reset();
    Event event;
    event.stamp_ns = now;
    event.kind = EventKind::bytes;
    event.channel = config_.channel;
    event.bytes = std::span(received_).first(size);
    loop_.sink().on_event(event);
    if (size < received_.size()) return;
  }
}

bool SerialPort::write(std::span<const std::uint8_t> bytes) {
  if (line_ && queue_.push(bytes)) return true;
  counters_.bytes_refused += bytes.size();
  const std::int64_t now = now_ns();
  if (line_ && full_notice_.may(now))
    loop_.raise(now, Severity::warning, path_.text(),
                "takes no bytes any more: what is sent to it is refused");
  return false;
}

bool SerialPort::set_baud_rate(std::uint32_t baud) {
  if (!line_ || !can_be(baud)) return false;
  const std::uint64_t position = position_ + queue_.size();
  // Two changes with nothing in between are one.
  if (change_count_ != 0 && changes_[change_count_ - 1].position == position) --change_count_;
  if (change_count_ == change_capacity) return false;
  changes_[change_count_++] = {.position = position, .baud = baud};
  return true;
}

void SerialPort::wake_at(std::int64_t time_ns) {
  itimerspec once{};
  once.it_value.tv_sec = static_cast<std::time_t>(time_ns / ns_per_s);
  once.it_value.tv_nsec = static_cast<decltype(once.it_value.tv_nsec)>(time_ns % ns_per_s);
  timerfd_settime(timer_.number(), TFD_TIMER_ABSTIME, &once, nullptr);
}

void SerialPort::wait_for_room(bool waits) {
  if (waits == waits_for_room_) return;
  waits_for_room_ = waits;
  loop_.change(line_watch_, waits ? EPOLLIN | EPOLLOUT : EPOLLIN);
}

SerialPort::Drained SerialPort::drained(std::int64_t now_ns) {
  if (drain_since_ns_ == no_stamp_ns) drain_since_ns_ = now_ns;
  int queued = 0;
  const bool is_empty = ioctl(line_.number(), TIOCOUTQ, &queued) != 0 || queued == 0;
  unsigned register_state = 0;
  const bool can_tell = ioctl(line_.number(), TIOCSERGETLSR, &register_state) == 0;
  const bool has_left =
      can_tell ? (register_state & TIOCSER_TEMT) != 0 : now_ns >= wire_free_ns_ + adapter_delay_ns;
  if (is_empty && has_left && now_ns >= wire_free_ns_) return Drained::yes;
  const bool is_late = now_ns > std::max(drain_since_ns_, wire_free_ns_) + drain_limit_ns;
  return is_late ? Drained::never : Drained::no;
}

void SerialPort::change_rate(std::int64_t now_ns) {
  const std::uint32_t baud = changes_[0].baud;
  std::copy(changes_.begin() + 1, changes_.begin() + static_cast<std::ptrdiff_t>(change_count_),
            changes_.begin());
  --change_count_;
  drain_since_ns_ = no_stamp_ns;
  const std::uint32_t before = baud_;
  if (set_line(baud)) return;
  ++counters_.rates_refused;
  loop_.raise(now_ns, Severity::error, path_.text(),
              "the driver cannot do this baud rate; it stays as it was", baud);
  if (!set_line(before)) lose(now_ns, errno);
}

void SerialPort::flush(std::int64_t now_ns) {
  while (line_ && !waits_for_room_) {
    std::size_t limit = queue_.size();
    if (change_count_ != 0) {
      limit = static_cast<std::size_t>(changes_[0].position - position_);
      if (limit == 0) {
        const Drained state = drained(now_ns);
        if (state == Drained::no) {
          wake_at(std::max(wire_free_ns_, now_ns + drain_look_ns));
          return;
        }
        if (state == Drained::never) {
          ioctl(line_.number(), TCFLSH, TCOFLUSH);
          loop_.raise(now_ns, Severity::warning, path_.text(), "bytes would not leave and were thrown away");
        }
        change_rate(now_ns);
        continue;
      }
    }
    if (limit == 0) return;
    const bool is_paced =
        config_.byte_gap_ns != 0 && (config_.byte_gap_baud == 0 || config_.byte_gap_baud == baud_);
    if (is_paced) {
      if (now_ns < next_byte_ns_) {
        wake_at(next_byte_ns_);
        return;
      }
      limit = 1;
    }
    const std::span<const std::uint8_t> bytes = queue_.front(limit);
    const ssize_t written = ::write(line_.number(), bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      if (errno == EAGAIN) {
        wait_for_room(true);
      } else {
        lose(now_ns, errno);
      }
      return;
    }
    if (written == 0) return;
    const auto size = static_cast<std::size_t>(written);
    wire_free_ns_ = std::max(wire_free_ns_, now_ns) + static_cast<std::int64_t>(size) * byte_ns_;
    next_byte_ns_ = wire_free_ns_ + config_.byte_gap_ns;
    position_ += size;
    counters_.bytes_sent += size;
    Event event;
    event.stamp_ns = now_ns;
    event.kind = EventKind::bytes_sent;
    event.channel = config_.channel;
    event.bytes = bytes.first(size);
    queue_.pop(size);  // the bytes stay where they are until the next push
    loop_.sink().on_event(event);
  }
}

void SerialPort::read_error_counts(std::int64_t now_ns) {
  serial_icounter_struct counts{};
  if (ioctl(line_.number(), TIOCGICOUNT, &counts) != 0) return;
  const std::array<std::uint32_t, 5> seen{
      static_cast<std::uint32_t>(counts.frame), static_cast<std::uint32_t>(counts.parity),
      static_cast<std::uint32_t>(counts.overrun), static_cast<std::uint32_t>(counts.buf_overrun),
      static_cast<std::uint32_t>(counts.brk)};
  if (has_error_counts_) {
    std::array<std::uint32_t, 5> more{};
    for (std::size_t i = 0; i < seen.size(); ++i) more[i] = seen[i] - error_counts_[i];
    counters_.framing_errors += more[0];
    counters_.parity_errors += more[1];
    counters_.overruns += more[2] + more[3];
    counters_.breaks += more[4];
    if (more[2] + more[3] != 0 && line_error_notice_.may(now_ns)) {
      loop_.raise(now_ns, Severity::warning, path_.text(),
                  "bytes were lost because they were not fetched in time", more[2] + more[3]);
    }
  }
  error_counts_ = seen;
  has_error_counts_ = true;
}

void SerialPort::on_tick(std::int64_t now_ns) {
  if (!line_) {
    if (!back_off_.is_due(now_ns)) return;
    if (try_open(now_ns)) {
      loop_.raise(now_ns, Severity::info, path_.text(), "the line is there");
    } else {
      back_off_.failed(now_ns);
    }
  } else if (now_ns - counts_read_ns_ >= ns_per_s) {
    counts_read_ns_ = now_ns;
    read_error_counts(now_ns);
  }
}

}  // namespace alces
