#include "gpio_sim_line.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "alces_platform/linux/gpio/gpio_lines.h"
#include "alces_platform/linux/message.h"

namespace alces::sim {

bool GpioSimLine::open(const std::string& chip, const std::string& line) {
  Name device;
  Message message;
  if (!find_gpio_chip(chip.c_str(), device, message)) {
    error_ = message.text();
    return false;
  }
  const std::string name = std::filesystem::path(device.text()).filename();
  const std::string file = "/sys/bus/gpio/devices/" + name + "/sim_gpio" + line + "/pull";
  pull_ = FileDescriptor(::open(file.c_str(), O_WRONLY | O_CLOEXEC));
  if (!pull_) {
    error_ = errno == ENOENT ? chip + " has no simulated line " + line +
                                   "; the chip must be one of gpio-sim, and lines be given by their numbers"
                             : file + ": " + std::generic_category().message(errno);
    return false;
  }
  set(false);
  return true;
}

void GpioSimLine::set(bool is_high) {
  const std::string_view level = is_high ? "pull-up" : "pull-down";
  [[maybe_unused]] const ssize_t written = ::pwrite(pull_.number(), level.data(), level.size(), 0);
}

}  // namespace alces::sim
