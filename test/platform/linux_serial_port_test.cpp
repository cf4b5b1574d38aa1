#include "alces_platform/linux/bytes/serial_port.h"

#include <asm/termbits.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>

#include "linux_support.h"

using namespace alces;
using alces::test::bytes_of;
using alces::test::LoopBench;

namespace {

/// A pseudo terminal; its slave is the serial line, under a path that stays the same when another one is
/// plugged in.
class PtyBench : public LoopBench {
 public:
  std::string folder = "/tmp/alces_serial_XXXXXX";
  std::string path;
  FileDescriptor device;  ///< what is at the other end of the line

  PtyBench() {
    REQUIRE(mkdtemp(folder.data()) != nullptr);
    path = folder + "/laser";
    plug();
  }
  ~PtyBench() {
    unlink(path.c_str());
    rmdir(folder.c_str());
  }
  void plug() {
    device = FileDescriptor(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    REQUIRE(device);
    REQUIRE(grantpt(device.number()) == 0);
    REQUIRE(unlockpt(device.number()) == 0);
    unlink(path.c_str());
    REQUIRE(symlink(ptsname(device.number()), path.c_str()) == 0);
  }
  void unplug() {
    device.reset();
    unlink(path.c_str());
  }
  void device_says(const std::string& text) const {
    REQUIRE(::write(device.number(), text.data(), text.size()) == static_cast<ssize_t>(text.size()));
  }
  /// What the device hears; a pty's master shares the slave's settings.
  std::string device_hears() const {
    char buffer[8192];
    const ssize_t count = read(device.number(), buffer, sizeof buffer);
    return count > 0 ? std::string(buffer, static_cast<std::size_t>(count)) : std::string();
  }
  std::uint32_t device_baud() const {
    termios2 line{};
    REQUIRE(ioctl(device.number(), TCGETS2, &line) == 0);
    return line.c_ospeed;
  }
};

}  // namespace

TEST_CASE("a serial line carries every byte both ways as it is, and says when it came up") {
  PtyBench bench;
  SerialPort port(bench.loop, {.path = bench.path.c_str(), .channel = laser_b_channel, .baud = 38400});
  REQUIRE(port.open());
  REQUIRE(bench.sink.of(EventKind::byte_link).size() == 1);
  CHECK(bench.sink.of(EventKind::byte_link)[0].event.is_up);
  std::string every;
  for (int i = 0; i < 256; ++i) every += static_cast<char>(i);
  const std::int64_t before_ns = now_ns();
  bench.device_says(every);
  CHECK(port.write(bytes_of(every)));
  std::string heard;
  REQUIRE(bench.run_until([&] {
    heard += bench.device_hears();
    return heard.size() >= 256 && bench.sink.text(EventKind::bytes).size() >= 256;
  }));
  CHECK(heard == every);
  CHECK(bench.sink.text(EventKind::bytes) == every);
  CHECK(bench.sink.text(EventKind::bytes_sent) == every);
  const auto received = bench.sink.of(EventKind::bytes);
  CHECK(received[0].event.channel == laser_b_channel);
  CHECK(received[0].event.stamp_ns >= before_ns);
  CHECK(received[0].event.stamp_ns <= now_ns());
}

TEST_CASE("any baud rate is set, also those that termios has no name for") {
  const auto baud = GENERATE(as<std::uint32_t>{}, 9600, 500000, 250000, 123457, 4000000);
  PtyBench bench;
  SerialPort port(bench.loop, {.path = bench.path.c_str(), .baud = baud});
  REQUIRE(port.open());
  CHECK(bench.device_baud() == baud);
  CHECK(port.baud() == baud);
}

TEST_CASE("a change of rate waits for the bytes before it and goes before the bytes after it") {
  PtyBench bench;
  SerialPort port(bench.loop, {.path = bench.path.c_str(), .baud = 9600});
  REQUIRE(port.open());
  const std::int64_t begin_ns = now_ns();
  CHECK(port.write(bytes_of("change your rate")));
  CHECK(port.set_baud_rate(500000));
  CHECK(port.write(bytes_of("are you there?")));
  std::string heard;
  std::int64_t answer_ns = 0;
  std::uint32_t baud_of_first = 0;
  REQUIRE(bench.run_until([&] {
    const std::string more = bench.device_hears();
    if (heard.empty() && !more.empty()) baud_of_first = bench.device_baud();
    heard += more;
    if (answer_ns == 0 && heard.size() > 16) answer_ns = now_ns();
    return heard.size() == 30;
  }));
  CHECK(heard == "change your rateare you there?");
  CHECK(baud_of_first == 9600);
  CHECK(bench.device_baud() == 500000);
  CHECK(answer_ns - begin_ns >= 16 * 1041 * ns_per_us);  // 16 bytes at 9600 baud
  CHECK(port.is_idle());
}

TEST_CASE("rates set with nothing in between are one, too many that wait are refused") {
  PtyBench bench;
  SerialPort port(bench.loop, {.path = bench.path.c_str(), .baud = 9600});
  REQUIRE(port.open());
  for (int i = 0; i < 100; ++i) CHECK(port.set_baud_rate(19200));
  CHECK(port.set_baud_rate(38400));
  for (std::size_t i = 1; i < SerialPort::change_capacity; ++i) {
    CHECK(port.write(bytes_of("x")));
    CHECK(port.set_baud_rate(19200));
  }
  CHECK(port.write(bytes_of("x")));
  CHECK_FALSE(port.set_baud_rate(57600));
  CHECK_FALSE(port.set_baud_rate(0));
  CHECK_FALSE(port.set_baud_rate(100'000'000));
  REQUIRE(bench.run_until([&] { return port.is_idle(); }));
  CHECK(bench.device_baud() == 19200);
}

TEST_CASE("bytes are paced at the power-up rate and not at others") {
  PtyBench bench;
  SerialPort port(
      bench.loop,
      {.path = bench.path.c_str(), .baud = 9600, .byte_gap_ns = 2 * ns_per_ms, .byte_gap_baud = 9600});
  REQUIRE(port.open());
  CHECK(port.write(bytes_of("0123456789")));
  REQUIRE(bench.run_until([&] { return port.is_idle(); }));
  const auto sent = bench.sink.of(EventKind::bytes_sent);
  REQUIRE(sent.size() == 10);
  for (std::size_t i = 1; i < sent.size(); ++i) {
    CHECK(sent[i].event.stamp_ns - sent[i - 1].event.stamp_ns >=
          3 * ns_per_ms);  // 1.04 ms on the wire, 2 ms gap
  }
  std::string heard;
  CHECK(bench.run_until([&] { return (heard += bench.device_hears()).size() == 10; }));
  CHECK(heard == "0123456789");
  CHECK(port.set_baud_rate(500000));
  CHECK(port.write(bytes_of("0123456789")));
  REQUIRE(bench.run_until([&] { return port.is_idle(); }));
  CHECK(bench.sink.of(EventKind::bytes_sent).size() == 11);
}

TEST_CASE("an unplugged line is reported, waited for and opened again at its first rate") {
  PtyBench bench;
  SerialPort port(bench.loop, {.path = bench.path.c_str(), .baud = 9600});
  REQUIRE(port.open());
  CHECK(port.set_baud_rate(500000));
  REQUIRE(bench.run_until([&] { return port.baud() == 500000; }));
  for (int round = 0; round < 2; ++round) {
    bench.unplug();
    REQUIRE(bench.run_until([&] { return !port.is_open(); }));
    CHECK_FALSE(bench.sink.of(EventKind::byte_link).back().event.is_up);
    CHECK_FALSE(port.write(bytes_of("lost")));
    CHECK_FALSE(port.set_baud_rate(9600));
    bench.run_for(250 * ns_per_ms);
    CHECK(std::string(port.error()).find("no such serial line") != std::string::npos);
    bench.plug();
    REQUIRE(bench.run_until([&] { return port.is_open(); }));
    CHECK(bench.sink.of(EventKind::byte_link).back().event.is_up);
    CHECK(bench.device_baud() == 9600);
    bench.device_says("back");
    REQUIRE(bench.run_until([&] { return bench.sink.text(EventKind::bytes).ends_with("back"); }));
  }
  CHECK(port.counters().losses == 2);
  CHECK(port.counters().opens == 3);
  CHECK(port.counters().bytes_refused == 8);
  CHECK(bench.notices.count("unplugged") == 2);
  CHECK(bench.notices.count("the line is there") == 2);
}

TEST_CASE("a write takes all of the bytes or none") {
  PtyBench bench;
  SerialPort port(bench.loop, {.path = bench.path.c_str(), .baud = 115200});
  REQUIRE(port.open());
  const std::string half(SerialPort::queue_capacity / 2 + 1, 'a');
  CHECK(port.write(bytes_of(half)));
  CHECK_FALSE(port.write(bytes_of(half)));
  CHECK(port.counters().bytes_refused == half.size());
  std::string heard;
  REQUIRE(bench.run_until([&] { return (heard += bench.device_hears()).size() == half.size(); }));
  CHECK(heard == half);
}

TEST_CASE("a device that does not listen blocks nothing, and hears all of it later") {
  PtyBench bench;
  SerialPort port(bench.loop, {.path = bench.path.c_str(), .baud = 4000000});
  REQUIRE(port.open());
  std::string taken;
  std::uint64_t sent_before = 1;
  int number = 0;
  while (port.counters().bytes_sent != sent_before) {  // until the kernel's buffer is full behind our queue
    sent_before = port.counters().bytes_sent;
    for (std::string line; port.write(bytes_of(line)); line = "line " + std::to_string(number++) + "\r\n")
      taken += line;
    bench.loop.run_once();
  }
  CHECK(port.counters().bytes_refused > 0);
  CHECK(bench.notices.count("takes no bytes any more") == 1);
  std::string heard;
  REQUIRE(bench.run_until([&] { return (heard += bench.device_hears()).size() >= taken.size(); }));
  CHECK(heard == taken);
}

TEST_CASE("a line in use by another program is named, and taken when it is free") {
  PtyBench bench;
  FileDescriptor other(::open(bench.path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  REQUIRE(flock(other.number(), LOCK_EX | LOCK_NB) == 0);
  SerialPort port(bench.loop, {.path = bench.path.c_str()});
  CHECK_FALSE(port.open());
  CHECK(std::string(port.error()).find(bench.path + ": in use") == 0);
  other.reset();
  CHECK(bench.run_until([&] { return port.is_open(); }));
}

TEST_CASE("what is no serial line is refused in words") {
  LoopBench bench;
  SerialPort null(bench.loop, {.path = "/dev/null"});
  CHECK_FALSE(null.open());
  CHECK(std::string(null.error()) == "/dev/null: is no serial line");
  SerialPort absent(bench.loop, {.path = "/dev/serial/by-id/nothing"});
  CHECK_FALSE(absent.open());
  CHECK(std::string(absent.error()).find("no such serial line") != std::string::npos);
  SerialPort fast(bench.loop, {.path = "/dev/null", .baud = 5'000'000});
  CHECK_FALSE(fast.open());
  CHECK(std::string(fast.error()).find("5000000 baud") != std::string::npos);
  const std::string long_path = "/" + std::string(300, 'x');
  SerialPort cut(bench.loop, {.path = long_path.c_str()});
  CHECK_FALSE(cut.open());
}
