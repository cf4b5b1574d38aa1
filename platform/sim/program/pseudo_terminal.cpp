#include "pseudo_terminal.h"

// <termios.h> has no termios2 and cannot be included beside the kernel's header that has.
#include <asm/termbits.h>
#include <fcntl.h>
#include <sys/ioctl.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace alces::sim {

bool PseudoTerminal::fail(const std::string& what) {
  error_ = what + ": " + std::generic_category().message(errno);
  device_.reset();
  return false;
}

bool PseudoTerminal::open(const std::string& link) {
  close();
  device_ = FileDescriptor(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!device_) return fail("no pseudo terminal can be had");
  const int descriptor = device_.number();
  std::array<char, 64> name{};
  if (::grantpt(descriptor) != 0 || ::unlockpt(descriptor) != 0 ||
      ::ptsname_r(descriptor, name.data(), name.size()) != 0)
    return fail("the pseudo terminal cannot be handed out");
  // Before anybody opens the other end: its echo would come back to the device as commands.
  termios2 line{};
  if (::ioctl(descriptor, TCGETS2, &line) != 0) return fail("the pseudo terminal cannot be set up");
  line.c_iflag = 0;
  line.c_oflag = 0;
  line.c_lflag = 0;
  line.c_cflag = CS8 | CREAD | CLOCAL | B9600;
  if (::ioctl(descriptor, TCSETS2, &line) != 0) return fail("the pseudo terminal cannot be set up");

  path_ = name.data();
  std::error_code error;
  const std::filesystem::path place(link);
  if (std::filesystem::is_symlink(place, error)) std::filesystem::remove(place, error);
  std::filesystem::create_symlink(path_, place, error);
  if (error) {
    errno = error.value();
    return fail(link + ": the link to the serial line cannot be made");
  }
  link_ = link;
  return true;
}

void PseudoTerminal::close() {
  if (!link_.empty()) {
    // Only our own: another simulator may have taken its place.
    std::error_code ignored;
    if (std::filesystem::read_symlink(link_, ignored) == path_) std::filesystem::remove(link_, ignored);
  }
  link_.clear();
  device_.reset();
}

std::span<const std::uint8_t> PseudoTerminal::read(std::span<std::uint8_t> room) {
  const ssize_t count = ::read(device_.number(), room.data(), room.size());
  if (count <= 0) return {};  // nothing there, or (EIO) nobody
  counters_.bytes_received += static_cast<std::uint64_t>(count);
  return room.first(static_cast<std::size_t>(count));
}

void PseudoTerminal::write(std::span<const std::uint8_t> bytes) {
  const ssize_t count = ::write(device_.number(), bytes.data(), bytes.size());
  const std::size_t sent = count > 0 ? static_cast<std::size_t>(count) : 0;
  counters_.bytes_sent += sent;
  counters_.bytes_lost += bytes.size() - sent;
}

std::uint32_t PseudoTerminal::baud_rate() const {
  termios2 line{};  // asked at the device's end, the kernel answers with the program's
  return ::ioctl(device_.number(), TCGETS2, &line) == 0 ? line.c_ospeed : 0;
}

}  // namespace alces::sim
