#include "alces_platform/linux/can/socket_can.h"

#include <linux/can/error.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <cstring>

#include "alces_platform/linux/can/can_wire.h"
#include "linux_support.h"

using namespace alces;
using alces::test::LoopBench;

namespace {

/// A SocketCan on one end of a socket pair, the bus at the other.
struct PairBench : LoopBench {
  SocketCan can{loop, {.interface_name = "pair0", .channel = 1}};
  FileDescriptor bus;

  PairBench() {
    int ends[2];
    REQUIRE(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) == 0);
    bus = FileDescriptor(ends[1]);
    REQUIRE(can.adopt(FileDescriptor(ends[0])));
  }
  ~PairBench() { can.close(); }

  void put(const void* bytes, std::size_t size) {
    REQUIRE(::send(bus.number(), bytes, size, 0) == static_cast<ssize_t>(size));
  }
  void put(const CanFrame& frame) {
    canfd_frame wire;
    put(&wire, to_wire(frame, wire));
  }
  std::vector<CanFrame> taken() {
    std::vector<CanFrame> frames;
    canfd_frame wire;
    for (ssize_t size = 0; (size = recv(bus.number(), &wire, sizeof wire, 0)) > 0;) {
      const auto frame =
          from_wire({reinterpret_cast<const std::uint8_t*>(&wire), static_cast<std::size_t>(size)});
      REQUIRE(frame);
      frames.push_back(*frame);
    }
    return frames;
  }
};

bool is_vcan_here() {
  if (if_nametoindex("vcan0") != 0) return true;
  WARN("skipped: no interface vcan0 here (ip link add vcan0 type vcan; ip link set vcan0 mtu 72 up)");
  return false;
}

/// Brings vcan0 up or down; false where that is not permitted.
bool set_vcan(bool is_up) {
  const FileDescriptor descriptor(socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW));
  ifreq request{};
  std::strcpy(request.ifr_name, "vcan0");
  if (ioctl(descriptor.number(), SIOCGIFFLAGS, &request) != 0) return false;
  const int flags = is_up ? request.ifr_flags | IFF_UP : request.ifr_flags & ~IFF_UP;
  request.ifr_flags = static_cast<decltype(request.ifr_flags)>(flags);
  return ioctl(descriptor.number(), SIOCSIFFLAGS, &request) == 0;
}

}  // namespace

TEST_CASE("frames come in order as events, those without a kernel's stamp get their arrival time") {
  PairBench bench;
  const std::int64_t before_ns = now_ns();
  for (std::uint8_t i = 0; i < 100; ++i) bench.put({.id = 0x181, .size = 1, .data = {i}});
  bench.put({.id = 0x12345678, .size = 64, .is_extended = true, .is_fd = true});
  REQUIRE(bench.run_until([&] { return bench.sink.of(EventKind::can_frame).size() == 101; }));
  const auto events = bench.sink.of(EventKind::can_frame);
  for (std::uint8_t i = 0; i < 100; ++i) {
    CHECK(events[i].event.frame.data[0] == i);
    CHECK(events[i].event.channel == 1);
    CHECK(events[i].event.stamp_ns >= before_ns);
    CHECK(events[i].event.stamp_ns <= now_ns());
  }
  CHECK(events[100].event.frame.is_fd);
  CHECK(events[100].event.frame.is_extended);
  CHECK(bench.can.counters().receive_without_stamp == 101);
}

TEST_CASE("datagrams that are no frames are counted and harm nothing") {
  PairBench bench;
  const std::vector<std::uint8_t> garbage(200, 0xff);
  for (const std::size_t size : {1U, 15U, 17U, 71U, 73U, 200U}) bench.put(garbage.data(), size);
  bench.put(garbage.data(), CAN_MTU);  // states 255 bytes of data
  bench.put({.id = 0x123, .size = 1});
  REQUIRE(bench.run_until([&] { return bench.sink.of(EventKind::can_frame).size() == 1; }));
  CHECK(bench.can.counters().receive_malformed == 7);
}

