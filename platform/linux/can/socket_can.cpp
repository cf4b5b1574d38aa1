#include "alces_platform/linux/can/socket_can.h"

#include <fcntl.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <net/if.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "alces_drivers/canopen/cob_id.h"
#include "alces_platform/linux/can/can_wire.h"

namespace alces {
namespace {

constexpr int rounds_at_once = 4;               ///< of batches, before others in the loop have their turn
constexpr unsigned long echo_flag = 1UL << 18;  // linux/if.h, which does not go together with net/if.h
constexpr std::int64_t hardware_stamp_tolerance_ns = 5 * ns_per_ms;

template <class Value>
bool set_option(int descriptor, int level, int option, const Value& value) {
  return setsockopt(descriptor, level, option, &value, sizeof value) == 0;
}

ifreq request_for(const char* interface_name) {
  ifreq request{};
  std::memcpy(request.ifr_name, interface_name,
              std::min<std::size_t>(std::strlen(interface_name), IFNAMSIZ - 1));
  return request;
}

/// Does the controller's driver echo a frame once it was sent (IFF_ECHO)? Otherwise the kernel does when it
/// is queued, which tells nothing. SIOCGIFFLAGS is too short for the flag.
bool has_echo(const char* interface_name) {
  std::array<char, 64 + IFNAMSIZ> path{};
  std::snprintf(path.data(), path.size(), "/sys/class/net/%s/flags", interface_name);
  const FileDescriptor file(::open(path.data(), O_RDONLY | O_CLOEXEC));
  std::array<char, 32> text{};
  if (!file || ::read(file.number(), text.data(), text.size() - 1) <= 0) return false;
  return (std::strtoul(text.data(), nullptr, 16) & echo_flag) != 0;
}

/// The kernel's stamps of one datagram, CLOCK_REALTIME; 0 where there is none.
struct Ancillary {
  std::int64_t software_ns = 0;
  std::int64_t hardware_ns = 0;
  std::optional<std::uint32_t> dropped;
};

Ancillary read_ancillary(const msghdr& header) {
  Ancillary result;
  auto& mutable_header = const_cast<msghdr&>(header);  // CMSG_NXTHDR asks for it and changes nothing
  for (cmsghdr* item = CMSG_FIRSTHDR(&mutable_header); item != nullptr;
       item = CMSG_NXTHDR(&mutable_header, item)) {
    if (item->cmsg_level != SOL_SOCKET) continue;
    if (item->cmsg_type == SCM_TIMESTAMPING && item->cmsg_len >= CMSG_LEN(sizeof(scm_timestamping))) {
      scm_timestamping stamps{};
      std::memcpy(&stamps, CMSG_DATA(item), sizeof stamps);
      result.software_ns = nanoseconds(stamps.ts[0]);
      result.hardware_ns = nanoseconds(stamps.ts[2]);
    } else if (item->cmsg_type == SO_RXQ_OVFL && item->cmsg_len >= CMSG_LEN(sizeof(std::uint32_t))) {
      std::uint32_t dropped = 0;
      std::memcpy(&dropped, CMSG_DATA(item), sizeof dropped);
      result.dropped = dropped;
    }
  }
  return result;
}

}  // namespace

SocketCan::SocketCan(EventLoop& loop, const SocketCanConfig& config, ClockReader& clocks)
    : loop_(loop),
      name_(config.interface_name),
      config_(config),
      filter_count_(std::min(config.filters.size(), filter_capacity)),
      has_too_many_filters_(config.filters.size() > filter_capacity),
      clocks_(clocks),
      bridge_(clocks),
      bus_(loop, name_.text(), config.channel) {
  std::ranges::copy(config.filters.first(filter_count_), filters_.begin());
  for (std::size_t i = 0; i < batch; ++i) {
    vectors_[i] = {.iov_base = &wires_[i], .iov_len = sizeof wires_[i]};
    headers_[i].msg_hdr.msg_iov = &vectors_[i];
    headers_[i].msg_hdr.msg_iovlen = 1;
    headers_[i].msg_hdr.msg_control = controls_[i].data();
  }
}

bool SocketCan::open() {
  close();
  if (has_too_many_filters_) {
    error_.set("%s: more than %zu filters; widen their masks", name_.text(), filter_capacity);
    return false;
  }
  if (std::strlen(name_.text()) >= IFNAMSIZ || name_.text()[0] == '\0') {
    error_.set("%s: no interface can have this name (1 to %d characters)", name_.text(), IFNAMSIZ - 1);
    return false;
  }
  if (!loop_.attach(*this)) {
    error_.set("%s: the event loop has no room for one more device", name_.text());
    return false;
  }
  is_open_ = true;
  const std::int64_t now = clocks_.monotonic_ns();
  if (!try_open(now)) {
    back_off_.failed(now);
    return false;
  }
  return bus_.is_up();
}

bool SocketCan::adopt(FileDescriptor socket) {
  close();
  if (!loop_.attach(*this)) {
    error_.set("%s: the event loop has no room for one more device", name_.text());
    return false;
  }
  is_open_ = true;
  is_adopted_ = true;
  socket_ = std::move(socket);
  if (!watch()) return false;
  bus_.on_interface(true, true, clocks_.monotonic_ns());
  return true;
}

void SocketCan::close() {
  if (!is_open_) return;
  loop_.unwatch(watch_);
  socket_.reset();
  discard_queue();
  bus_.reset();
  loop_.detach(*this);
  is_open_ = false;
  is_adopted_ = false;
  last_error_number_ = 0;
  back_off_.reset();
}

bool SocketCan::fail(int error_number) {
  const char* const name = name_.text();
  switch (error_number) {
    case EAFNOSUPPORT:
    case EPROTONOSUPPORT:
    case ESOCKTNOSUPPORT:
      error_.set("%s: this kernel has no CAN sockets; load them: modprobe can_raw", name);
      break;
    case ENODEV:
    case ENXIO:
      error_.set(
          "%s: no such CAN interface; is the adapter plugged in and its driver loaded? `ip link` lists them",
          name);
      break;
    case EPERM:
    case EACCES:
      error_.set("%s: no permission to open a CAN socket; CAP_NET_RAW may be needed here", name);
      break;
    default:
      error_.set("%s: cannot open the CAN interface: %s", name, std::strerror(error_number));
      break;
  }
  if (error_number != last_error_number_) {
    last_error_number_ = error_number;
    const bool is_absent = error_number == ENODEV || error_number == ENXIO;
    loop_.raise(
        clocks_.monotonic_ns(), Severity::error, name,
        is_absent ? "no such CAN interface; waiting for it" : "cannot open a CAN socket; trying again",
        error_number);
  }
  socket_.reset();
  return false;
}

bool SocketCan::watch() {
  waits_for_room_ = false;
  dropped_before_ = 0;
  watch_ = loop_.watch(socket_.number(), EPOLLIN, *this, 0);
  if (watch_) return true;
  error_.set("%s: the event loop has no room for one more descriptor", name_.text());
  socket_.reset();
  return false;
}

bool SocketCan::try_open(std::int64_t now_ns) {
  socket_ = FileDescriptor(socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (!socket_) return fail(errno);
  const int descriptor = socket_.number();
  ifreq request = request_for(name_.text());
  if (ioctl(descriptor, SIOCGIFINDEX, &request) != 0) return fail(errno);
  interface_index_ = request.ifr_ifindex;

  // What a kernel does not know (FD, counters, stamps) is done without, except the filters: they were asked
  // for.
  const int on = 1;
  set_option(descriptor, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, on);
  set_option(descriptor, SOL_SOCKET, SO_RXQ_OVFL, on);
  if (has_echo(name_.text())) set_option(descriptor, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, on);
  const auto stamps = static_cast<int>(
      SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE |
      (config_.use_hardware_stamps ? SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE : 0));
  set_option(descriptor, SOL_SOCKET, SO_TIMESTAMPING, stamps);
  const auto buffer_bytes =
      static_cast<int>(std::min<std::uint32_t>(config_.receive_buffer_bytes, INT32_MAX / 2));
  if (!set_option(descriptor, SOL_SOCKET, SO_RCVBUFFORCE, buffer_bytes)) {
    set_option(descriptor, SOL_SOCKET, SO_RCVBUF, buffer_bytes);
  }
  const can_err_mask_t every_error = CAN_ERR_MASK;
  if (!set_option(descriptor, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, every_error)) return fail(errno);
  if (filter_count_ != 0) {
    std::array<can_filter, filter_capacity> filters{};
    for (std::size_t i = 0; i < filter_count_; ++i) {
      const CanFilter& filter = filters_[i];
      filters[i].can_id = (filter.id & CAN_EFF_MASK) | (filter.is_extended ? CAN_EFF_FLAG : 0U);
      filters[i].can_mask = (filter.mask & CAN_EFF_MASK) | CAN_EFF_FLAG;
    }
    if (setsockopt(descriptor, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                   static_cast<socklen_t>(filter_count_ * sizeof(can_filter))) != 0) {
      return fail(errno);
    }
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = interface_index_;
  if (bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return fail(errno);
  if (!watch()) return false;
  ++counters_.opens;
  last_error_number_ = 0;
  back_off_.reset();
  error_.clear();
  look(now_ns);
  return true;
}

void SocketCan::look(std::int64_t now_ns) {
  looked_ns_ = now_ns;
  ifreq request = request_for(name_.text());
  if (ioctl(socket_.number(), SIOCGIFINDEX, &request) != 0 || request.ifr_ifindex != interface_index_) {
    lose(now_ns);  // unplugged; or plugged in again between two looks, under another number
    return;
  }
  if (ioctl(socket_.number(), SIOCGIFFLAGS, &request) != 0) {
    lose(now_ns);
    return;
  }
  const auto flags = static_cast<unsigned>(request.ifr_flags);
  const bool was_up = bus_.is_up();
  bus_.on_interface((flags & IFF_UP) != 0, (flags & IFF_RUNNING) != 0, now_ns);
  if (was_up && !bus_.is_up()) discard_queue();
  if (bus_.is_up()) {
    error_.clear();
  } else if (bus_.state() == CanBusState::down) {
    error_.set("%s: the interface is down; bring it up: ip link set %s up type can bitrate 1000000",
               name_.text(), name_.text());
  } else {
    error_.set(
        "%s: the controller is bus-off; look at bit rate, terminators and cable, then: ip link set %s type "
        "can restart",
        name_.text(), name_.text());
  }
}

void SocketCan::lose(std::int64_t now_ns) {
  loop_.unwatch(watch_);
  socket_.reset();
  discard_queue();
  bus_.on_interface(false, false, now_ns);
}

void SocketCan::discard_queue() {
  counters_.send_discarded += queue_size_;
  queue_size_ = 0;
}

void SocketCan::on_ready(std::uint32_t, std::uint32_t epoll_events) {
  if (waits_for_room_ && (epoll_events & EPOLLOUT) != 0) {
    waits_for_room_ = false;  // flush() follows
    loop_.change(watch_, EPOLLIN);
  }
  if ((epoll_events & (EPOLLIN | EPOLLERR | EPOLLHUP)) != 0) receive();
}

void SocketCan::receive() {
  for (int round = 0; round < rounds_at_once; ++round) {
    for (mmsghdr& header : headers_) {
      header.msg_hdr.msg_controllen = control_bytes;
      header.msg_hdr.msg_flags = 0;
    }
    const int count = recvmmsg(socket_.number(), headers_.data(), batch, MSG_DONTWAIT, nullptr);
    const std::int64_t arrival_ns = clocks_.monotonic_ns();
    if (count < 0) {
      if (errno != EAGAIN && errno != EINTR) on_socket_error(errno, arrival_ns);
      return;
    }
    const auto received = static_cast<std::size_t>(count);
    for (std::size_t i = 0; i < received; ++i)
      accept(headers_[i].msg_hdr, headers_[i].msg_len, arrival_ns, i);
    if (is_adopted_ && received > 0 && headers_[received - 1].msg_len == 0) {
      on_socket_error(ECONNRESET, arrival_ns);  // the other end of a socket pair is gone
      return;
    }
    if (received < batch) return;
  }
}

void SocketCan::accept(const msghdr& header, std::size_t size, std::int64_t arrival_ns, std::size_t slot) {
  const Ancillary ancillary = read_ancillary(header);
  if (ancillary.dropped && *ancillary.dropped != dropped_before_) {
    const std::uint32_t lost = *ancillary.dropped - dropped_before_;  // the count wraps
    dropped_before_ = *ancillary.dropped;
    counters_.receive_overflows += lost;
    if (overflow_notice_.may(arrival_ns)) {
      loop_.raise(arrival_ns, Severity::warning, name_.text(),
                  "frames were lost because they were not read in time; a real-time priority or filters help",
                  lost);
    }
  }
  if (size == 0 && is_adopted_) return;
  const bool is_cut = (header.msg_flags & MSG_TRUNC) != 0;
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(&wires_[slot]);
  const std::optional<CanFrame> frame = is_cut ? std::nullopt : from_wire({bytes, size});
  if (!frame) {
    ++counters_.receive_malformed;
    return;
  }
  std::int64_t realtime_ns = ancillary.software_ns;
  if (config_.use_hardware_stamps && ancillary.hardware_ns != 0) {
    const std::int64_t difference_ns = realtime_ns - ancillary.hardware_ns;
    if (std::abs(difference_ns) <= hardware_stamp_tolerance_ns) {
      realtime_ns = ancillary.hardware_ns;
    } else {
      ++counters_.hardware_stamps_refused;
    }
  }
  std::int64_t stamp_ns = arrival_ns;
  if (realtime_ns != 0) {
    stamp_ns = bridge_.monotonic_ns(realtime_ns, arrival_ns);
  } else {
    ++counters_.receive_without_stamp;
  }
  if ((header.msg_flags & MSG_CONFIRM) != 0) {  // a frame of ours, after it was on the wire
    ++counters_.echoes;
    if (frame->is_classical_data() && frame->id == canopen::sync_cob_id && realtime_ns != 0) {
      Event event;
      event.stamp_ns = stamp_ns;
      event.kind = EventKind::sync_sent;
      event.channel = config_.channel;
      loop_.sink().on_event(event);
    }
    return;
  }
  const bool was_up = bus_.is_up();
  bus_.on_frame(*frame, stamp_ns);
  if (was_up && !bus_.is_up()) discard_queue();
}

void SocketCan::on_socket_error(int error_number, std::int64_t now_ns) {
  if (error_number == ENETDOWN && !is_adopted_) {
    discard_queue();
    bus_.on_interface(false, false, now_ns);  // the socket stays bound: look() sees the interface come back
    looked_ns_ = now_ns;
    return;
  }
  if (error_number == ENOBUFS) return;
  lose(now_ns);  // ENODEV and whatever else: a new socket
}

bool SocketCan::send(const CanFrame& frame) {
  canfd_frame wire;
  if (!bus_.is_up() || queue_size_ == queue_capacity || to_wire(frame, wire) == 0) {
    ++counters_.send_refused;
    return false;
  }
  queue_[(queue_begin_ + queue_size_) % queue_capacity] = frame;
  ++queue_size_;
  return true;
}

void SocketCan::flush(std::int64_t now_ns) {
  while (queue_size_ != 0 && socket_ && !waits_for_room_) {
    const CanFrame frame = queue_[queue_begin_];
    canfd_frame wire;
    const std::size_t size = to_wire(frame, wire);
    const ssize_t written = ::send(socket_.number(), &wire, size, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0 && (errno == ENOBUFS || errno == EAGAIN)) {
      ++counters_.send_waits;
      // ENOBUFS is the interface's queue, of which epoll knows nothing: the next round tries again.
      waits_for_room_ = errno == EAGAIN;
      if (waits_for_room_) loop_.change(watch_, EPOLLIN | EPOLLOUT);
      return;
    }
    queue_begin_ = (queue_begin_ + 1) % queue_capacity;
    --queue_size_;
    if (written < 0) {
      ++counters_.send_discarded;
      // EINVAL, EMSGSIZE: an FD frame on an interface that is not FD. That frame is lost, not the bus.
      if (errno == EINVAL || errno == EMSGSIZE) {
        if (kind_notice_.may(now_ns)) {
          loop_.raise(now_ns, Severity::error, name_.text(),
                      "the interface takes no frame of this kind (FD?), id", frame.id);
        }
        continue;
      }
      on_socket_error(errno, now_ns);
      return;
    }
    ++counters_.sent;
    Event event;
    event.stamp_ns = now_ns;
    event.kind = EventKind::can_sent;
    event.channel = config_.channel;
    event.frame = frame;
    loop_.sink().on_event(event);
  }
}

void SocketCan::on_tick(std::int64_t now_ns) {
  if (is_adopted_) return;
  if (!socket_) {
    if (back_off_.is_due(now_ns) && !try_open(now_ns)) back_off_.failed(now_ns);
  } else if (now_ns - looked_ns_ >= look_every_ns) {
    look(now_ns);
  }
}

}  // namespace alces
