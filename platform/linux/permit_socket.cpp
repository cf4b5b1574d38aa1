#include "alces_platform/linux/permit_socket.h"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "alces_platform/linux/clock.h"

namespace alces {
namespace {

constexpr int datagrams_at_once = 32;  ///< before others in the loop have their turn
constexpr mode_t who_may_send = S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP;

/// A socket file whose program has gone: a connection to it is refused.
bool is_left_behind(const sockaddr_un& address) {
  struct stat file {};
  if (lstat(address.sun_path, &file) != 0 || !S_ISSOCK(file.st_mode)) return false;
  const FileDescriptor probe(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!probe) return false;
  const int result = connect(probe.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  return result != 0 && errno == ECONNREFUSED;
}

}  // namespace

bool PermitSocket::fail(const char* call) {
  error_.set(
      "%s: the permit's socket cannot be opened (%s: %s); is there its folder, and may alcesd write to it?",
      path_.c_str(), call, std::strerror(errno));
  close();
  return false;
}

bool PermitSocket::open() {
  close();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.empty() || path_.size() >= sizeof address.sun_path) {
    errno = ENAMETOOLONG;
    return fail("bind");
  }
  std::memcpy(address.sun_path, path_.data(), path_.size());
  socket_ = FileDescriptor(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket_) return fail("socket");
  if (is_left_behind(address)) unlink(path_.c_str());
  if (bind(socket_.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    return fail("bind");
  is_bound_ = true;
  if (chmod(path_.c_str(), who_may_send) != 0) return fail("chmod");
  if (!loop_.attach(*this)) {
    errno = ENOBUFS;
    return fail("attach");
  }
  watch_ = loop_.watch(socket_.number(), EPOLLIN, *this, 0);
  if (!watch_) return fail("epoll_ctl");
  error_.clear();
  return true;
}

void PermitSocket::close() {
  const int error_number = errno;
  loop_.unwatch(watch_);
  loop_.detach(*this);
  socket_.reset();
  if (is_bound_) unlink(path_.c_str());
  is_bound_ = false;
  errno = error_number;
}

void PermitSocket::on_ready(std::uint32_t, std::uint32_t) {
  std::array<char, 8> text{};
  for (int i = 0; i < datagrams_at_once; ++i) {
    const ssize_t size = recv(socket_.number(), text.data(), text.size(), MSG_DONTWAIT | MSG_TRUNC);
    if (size < 0) return;
    const bool has_known_end = size == 1 || (size == 2 && text[1] == '\n');
    if (!has_known_end || (text[0] != '0' && text[0] != '1')) {
      ++counters_.malformed;
      continue;
    }
    ++counters_.messages;
    Event event;
    event.stamp_ns = now_ns();
    event.kind = EventKind::order;
    event.order = MotorOrder::permit;
    event.is_up = text[0] == '1';
    loop_.sink().on_event(event);
  }
}

}  // namespace alces