TEST_CASE("what a driver sends while it handles an event leaves after it, and is reported as sent") {
  PairBench bench;
  std::vector<EventKind> order;
  bench.sink.then = [&](const Event& event) {
    if (event.kind == EventKind::tick) return;
    order.push_back(event.kind);
    if (event.kind == EventKind::can_frame) CHECK(bench.can.send({.id = 0x601, .size = 8}));
  };
  bench.put({.id = 0x581, .size = 8});
  bench.put({.id = 0x581, .size = 8});
  REQUIRE(bench.run_until([&] { return bench.sink.of(EventKind::can_sent).size() == 2; }));
  const std::vector expected{EventKind::can_frame, EventKind::can_frame, EventKind::can_sent,
                             EventKind::can_sent};
  CHECK(order == expected);
  const auto taken = bench.taken();
  REQUIRE(taken.size() == 2);
  CHECK(taken[0].id == 0x601);
  CHECK(bench.can.counters().sent == 2);
}

TEST_CASE("a full queue refuses, and what was taken leaves when there is room again") {
  PairBench bench;
  std::size_t accepted = 0;
  // Fills our queue again and again, until the kernel's is full as well.
  for (int round = 0; round < 1000 && bench.can.counters().send_waits == 0; ++round) {
    while (bench.can.send(
        {.id = 0x201,
         .size = 2,
         .data = {static_cast<std::uint8_t>(accepted), static_cast<std::uint8_t>(accepted >> 8)}})) {
      ++accepted;
    }
    bench.loop.run_once();
  }
  REQUIRE(bench.can.counters().send_waits > 0);
  CHECK(bench.can.counters().send_refused > 0);
  std::vector<CanFrame> taken;
  REQUIRE(bench.run_until([&] {
    const auto more = bench.taken();
    taken.insert(taken.end(), more.begin(), more.end());
    return taken.size() >= accepted;
  }));
  REQUIRE(taken.size() == accepted);
  for (std::size_t i = 0; i < taken.size(); ++i)
    CHECK((taken[i].data[0] | taken[i].data[1] << 8) == static_cast<int>(i));
}

TEST_CASE("frames that cannot be sent are refused at once") {
  PairBench bench;
  CHECK_FALSE(bench.can.send({.id = 0x800}));
  CHECK_FALSE(bench.can.send({.id = 1, .size = 9}));
  CHECK(bench.can.counters().send_refused == 2);
}

TEST_CASE("what waits when the controller goes bus-off is thrown away") {
  PairBench bench;
  bench.sink.then = [&](const Event& event) {
    // Queued in the same round, before the error frame that follows.
    if (event.kind == EventKind::can_frame && !event.frame.is_error)
      CHECK(bench.can.send({.id = 0x201, .size = 2}));
  };
  bench.put({.id = 0x181, .size = 1});
  can_frame off{};
  off.can_id = CAN_ERR_FLAG | CAN_ERR_BUSOFF;
  off.len = CAN_ERR_DLC;
  bench.put(&off, sizeof off);
  REQUIRE(bench.run_until([&] { return bench.sink.of(EventKind::can_link).size() == 2; }));
  CHECK_FALSE(bench.can.bus().is_up());
  CHECK_FALSE(bench.can.send({.id = 0x201, .size = 2}));
  CHECK(bench.can.counters().send_discarded == 1);
  bench.run_for(20 * ns_per_ms);
  CHECK(bench.taken().empty());
}

TEST_CASE("an end of the other side takes the link down") {
  PairBench bench;
  bench.bus.reset();
  REQUIRE(bench.run_until([&] { return !bench.can.bus().is_up(); }));
  CHECK_FALSE(bench.sink.of(EventKind::can_link).back().event.is_up);
  CHECK_FALSE(bench.can.send({.id = 1, .size = 1}));
}

TEST_CASE("an interface that is not there is named, once, and looked for until it comes") {
  LoopBench bench;
  SocketCan can(bench.loop, {.interface_name = "nosuchcan0"});
  CHECK_FALSE(can.open());
  const std::string error = can.error();
  CHECK(error.find("nosuchcan0") == 0);
  CHECK((error.find("no such CAN interface") != std::string::npos ||
         error.find("can_raw") != std::string::npos));
  bench.run_for(500 * ns_per_ms);
  CHECK(bench.notices.notices.size() == 1);
  CHECK_FALSE(can.send({.id = 1, .size = 1}));
}

