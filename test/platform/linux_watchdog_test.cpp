#include "alces_platform/linux/watchdog.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string>

using namespace alces;

namespace {

/// What systemd is for the program: a datagram socket, named in the environment.
struct Manager {
  FileDescriptor socket{::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)};
  std::string path;

  explicit Manager(bool is_abstract) {
    path = (is_abstract ? "@alces-watchdog-test-" : "/tmp/alces-watchdog-test-") + std::to_string(getpid());
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.data(), path.size());
    if (is_abstract) address.sun_path[0] = '\0';
    const std::size_t size = offsetof(sockaddr_un, sun_path) + path.size() + (is_abstract ? 0U : 1U);
    unlink(path.c_str());
    REQUIRE(bind(socket.number(), reinterpret_cast<const sockaddr*>(&address),
                 static_cast<socklen_t>(size)) == 0);
    setenv("NOTIFY_SOCKET", path.c_str(), 1);
  }
  ~Manager() {
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
    unlink(path.c_str());
  }
  [[nodiscard]] std::string next() const {
    char text[2048];
    const ssize_t size = recv(socket.number(), text, sizeof text, 0);
    return size >= 0 ? std::string(text, static_cast<std::size_t>(size)) : std::string("nothing");
  }
};

}  // namespace

TEST_CASE("systemd is told of readiness, status and the end, over paths and abstract sockets") {
  const bool is_abstract = GENERATE(false, true);
  const Manager manager(is_abstract);
  Watchdog watchdog;
  REQUIRE(watchdog.open());
  CHECK(watchdog.is_listened_to());
  watchdog.ready("scanning");
  CHECK(manager.next() == "READY=1\nSTATUS=scanning");
  watchdog.status("2.1 scans/s");
  CHECK(manager.next() == "STATUS=2.1 scans/s");
  watchdog.stopping("motor runs down");
  CHECK(manager.next() == "STOPPING=1\nSTATUS=motor runs down");
  CHECK(manager.next() == "nothing");
  CHECK(watchdog.counters().sent == 3);
}

TEST_CASE("signs of life are sent twice an interval, and only where they are asked for") {
  const Manager manager(false);
  Watchdog watchdog;
  REQUIRE(watchdog.open());
  CHECK(watchdog.interval_ns() == 0);
  watchdog.alive(0);
  CHECK(manager.next() == "nothing");

  setenv("WATCHDOG_USEC", "1000000", 1);
  setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  REQUIRE(watchdog.open());
  CHECK(watchdog.interval_ns() == ns_per_s);
  int alive = 0;
  for (std::int64_t now = 0; now < 10 * ns_per_s; now += 10 * ns_per_ms) {
    watchdog.alive(now);
    if (manager.next() == "WATCHDOG=1") ++alive;
  }
  CHECK(alive == 20);

  setenv("WATCHDOG_PID", "1", 1);  // meant for another process
  REQUIRE(watchdog.open());
  CHECK(watchdog.interval_ns() == 0);
}

TEST_CASE("absurd watchdog intervals are none") {
  const Manager manager(false);
  for (const char* interval : {"", "-5", "abc", "99999999999999999999999"}) {
    setenv("WATCHDOG_USEC", interval, 1);
    Watchdog watchdog;
    REQUIRE(watchdog.open());
    CHECK(watchdog.interval_ns() == 0);
  }
}

TEST_CASE("without systemd nothing is sent and nothing fails") {
  unsetenv("NOTIFY_SOCKET");
  Watchdog watchdog;
  CHECK(watchdog.open());
  CHECK_FALSE(watchdog.is_listened_to());
  watchdog.ready("scanning");
  CHECK(watchdog.counters().sent == 0);
  CHECK(watchdog.counters().dropped == 0);
}

TEST_CASE("a notify socket that cannot be is refused in words, one that is gone is counted") {
  Watchdog watchdog;
  setenv("NOTIFY_SOCKET", "vsock:2:1234", 1);
  CHECK_FALSE(watchdog.open());
  CHECK(std::string(watchdog.error()).find("vsock:2:1234") != std::string::npos);
  setenv("NOTIFY_SOCKET", ("/" + std::string(200, 'x')).c_str(), 1);
  CHECK_FALSE(watchdog.open());
  setenv("NOTIFY_SOCKET", "/tmp/alces-no-such-socket", 1);
  CHECK(watchdog.open());
  watchdog.status("hello");
  CHECK(watchdog.counters().dropped == 1);
  unsetenv("NOTIFY_SOCKET");
}

TEST_CASE("a status is one line, and of limited length") {
  const Manager manager(false);
  Watchdog watchdog;
  REQUIRE(watchdog.open());
  watchdog.status("first\nREADY=1");
  CHECK(manager.next() == "STATUS=first READY=1");
  watchdog.status(std::string(5000, 'x').c_str());
  CHECK(manager.next().size() == 512);
}
