// Tells systemd how the program is: ready, a status line, alive, stopping (sd_notify).
//
// The protocol is a datagram of "KEY=value" lines to the socket named by $NOTIFY_SOCKET ('@' in front:
// abstract). It is written here directly: it is documented as stable, takes fewer lines than asking for
// libsystemd would, and the program then runs the same with and without systemd, cross-built and static.
// Without $NOTIFY_SOCKET every call does nothing. Nothing blocks; what the socket does not take at once is
// dropped and counted. Source: sd_notify(3), section "Notes"; systemd.service(5), WatchdogSec=.
#pragma once

#include <sys/un.h>

#include <cstdint>

#include "alces_drivers/stamp.h"
#include "alces_platform/linux/file_descriptor.h"
#include "alces_platform/linux/message.h"

namespace alces {

class Watchdog {
 public:
  struct Counters {
    std::uint64_t sent = 0;
    std::uint64_t dropped = 0;

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("sent", sent);
      visit("dropped", dropped);
    }
  };

  /// Reads the environment ($NOTIFY_SOCKET, $WATCHDOG_USEC, $WATCHDOG_PID). False: there is a socket named,
  /// but it cannot be used, and error() says why. True also when nobody listens.
  [[nodiscard]] bool open();
  [[nodiscard]] bool is_listened_to() const { return address_size_ != 0; }
  [[nodiscard]] const char* error() const { return error_.text(); }
  /// How long systemd waits for alive(); 0: it does not.
  [[nodiscard]] std::int64_t interval_ns() const { return interval_ns_; }

  void ready(const char* status);
  void status(const char* status);
  void stopping(const char* status);
  /// From every tick: sends at most twice an interval. Not from a timer of its own: it is the loop that must
  /// be alive.
  void alive(std::int64_t now_ns);

  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  void send(const char* state, const char* status);

  FileDescriptor socket_;
  sockaddr_un address_{};
  unsigned address_size_ = 0;
  std::int64_t interval_ns_ = 0;
  std::int64_t sent_ns_ = no_stamp_ns;
  Counters counters_;
  Message error_;
};

}  // namespace alces