TEST_CASE("impossible configurations of a CAN interface are refused") {
  LoopBench bench;
  SocketCan unnamed(bench.loop, {.interface_name = ""});
  CHECK_FALSE(unnamed.open());
  SocketCan long_named(bench.loop, {.interface_name = "an-interface-with-a-long-name"});
  CHECK_FALSE(long_named.open());
  CHECK(std::string(long_named.error()).find("1 to 15") != std::string::npos);
  const std::vector<CanFilter> filters(33);
  SocketCan filtered(bench.loop, {.interface_name = "can0", .filters = filters});
  CHECK_FALSE(filtered.open());
  CHECK(std::string(filtered.error()).find("filters") != std::string::npos);
}

TEST_CASE("on a virtual CAN interface, frames are stamped by the kernel and filters hold") {
  if (!is_vcan_here()) return;
  LoopBench bench;
  const std::vector<CanFilter> filters{{.id = 0x181, .mask = 0x7ff},
                                       {.id = 0x1abcdef0, .mask = 0x1fffffff, .is_extended = true}};
  SocketCan receiver(bench.loop, {.interface_name = "vcan0", .filters = filters});
  SocketCan sender(bench.loop, {.interface_name = "vcan0", .channel = 9});
  REQUIRE(receiver.open());
  REQUIRE(sender.open());
  bench.run_for(50 * ns_per_ms);  // the kernel begins to stamp a moment after it was asked to
  const std::int64_t before_ns = now_ns();
  CHECK(sender.send({.id = 0x181, .size = 1, .data = {42}}));
  CHECK(sender.send({.id = 0x182, .size = 1}));
  CHECK(sender.send({.id = 0x181, .size = 1, .is_extended = true}));
  CHECK(sender.send({.id = 0x1abcdef0, .size = 3, .is_extended = true}));
  REQUIRE(bench.run_until([&] { return receiver.bus().counters().frames == 2; }));
  bench.run_for(50 * ns_per_ms);
  CHECK(receiver.bus().counters().frames == 2);
  CHECK(receiver.counters().receive_without_stamp == 0);
  CHECK(receiver.clock_counters().future_stamps == 0);
  CHECK(receiver.clock_counters().stale_stamps == 0);
  for (const auto& kept : bench.sink.of(EventKind::can_frame)) {
    CHECK(kept.event.stamp_ns >= before_ns - 10 * ns_per_us);
    CHECK(kept.event.stamp_ns <= now_ns());
  }
}

