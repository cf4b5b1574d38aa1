#include "alces_platform/linux/watchdog.h"

#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace alces {

bool Watchdog::open() {
  address_size_ = 0;
  interval_ns_ = 0;
  sent_ns_ = no_stamp_ns;
  error_.clear();
  const char* const name = std::getenv("NOTIFY_SOCKET");
  if (name == nullptr || *name == '\0') return true;
  const std::size_t length = std::strlen(name);
  if (*name != '/' && *name != '@') {
    error_.set("NOTIFY_SOCKET=%s: only paths and abstract sockets (@name) are understood", name);
    return false;
  }
  if (length >= sizeof address_.sun_path) {
    error_.set("NOTIFY_SOCKET=%s: longer than a socket's name can be", name);
    return false;
  }
  socket_ = FileDescriptor(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket_) {
    error_.set("NOTIFY_SOCKET=%s: no socket: %s", name, std::strerror(errno));
    return false;
  }
  address_ = {};
  address_.sun_family = AF_UNIX;
  std::memcpy(address_.sun_path, name, length);
  const bool is_abstract = *name == '@';
  if (is_abstract) address_.sun_path[0] = '\0';
  address_size_ = static_cast<unsigned>(offsetof(sockaddr_un, sun_path) + length +
                                        (is_abstract ? std::size_t{0} : std::size_t{1}));

  const char* const interval = std::getenv("WATCHDOG_USEC");
  const char* const whose = std::getenv("WATCHDOG_PID");
  const bool is_ours = whose == nullptr || std::strtoll(whose, nullptr, 10) == getpid();
  if (interval != nullptr && is_ours) {
    const auto interval_us = std::strtoll(interval, nullptr, 10);
    if (interval_us > 0 && interval_us < INT64_MAX / ns_per_us) interval_ns_ = interval_us * ns_per_us;
  }
  return true;
}

void Watchdog::send(const char* state, const char* status) {
  if (address_size_ == 0) return;
  std::array<char, 512> text{};
  int length =
      std::snprintf(text.data(), text.size(), "%s%s%s", state,
                    *state != '\0' && status != nullptr ? "\n" : "", status != nullptr ? "STATUS=" : "");
  for (; status != nullptr && *status != '\0' && length < static_cast<int>(text.size()); ++status) {
    text[static_cast<std::size_t>(length++)] = *status == '\n' ? ' ' : *status;  // a line is one assignment
  }
  const ssize_t sent =
      sendto(socket_.number(), text.data(), static_cast<std::size_t>(length), MSG_DONTWAIT | MSG_NOSIGNAL,
             reinterpret_cast<const sockaddr*>(&address_), address_size_);
  ++(sent == length ? counters_.sent : counters_.dropped);
}

void Watchdog::ready(const char* status) {
  send("READY=1", status);
}

void Watchdog::status(const char* status) {
  send("", status);
}

void Watchdog::stopping(const char* status) {
  send("STOPPING=1", status);
}

void Watchdog::alive(std::int64_t now_ns) {
  if (interval_ns_ == 0 || (sent_ns_ != no_stamp_ns && now_ns - sent_ns_ < interval_ns_ / 2)) return;
  sent_ns_ = now_ns;
  send("WATCHDOG=1", nullptr);
}

}  // namespace alces
