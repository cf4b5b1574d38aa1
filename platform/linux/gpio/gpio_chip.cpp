// Which chip is meant; the kernel's own interface answers, whatever libgpiod there is.
#include <fcntl.h>
#include <linux/gpio.h>
#include <sys/ioctl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "alces_platform/linux/file_descriptor.h"
#include "alces_platform/linux/gpio/gpio_lines.h"

namespace alces {
namespace {

constexpr int highest_chip = 255;

bool is_number(const char* text) {
  return *text != '\0' &&
         std::all_of(text, text + std::strlen(text), [](char c) { return c >= '0' && c <= '9'; });
}

/// Opens it, so that the error is that of opening.
bool check_chip(const char* path, Message& error) {
  const FileDescriptor chip(::open(path, O_RDWR | O_CLOEXEC | O_NONBLOCK));
  if (!chip) {
    if (errno == ENOENT || errno == ENODEV || errno == ENXIO) {
      error.set("%s: no such GPIO chip; `gpiodetect` lists them", path);
    } else if (errno == EACCES || errno == EPERM) {
      error.set(
          "%s: no permission; add the user to the group of this file (often gpio) or install the udev rule",
          path);
    } else {
      error.set("%s: cannot open the GPIO chip: %s", path, std::strerror(errno));
    }
    return false;
  }
  gpiochip_info information{};
  if (ioctl(chip.number(), GPIO_GET_CHIPINFO_IOCTL, &information) != 0) {
    error.set("%s: is no GPIO chip; `gpiodetect` lists them", path);
    return false;
  }
  return true;
}

}  // namespace

bool find_gpio_chip(const char* chip, Name& path, Message& error) {
  std::array<char, Name::capacity> candidate{};
  if (chip[0] == '/') {
    path = Name(chip);
    return check_chip(path.text(), error);
  }
  if (is_number(chip) || std::strncmp(chip, "gpiochip", 8) == 0) {
    std::snprintf(candidate.data(), candidate.size(), is_number(chip) ? "/dev/gpiochip%.20s" : "/dev/%.64s",
                  chip);
    path = Name(candidate.data());
    return check_chip(path.text(), error);
  }
  bool is_forbidden = false;
  for (int number = 0; number <= highest_chip; ++number) {
    std::snprintf(candidate.data(), candidate.size(), "/dev/gpiochip%d", number);
    const FileDescriptor descriptor(::open(candidate.data(), O_RDWR | O_CLOEXEC | O_NONBLOCK));
    is_forbidden = is_forbidden || (!descriptor && (errno == EACCES || errno == EPERM));
    gpiochip_info information{};
    if (!descriptor || ioctl(descriptor.number(), GPIO_GET_CHIPINFO_IOCTL, &information) != 0) continue;
    if (std::strncmp(information.label, chip, sizeof information.label) != 0) continue;
    path = Name(candidate.data());
    return true;
  }
  error.set("%s: no GPIO chip has this label%s; `gpiodetect` lists them", chip,
            is_forbidden
                ? " among those that may be opened (add the user to the group of /dev/gpiochip*, often gpio)"
                : "");
  return false;
}

}  // namespace alces