TEST_CASE("on a virtual CAN interface, FD frames pass both ways and an error frame is understood") {
  if (!is_vcan_here()) return;
  LoopBench bench;
  SocketCan receiver(bench.loop, {.interface_name = "vcan0"});
  SocketCan sender(bench.loop, {.interface_name = "vcan0", .channel = 9});
  REQUIRE(receiver.open());
  REQUIRE(sender.open());
  CHECK(sender.send({.id = 0x123, .size = 64, .is_fd = true, .is_bit_rate_switched = true}));
  REQUIRE(bench.run_until([&] { return receiver.bus().counters().frames == 1; }));
  const CanFrame frame = bench.sink.of(EventKind::can_frame).back().event.frame;
  CHECK(frame.is_fd);
  CHECK(frame.size == 64);
  CHECK(frame.is_bit_rate_switched);

  // On vcan an error frame may be injected like any other.
  const FileDescriptor injector(socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW));
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex("vcan0"));
  REQUIRE(bind(injector.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  can_frame off{};
  off.can_id = CAN_ERR_FLAG | CAN_ERR_BUSOFF;
  off.len = CAN_ERR_DLC;
  REQUIRE(write(injector.number(), &off, sizeof off) == sizeof off);
  REQUIRE(bench.run_until([&] { return receiver.bus().state() == CanBusState::bus_off; }));
  CHECK_FALSE(receiver.send({.id = 1, .size = 1}));
  off.can_id = CAN_ERR_FLAG | CAN_ERR_RESTARTED;
  REQUIRE(write(injector.number(), &off, sizeof off) == sizeof off);
  REQUIRE(bench.run_until([&] { return receiver.bus().is_up(); }));
}

TEST_CASE("a virtual CAN interface that goes down and comes back is reported and used again") {
  if (!is_vcan_here()) return;
  LoopBench bench;
  SocketCan can(bench.loop, {.interface_name = "vcan0"});
  SocketCan peer(bench.loop, {.interface_name = "vcan0", .channel = 9});
  REQUIRE(can.open());
  REQUIRE(peer.open());
  if (!set_vcan(false)) {
    WARN("skipped: no permission to bring vcan0 down");
    return;
  }
  CHECK(bench.run_until([&] { return !can.bus().is_up() && !peer.bus().is_up(); }));
  CHECK_FALSE(can.send({.id = 0x181, .size = 1}));
  SocketCan late(bench.loop, {.interface_name = "vcan0", .channel = 8});
  CHECK_FALSE(late.open());
  CHECK(std::string(late.error()).find("vcan0: the interface is down") == 0);
  REQUIRE(set_vcan(true));
  CHECK(bench.run_until([&] { return can.bus().is_up() && peer.bus().is_up() && late.bus().is_up(); }));
  CHECK(can.send({.id = 0x181, .size = 1}));
  CHECK(bench.run_until(
      [&] { return peer.bus().counters().frames == 1 && late.bus().counters().frames == 1; }));
  CHECK(can.bus().counters().interface_downs == 1);
}

TEST_CASE("a burst on a virtual CAN interface arrives whole, or what is missing is counted") {
  if (!is_vcan_here()) return;
  LoopBench bench;
  SocketCan receiver(bench.loop, {.interface_name = "vcan0", .receive_buffer_bytes = 4096});
  REQUIRE(receiver.open());
  const FileDescriptor sender(socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW));
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex("vcan0"));
  REQUIRE(bind(sender.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  can_frame wire{};
  wire.can_id = 0x181;
  wire.len = 8;
  constexpr std::uint64_t burst = 2000;
  for (std::uint64_t i = 0; i < burst; ++i)
    REQUIRE(write(sender.number(), &wire, sizeof wire) == sizeof wire);
  bench.run_for(50 * ns_per_ms);
  // The count comes with the next frame that has room.
  REQUIRE(write(sender.number(), &wire, sizeof wire) == sizeof wire);
  bench.run_for(50 * ns_per_ms);
  CHECK(receiver.counters().receive_overflows > 0);
  CHECK(receiver.bus().counters().frames + receiver.counters().receive_overflows == burst + 1);
  CHECK(bench.notices.count("frames were lost") == 1);
}

TEST_CASE("a virtual CAN interface that is unplugged and plugged in again is bound anew") {
  if (!is_vcan_here()) return;
  const auto run = [](const char* command) {
    return std::system(command) == 0;
  };  // NOLINT(bugprone-command-processor)
  if (!run("ip link add vcan9 type vcan && ip link set vcan9 up")) {
    WARN("skipped: no permission to make another interface");
    return;
  }
  LoopBench bench;
  SocketCan can(bench.loop, {.interface_name = "vcan9"});
  REQUIRE(can.open());
  CHECK(run("ip link del vcan9"));
  REQUIRE(bench.run_until([&] { return !can.bus().is_up(); }));
  bench.run_for(300 * ns_per_ms);
  CHECK(std::string(can.error()).find("vcan9: no such CAN interface") == 0);
  CHECK(run("ip link add vcan9 type vcan && ip link set vcan9 up"));
  REQUIRE(bench.run_until([&] { return can.bus().is_up(); }));
  CHECK(run(
      "ip link set vcan9 down && ip link del vcan9 && ip link add vcan9 type vcan && ip link set vcan9 up"));
  REQUIRE(bench.run_until([&] { return can.counters().opens == 3 && can.bus().is_up(); }));
  SocketCan peer(bench.loop, {.interface_name = "vcan9"});
  REQUIRE(peer.open());
  CHECK(can.send({.id = 0x181, .size = 1}));
  CHECK(bench.run_until([&] { return peer.bus().counters().frames == 1; }));
  CHECK(run("ip link del vcan9"));
}
