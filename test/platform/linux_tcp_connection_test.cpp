#include "alces_platform/linux/bytes/tcp_connection.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <catch2/catch.hpp>

#include "linux_support.h"

using namespace alces;
using alces::test::bytes_of;
using alces::test::LoopBench;

namespace {

/// A device on the loopback interface.
struct Device {
  FileDescriptor listener;
  FileDescriptor connection;
  std::uint16_t port = 0;

  Device() { listen_at(0); }
  void listen_at(std::uint16_t wanted) {
    listener = FileDescriptor(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    const int on = 1;
    setsockopt(listener.number(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(wanted);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(bind(listener.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    REQUIRE(listen(listener.number(), 4) == 0);
    socklen_t size = sizeof address;
    REQUIRE(getsockname(listener.number(), reinterpret_cast<sockaddr*>(&address), &size) == 0);
    port = ntohs(address.sin_port);
  }
  bool accept() {
    connection = FileDescriptor(accept4(listener.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    return static_cast<bool>(connection);
  }
  void says(const std::string& text) const {
    REQUIRE(send(connection.number(), text.data(), text.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(text.size()));
  }
  std::string hears() const {
    char buffer[8192];
    const ssize_t count = recv(connection.number(), buffer, sizeof buffer, 0);
    return count > 0 ? std::string(buffer, static_cast<std::size_t>(count)) : std::string();
  }
  /// Ends it with a reset, as a device does that loses its power and comes back.
  void resets() {
    const linger now{.l_onoff = 1, .l_linger = 0};
    setsockopt(connection.number(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
    connection.reset();
  }
};

}  // namespace

TEST_CASE("a connection carries bytes both ways and says when it is up") {
  LoopBench bench;
  Device device;
  TcpConnection connection(bench.loop,
                           {.host = "127.0.0.1", .port = device.port, .channel = laser_b_channel});
  REQUIRE(connection.open());
  CHECK_FALSE(connection.write(bytes_of("too early")));
  REQUIRE(bench.run_until([&] { return connection.is_up() && device.accept(); }));
  REQUIRE(bench.sink.of(EventKind::byte_link).size() == 1);
  CHECK(bench.sink.of(EventKind::byte_link)[0].event.is_up);
  CHECK(bench.sink.of(EventKind::byte_link)[0].event.channel == laser_b_channel);

  CHECK(connection.write(bytes_of("sRN ")));
  CHECK(connection.write(bytes_of("LMDscandata")));
  CHECK(connection.set_baud_rate(9600));
  device.says("sRA LMDscandata");
  std::string heard;
  REQUIRE(bench.run_until([&] {
    heard += device.hears();
    return heard.size() == 15 && bench.sink.text(EventKind::bytes).size() == 15;
  }));
  CHECK(heard == "sRN LMDscandata");
  CHECK(bench.sink.text(EventKind::bytes) == "sRA LMDscandata");
  CHECK(bench.sink.text(EventKind::bytes_sent) == "sRN LMDscandata");
  CHECK(connection.counters().bytes_refused == 9);
  CHECK(std::string(connection.error()).empty());
}

TEST_CASE("a refused connection is tried again, with back-off and one notice, until the device is there") {
  LoopBench bench;
  Device device;
  const std::uint16_t port = device.port;
  device.listener.reset();
  TcpConnection connection(bench.loop, {.host = "127.0.0.1", .port = port});
  REQUIRE(connection.open());
  bench.run_for(800 * ns_per_ms);
  CHECK(connection.counters().connects_failed >= 2);
  CHECK(connection.counters().connects_failed <= 4);  // after 0, 100, 300, 700 ms
  CHECK(bench.notices.count("refused") == 1);
  CHECK(std::string(connection.error()).find("127.0.0.1 port ") == 0);
  CHECK(std::string(connection.error()).find("refused") != std::string::npos);
  device.listen_at(port);
  REQUIRE(bench.run_until([&] { return connection.is_up(); }));
}

TEST_CASE("a connection that ends, in order or by a reset, is reported and made again") {
  const bool is_reset = GENERATE(false, true);
  LoopBench bench;
  Device device;
  TcpConnection connection(bench.loop, {.host = "127.0.0.1", .port = device.port});
  REQUIRE(connection.open());
  REQUIRE(bench.run_until([&] { return connection.is_up() && device.accept(); }));
  device.says("half a tele");
  REQUIRE(bench.run_until([&] { return !bench.sink.text(EventKind::bytes).empty(); }));
  if (is_reset) {
    device.resets();
  } else {
    device.connection.reset();
  }
  REQUIRE(bench.run_until([&] { return !connection.is_up(); }));
  CHECK_FALSE(bench.sink.of(EventKind::byte_link).back().event.is_up);
  CHECK(bench.notices.count("the connection ended") == 1);
  REQUIRE(bench.run_until([&] { return connection.is_up() && device.accept(); }));
  device.says("gram");
  REQUIRE(bench.run_until([&] { return bench.sink.text(EventKind::bytes) == "half a telegram"; }));
  CHECK(connection.counters().losses == 1);
  CHECK(connection.counters().connects == 2);
}

TEST_CASE("a connection that is dropped ends after the event, is told, and comes again after five seconds") {
  LoopBench bench;
  Device device;
  TcpConnection connection(bench.loop, {.host = "127.0.0.1", .port = device.port});
  bench.sink.then = [&](const Event& event) {
    if (event.kind == EventKind::bytes) {
      connection.drop();
      CHECK(connection.is_up());  // not while the event is dealt with
    }
  };
  REQUIRE(connection.open());
  REQUIRE(bench.run_until([&] { return connection.is_up() && device.accept(); }));
  device.says("garbage");
  REQUIRE(bench.run_until([&] { return !connection.is_up(); }));
  const std::int64_t dropped_ns = now_ns();
  CHECK(connection.counters().drops == 1);
  CHECK(connection.counters().losses == 1);
  CHECK(bench.notices.count("the connection ended") == 1);
  CHECK(std::string(connection.error()).find("nothing but garbage came") != std::string::npos);
  REQUIRE(bench.sink.of(EventKind::byte_link).size() == 2);
  CHECK_FALSE(bench.sink.of(EventKind::byte_link).back().event.is_up);
  // The second connection is made when the loop says that so much time has passed, not before.
  connection.on_tick(dropped_ns + 3 * ns_per_s);
  bench.run_for(50 * ns_per_ms);
  CHECK(connection.counters().connects == 1);
  connection.on_tick(dropped_ns + 6 * ns_per_s);
  REQUIRE(bench.run_until([&] { return connection.is_up() && device.accept(); }));
  CHECK(connection.counters().connects == 2);
}

TEST_CASE("a device that accepts and hangs up is not hammered, whether it speaks before or not") {
  const bool speaks = GENERATE(false, true);
  LoopBench bench;
  Device device;
  TcpConnection connection(bench.loop, {.host = "127.0.0.1", .port = device.port});
  REQUIRE(connection.open());
  const std::int64_t end_ns = now_ns() + ns_per_s;
  while (now_ns() < end_ns) {
    bench.loop.run_once();
    if (device.accept() && speaks) device.says("hello");
    device.connection.reset();
  }
  CHECK(connection.counters().connects <= 5);
  CHECK(connection.counters().connects >= 2);
}

TEST_CASE("a device that does not read blocks nothing, and gets all that was taken") {
  LoopBench bench;
  Device device;
  TcpConnection connection(bench.loop, {.host = "127.0.0.1", .port = device.port});
  REQUIRE(connection.open());
  REQUIRE(bench.run_until([&] { return connection.is_up() && device.accept(); }));
  std::string taken;
  int number = 0;
  std::uint64_t sent_before = 1;
  while (connection.counters().bytes_sent !=
         sent_before) {  // until the kernel's buffer is full behind our queue
    sent_before = connection.counters().bytes_sent;
    for (std::string line; connection.write(bytes_of(line));
         line = std::to_string(number++) + std::string(1000, '.')) {
      taken += line;
    }
    connection.flush(now_ns());  // as at the end of each round
  }
  CHECK(connection.counters().bytes_refused > 0);
  CHECK(bench.notices.count("takes no bytes any more") == 1);
  std::string heard;
  REQUIRE(bench.run_until([&] {
    for (std::string more = device.hears(); !more.empty(); more = device.hears()) heard += more;
    return heard.size() >= taken.size();
  }));
  CHECK(heard == taken);
}

TEST_CASE("a device that does not answer is given up after the limit and tried again") {
  LoopBench bench;
  // A listener whose queue is full lets connection requests go unanswered.
  Device device;
  REQUIRE(listen(device.listener.number(), 0) == 0);
  std::vector<std::unique_ptr<TcpConnection>> fillers;
  for (int i = 0; i < 3; ++i) {
    fillers.push_back(std::make_unique<TcpConnection>(
        bench.loop,
        TcpConnectionConfig{.host = "127.0.0.1", .port = device.port, .connect_limit_ns = 60 * ns_per_s}));
    REQUIRE(fillers.back()->open());
    bench.run_for(20 * ns_per_ms);
  }
  TcpConnection connection(bench.loop,
                           {.host = "127.0.0.1", .port = device.port, .connect_limit_ns = 100 * ns_per_ms});
  REQUIRE(connection.open());
  REQUIRE(bench.run_until([&] { return connection.counters().connects_failed == 2; }));
  CHECK(std::string(connection.error()).find("does not answer") != std::string::npos);
  CHECK(bench.notices.count("does not answer") == 1);
}

TEST_CASE("a host or port that cannot be is refused in words") {
  LoopBench bench;
  TcpConnection unnamed(bench.loop, {.host = ""});
  CHECK_FALSE(unnamed.open());
  TcpConnection no_port(bench.loop, {.host = "127.0.0.1", .port = 0});
  CHECK_FALSE(no_port.open());
  TcpConnection odd(bench.loop, {.host = "300.1.1.1"});
  CHECK_FALSE(odd.open());
  CHECK(std::string(odd.error()).find("300.1.1.1: no such host") == 0);
}
