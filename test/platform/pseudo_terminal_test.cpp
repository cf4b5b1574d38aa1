#include "pseudo_terminal.h"

#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>

#include "alces_platform/linux/bytes/serial_port.h"
#include "linux_support.h"

using namespace alces;
using alces::sim::PseudoTerminal;
using alces::test::LoopBench;

namespace {

namespace fs = std::filesystem;

struct Place {
  Place() {
    std::string name = (fs::temp_directory_path() / "alces_pty_XXXXXX").string();
    REQUIRE(::mkdtemp(name.data()) != nullptr);
    folder = name;
  }
  ~Place() { fs::remove_all(folder); }
  fs::path folder;
};

std::string text_of(std::span<const std::uint8_t> bytes) {
  return {bytes.begin(), bytes.end()};
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

TEST_CASE("our serial port talks through a pseudo terminal as through a cable, without an echo") {
  const Place place;
  PseudoTerminal device;
  const std::string link = place.folder / "laser_a";
  INFO(device.error());
  REQUIRE(device.open(link));

  LoopBench bench;
  SerialPort port(bench.loop, {.path = link.c_str(), .channel = 0, .baud = 9600});
  REQUIRE(port.open());
  const std::string all{'\x02', '\x00', '\x03', '\x04', '\x11', '\x13', '\x1a', '\n', '\r', '\xff'};
  REQUIRE(port.write(bytes_of(all)));
  std::array<std::uint8_t, 64> room{};
  std::string heard;
  CHECK(bench.run_until([&] { return (heard += text_of(device.read(room))).size() >= all.size(); }));
  CHECK(heard == all);
  device.write(bytes_of(all));
  REQUIRE(bench.run_until([&] { return port.counters().bytes_received >= all.size(); }));
  bench.run_for(20 * ns_per_ms);
  CHECK(port.counters().bytes_received == all.size());
  CHECK(device.read(room).empty());  // no echo

  CHECK(device.baud_rate() == 9600);
  REQUIRE(port.set_baud_rate(500'000));
  CHECK(bench.run_until([&] { return device.baud_rate() == 500'000; }));

  device.close();  // like an adapter that is unplugged ...
  CHECK(bench.run_until([&] { return !port.is_open(); }));
  REQUIRE(device.open(link));  // ... and there again
  CHECK(bench.run_until([&] { return port.is_open(); }));
}

TEST_CASE("a pseudo terminal takes the place of an old link, and of nothing else") {
  const Place place;
  const std::string link = place.folder / "gps";
  fs::create_symlink("/nowhere", link);
  {
    PseudoTerminal device;
    REQUIRE(device.open(link));
    CHECK(fs::is_character_file(link));
  }
  CHECK_FALSE(fs::is_symlink(link));  // gone with it

  std::ofstream(link) << "somebody's notes";
  PseudoTerminal device;
  CHECK_FALSE(device.open(link));
  CHECK(device.error().find(link) != std::string::npos);
  CHECK(fs::is_regular_file(link));
}
