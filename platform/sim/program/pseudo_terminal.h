// The device's end of a serial line that is no cable: a pseudo terminal, whose other end a program opens by a
// symbolic link, as it would open /dev/ttyUSB0.
//
// No bits travel, so nothing takes time and any two rates understand each other; but the rate that the
// program has set can be asked for, and the simulated line does the rest. What is written while nobody has
// the line open is lost, and so is what does not fit the kernel's 4 KiB: a cable keeps nothing either.
// Sources: pty(7), ioctl_tty(2).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "alces_platform/linux/file_descriptor.h"

namespace alces::sim {

class PseudoTerminal {
 public:
  struct Counters {
    std::uint64_t bytes_received = 0;
    std::uint64_t bytes_sent = 0;
    std::uint64_t bytes_lost = 0;  ///< nobody there, or too slow
  };

  PseudoTerminal() = default;
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;
  ~PseudoTerminal() { close(); }

  /// Makes one, raw, and `link` to it; a link that is there is replaced, another file is not. False: error().
  [[nodiscard]] bool open(const std::string& link);
  /// The program at the other end sees a hang-up, as with an adapter that is unplugged. Removes the link.
  void close();
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] const std::string& link() const { return link_; }
  [[nodiscard]] bool is_open() const { return static_cast<bool>(device_); }

  /// What the program has sent: as much as is there and fits, perhaps nothing.
  [[nodiscard]] std::span<const std::uint8_t> read(std::span<std::uint8_t> room);
  void write(std::span<const std::uint8_t> bytes);
  /// The rate that the program has set, baud.
  [[nodiscard]] std::uint32_t baud_rate() const;

  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  [[nodiscard]] bool fail(const std::string& what);

  FileDescriptor device_;
  std::string link_;
  std::string path_;
  std::string error_;
  Counters counters_;
};

}  // namespace alces::sim
