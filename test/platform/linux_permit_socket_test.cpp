#include "alces_platform/linux/permit_socket.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "linux_support.h"

using namespace alces;
using alces::test::LoopBench;

namespace {

struct Folder {
  std::string path = (std::filesystem::temp_directory_path() / "alces_permit_XXXXXX").string();
  Folder() { REQUIRE(mkdtemp(path.data()) != nullptr); }
  ~Folder() { std::filesystem::remove_all(path); }
  [[nodiscard]] std::string file(const char* name) const { return path + "/" + name; }
};

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), std::min(path.size(), sizeof address.sun_path - 1));
  return address;
}

bool say(const std::string& path, const std::string& text) {
  const FileDescriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const sockaddr_un address = address_of(path);
  return sendto(socket.number(), text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&address),
                sizeof address) >= 0;
}

}  // namespace

TEST_CASE("each datagram to the permit's socket is an event, and what is no permit is counted") {
  const Folder folder;
  LoopBench bench;
  PermitSocket permit(bench.loop, folder.file("permit").c_str());
  REQUIRE(permit.open());
  for (const char* text : {"1", "0\n", "1\n", "", "2", "11", "1 please, and quickly"})
    REQUIRE(say(folder.file("permit"), text));
  for (int round = 0; round < 3; ++round) bench.loop.run_once();
  const auto orders = bench.sink.of(EventKind::order);
  REQUIRE(orders.size() == 3);
  CHECK(orders[0].event.is_up);
  CHECK_FALSE(orders[1].event.is_up);
  CHECK(orders[2].event.is_up);
  CHECK(orders[0].event.order == MotorOrder::permit);
  CHECK(permit.counters().messages == 3);
  CHECK(permit.counters().malformed == 4);
  permit.close();
  CHECK_FALSE(std::filesystem::exists(folder.file("permit")));
}

TEST_CASE("a permit's socket that a program left behind is replaced, one in use and other files are not") {
  const Folder folder;
  LoopBench bench;
  const std::string path = folder.file("permit");
  {
    const FileDescriptor left(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    const sockaddr_un address = address_of(path);
    REQUIRE(bind(left.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  PermitSocket first(bench.loop, path.c_str());
  REQUIRE(first.open());
  PermitSocket second(bench.loop, path.c_str());
  CHECK_FALSE(second.open());
  CHECK(std::string(second.error()).find(path) == 0);
  CHECK(say(path, "1"));  // the first still listens
  first.close();
  REQUIRE(::close(::creat(path.c_str(), 0600)) == 0);
  CHECK_FALSE(second.open());
  CHECK(std::filesystem::is_regular_file(path));
  PermitSocket nowhere(bench.loop, folder.file("absent/permit").c_str());
  CHECK_FALSE(nowhere.open());
}
