// What alces shows on a terminal while it maps, and that it shows nothing where there is none.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <regex>
#include <string>
#include <vector>

#include "room.h"
#include "run_alces.h"

namespace alces::offline {
namespace {

constexpr std::size_t scan_count = 150;  // most of a second of work: several lines

/// What "alces map scans --out out" writes to stderr when that is a terminal.
std::string on_a_terminal(const TemporaryFolder& folder) {
  const int terminal = ::posix_openpt(O_RDWR | O_NOCTTY);
  REQUIRE(terminal >= 0);
  REQUIRE(::grantpt(terminal) == 0);
  REQUIRE(::unlockpt(terminal) == 0);
  const std::string name = ::ptsname(terminal);
  const pid_t process = ::fork();
  REQUIRE(process >= 0);
  if (process == 0) {
    ::dup2(::open("/dev/null", O_WRONLY), STDOUT_FILENO);
    ::dup2(::open(name.c_str(), O_RDWR | O_NOCTTY), STDERR_FILENO);
    ::close(terminal);
    if (::chdir(folder.path().c_str()) != 0) ::_exit(99);
    ::execl(ALCES_PROGRAM, "alces", "map", "scans", "--out", "out", nullptr);
    ::_exit(98);
  }
  std::string shown;
  char piece[4096];
  // The other end is closed when the program ends: Linux says EIO then.
  for (ssize_t got = 0; (got = ::read(terminal, piece, sizeof piece)) > 0;)
    shown.append(piece, static_cast<std::size_t>(got));
  ::close(terminal);
  int status = 0;
  REQUIRE(::waitpid(process, &status, 0) == process);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
  return shown;
}

/// The lines that took each other's place.
std::vector<std::string> lines_of(const std::string& shown) {
  const std::string begin = "\r\x1b[K";
  std::vector<std::string> lines;
  for (std::size_t at = shown.find(begin); at != std::string::npos;) {
    const std::size_t next = shown.find(begin, at + 1);
    lines.push_back(
        shown.substr(at + begin.size(), next == std::string::npos ? next : next - at - begin.size()));
    at = next;
  }
  return lines;
}

TEST_CASE("on a terminal a bar tells of scans done, their rate and the time left, and goes away") {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < scan_count; ++i)
    folder.write("scans/scan" + std::to_string(i) + ".pcd", room_pcd(i));
  const std::string shown = on_a_terminal(folder);
  std::vector<std::string> lines = lines_of(shown);
  INFO(shown);
  REQUIRE(lines.size() >= 2);
  CHECK(lines.back().empty());
  lines.pop_back();
  const std::regex form(R"(\[(#*)(\.*)\] (\d+)/(\d+) scans  (\d+) a second  (\d+) s left)");
  double done_before = 0;
  for (const std::string& line : lines) {
    CAPTURE(line);
    std::smatch found;
    REQUIRE(std::regex_match(line, found, form));
    const double done = std::stod(found[3]);
    const double total = std::stod(found[4]);
    const double rate = std::stod(found[5]);
    const double left_s = std::stod(found[6]);
    CHECK(total == scan_count);
    CHECK(done > done_before);
    CHECK(found[1].length() + found[2].length() == 30);
    CHECK(found[1].length() == static_cast<int>(30 * done / total));
    // both are rounded
    CHECK(left_s >= (total - done) / (rate + 0.5) - 0.5);
    CHECK(left_s <= (total - done) / (rate - 0.5) + 0.5);
    done_before = done;
  }
  CHECK(done_before == scan_count);
}

TEST_CASE("without a terminal there is no bar") {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < 3; ++i) folder.write("scans/scan" + std::to_string(i) + ".pcd", room_pcd(i));
  CHECK(run_alces(folder, "map scans --out out").err.empty());
}

}  // namespace
}  // namespace alces::offline
