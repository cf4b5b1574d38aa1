// The permit's socket: a Unix datagram socket of ours, to which a program of the vehicle says again and again
// whether the head may turn: "1" gives the permit, "0" withdraws it (a line end may follow). Each datagram is
// one event; whatever else comes is counted. For a shell:
//   while sleep 0.1; do echo 1; done | socat -u - UNIX-SENDTO:/run/alces/permit
//
// A socket file that nobody listens on is replaced; the file is removed at close().
#pragma once

#include <cstdint>
#include <string>

#include "alces_platform/linux/event_loop.h"
#include "alces_platform/linux/file_descriptor.h"
#include "alces_platform/linux/message.h"

namespace alces {

class PermitSocket final : public EventSource {
 public:
  struct Counters {
    std::uint64_t messages = 0;
    std::uint64_t malformed = 0;

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("messages", messages);
      visit("malformed", malformed);
    }
  };

  /// `path`: copied.
  PermitSocket(EventLoop& loop, const char* path) : loop_(loop), path_(path) {}
  PermitSocket(const PermitSocket&) = delete;
  PermitSocket& operator=(const PermitSocket&) = delete;
  ~PermitSocket() { close(); }

  /// False: error() says why.
  [[nodiscard]] bool open();
  void close();
  [[nodiscard]] const char* error() const { return error_.text(); }
  [[nodiscard]] const Counters& counters() const { return counters_; }

  void on_ready(std::uint32_t token, std::uint32_t epoll_events) override;
  void on_tick(std::int64_t) override {}
  void flush(std::int64_t) override {}

 private:
  [[nodiscard]] bool fail(const char* call);

  EventLoop& loop_;
  std::string path_;
  FileDescriptor socket_;
  EventLoop::Watch watch_;
  bool is_bound_ = false;
  Counters counters_;
  Message error_;
};

}  // namespace alces
