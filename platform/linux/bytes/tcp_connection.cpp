#include "alces_platform/linux/bytes/tcp_connection.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "alces_platform/linux/clock.h"

namespace alces {
namespace {

constexpr int reads_at_once = 8;
constexpr std::int64_t forgiven_after_ns = 120 * ns_per_s;

void set_option(int descriptor, int level, int option, int value) {
  setsockopt(descriptor, level, option, &value, sizeof value);
}

}  // namespace

TcpConnection::TcpConnection(EventLoop& loop, const TcpConnectionConfig& config)
    : loop_(loop), host_(config.host), config_(config) {
  config_.host = host_.text();
}

bool TcpConnection::resolve() {
  std::array<char, 8> port{};
  std::snprintf(port.data(), port.size(), "%u", unsigned{config_.port});
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICSERV | AI_ADDRCONFIG;
  addrinfo* found = nullptr;
  const int failure = getaddrinfo(host_.text(), port.data(), &hints, &found);
  if (failure != 0) {
    error_.set("%s: no such host: %s; an address in numbers needs no name server", host_.text(),
               gai_strerror(failure));
    return false;
  }
  address_size_ = found->ai_addrlen;
  std::memcpy(&address_, found->ai_addr, found->ai_addrlen);
  freeaddrinfo(found);
  return true;
}

bool TcpConnection::open() {
  close();
  if (host_.text()[0] == '\0' || host_.is_cut() || config_.port == 0) {
    error_.set("\"%s\" port %u: not a host and a port from 1 to 65535", host_.text(), unsigned{config_.port});
    return false;
  }
  if (!resolve()) return false;
  if (!loop_.attach(*this)) {
    error_.set("%s: the event loop has no room for one more device", host_.text());
    return false;
  }
  connect(now_ns());
  return true;
}

void TcpConnection::close() {
  if (state_ == State::closed) return;
  loop_.unwatch(watch_);
  socket_.reset();
  counters_.bytes_discarded += queue_.size();
  queue_.clear();
  loop_.detach(*this);
  state_ = State::closed;
  last_error_number_ = 0;
  is_drop_due_ = false;
  back_off_.reset();
  drop_back_off_.reset();
}

void TcpConnection::connect(std::int64_t now_ns) {
  state_ = State::connecting;
  connect_since_ns_ = now_ns;
  socket_ =
      FileDescriptor(socket(address_.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_TCP));
  if (!socket_) {
    lose(now_ns, errno);
    return;
  }
  const int descriptor = socket_.number();
  set_option(descriptor, IPPROTO_TCP, TCP_NODELAY, 1);
  set_option(descriptor, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(descriptor, IPPROTO_TCP, TCP_KEEPIDLE, 3);
  set_option(descriptor, IPPROTO_TCP, TCP_KEEPINTVL, 1);
  set_option(descriptor, IPPROTO_TCP, TCP_KEEPCNT, 3);
  set_option(descriptor, IPPROTO_TCP, TCP_USER_TIMEOUT, 5000);
  if (::connect(descriptor, reinterpret_cast<const sockaddr*>(&address_), address_size_) != 0 &&
      errno != EINPROGRESS) {
    lose(now_ns, errno);
    return;
  }
  watched_events_ = EPOLLOUT;  // a connection that is there already is writable too
  watch_ = loop_.watch(descriptor, watched_events_, *this, 0);
  if (!watch_) lose(now_ns, ENOSPC);
}

void TcpConnection::watch_for(std::uint32_t epoll_events) {
  if (epoll_events == watched_events_) return;
  watched_events_ = epoll_events;
  loop_.change(watch_, epoll_events);
}

void TcpConnection::on_ready(std::uint32_t, std::uint32_t epoll_events) {
  if (state_ == State::connecting) {
    int error_number = 0;
    socklen_t size = sizeof error_number;
    if (getsockopt(socket_.number(), SOL_SOCKET, SO_ERROR, &error_number, &size) != 0) error_number = errno;
    if (error_number != 0) {
      lose(now_ns(), error_number);
    } else if ((epoll_events & EPOLLOUT) != 0) {
      on_connected(now_ns());
    }
    return;
  }
  if ((epoll_events & EPOLLOUT) != 0) watch_for(EPOLLIN);  // flush() follows
  if ((epoll_events & (EPOLLIN | EPOLLERR | EPOLLHUP)) != 0) receive();
}

void TcpConnection::on_connected(std::int64_t now_ns) {
  state_ = State::up;
  is_drop_due_ = false;
  up_since_ns_ = now_ns;
  ++counters_.connects;
  error_.clear();
  last_error_number_ = 0;
  watch_for(EPOLLIN);
  loop_.raise(now_ns, Severity::info, host_.text(), "connected");
  Event event;
  event.stamp_ns = now_ns;
  event.kind = EventKind::byte_link;
  event.channel = config_.channel;
  event.is_up = true;
  loop_.sink().on_event(event);
}

void TcpConnection::receive() {
  for (int i = 0; i < reads_at_once && state_ == State::up; ++i) {
    const ssize_t count = recv(socket_.number(), received_.data(), received_.size(), MSG_DONTWAIT);
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
    if (now - up_since_ns_ > steady_ns) back_off_.reset();
    Event event;
    event.stamp_ns = now;
    event.kind = EventKind::bytes;
    event.channel = config_.channel;
    event.bytes = std::span(received_).first(size);
    loop_.sink().on_event(event);
    carry_out_drop(now);
    if (size < received_.size()) return;
  }
}

void TcpConnection::carry_out_drop(std::int64_t now_ns) {
  if (!is_drop_due_ || state_ != State::up) return;
  is_drop_due_ = false;
  ++counters_.drops;
  lose(now_ns, EBADMSG);
  drop_back_off_.failed(now_ns);
}

void TcpConnection::lose(std::int64_t now_ns, int error_number) {
  const bool was_up = state_ == State::up;
  loop_.unwatch(watch_);
  socket_.reset();
  counters_.bytes_discarded += queue_.size();
  queue_.clear();
  state_ = State::waiting;
  back_off_.failed(now_ns);
  const unsigned port = config_.port;
  if (was_up) {
    ++counters_.losses;
    error_.set("%s port %u: the connection ended: %s", host_.text(), port,
               error_number == 0         ? "closed by the device"
               : error_number == EBADMSG ? "nothing but garbage came"
                                         : std::strerror(error_number));
    loop_.raise(now_ns, Severity::error, host_.text(), "the connection ended; connecting again",
                error_number);
    Event event;
    event.stamp_ns = now_ns;
    event.kind = EventKind::byte_link;
    event.channel = config_.channel;
    event.is_up = false;
    loop_.sink().on_event(event);
    return;
  }
  ++counters_.connects_failed;
  const char* brief = "cannot connect; trying again";
  if (error_number == ECONNREFUSED) {
    error_.set("%s port %u: refused; is this the device's port?", host_.text(), port);
    brief = "refused the connection: is this the device's port? Trying again";
  } else if (error_number == ETIMEDOUT || error_number == EHOSTUNREACH || error_number == ENETUNREACH) {
    error_.set(
        "%s port %u: does not answer (%s); is the device switched on, and this machine in its network?",
        host_.text(), port, std::strerror(error_number));
    brief = "does not answer: is it switched on, and in this network? Trying again";
  } else {
    error_.set("%s port %u: cannot connect: %s", host_.text(), port, std::strerror(error_number));
  }
  if (error_number == last_error_number_) return;
  last_error_number_ = error_number;
  loop_.raise(now_ns, Severity::error, host_.text(), brief, error_number);
}

bool TcpConnection::write(std::span<const std::uint8_t> bytes) {
  if (state_ == State::up && queue_.push(bytes)) return true;
  counters_.bytes_refused += bytes.size();
  const std::int64_t now = now_ns();
  if (state_ == State::up && full_notice_.may(now))
    loop_.raise(now, Severity::warning, host_.text(),
                "takes no bytes any more: what is sent to it is refused");
  return false;
}

void TcpConnection::flush(std::int64_t now_ns) {
  while (state_ == State::up && !queue_.empty() && (watched_events_ & EPOLLOUT) == 0) {
    const std::span<const std::uint8_t> bytes = queue_.front();
    const ssize_t sent = send(socket_.number(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0) {
      if (errno == EINTR) continue;
      if (errno == EAGAIN) {
        watch_for(EPOLLIN | EPOLLOUT);
      } else {
        lose(now_ns, errno);
      }
      return;
    }
    const auto size = static_cast<std::size_t>(sent);
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

void TcpConnection::on_tick(std::int64_t now_ns) {
  carry_out_drop(now_ns);
  // A peer that has made sense for long enough is as good as new.
  if (state_ == State::up && now_ns - up_since_ns_ > forgiven_after_ns) drop_back_off_.reset();
  if (state_ == State::waiting && back_off_.is_due(now_ns) && drop_back_off_.is_due(now_ns)) {
    connect(now_ns);
  } else if (state_ == State::connecting && now_ns - connect_since_ns_ > config_.connect_limit_ns) {
    lose(now_ns, ETIMEDOUT);
  }
}

}  // namespace alces
