// libgpiod 1: one descriptor and one kernel buffer of 16 edges a line; no sequence numbers.
#include <fcntl.h>
#include <gpiod.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "alces_platform/linux/clock.h"
#include "alces_platform/linux/gpio/gpio_request.h"
#include "gpio_line_number.h"

namespace alces {
namespace {

gpiod_line* as_line(void* line) {
  return static_cast<gpiod_line*>(line);
}

int request_type(GpioEdges edges) {
  switch (edges) {
    case GpioEdges::rising:
      return GPIOD_LINE_REQUEST_EVENT_RISING_EDGE;
    case GpioEdges::falling:
      return GPIOD_LINE_REQUEST_EVENT_FALLING_EDGE;
    case GpioEdges::both:
      break;
  }
  return GPIOD_LINE_REQUEST_EVENT_BOTH_EDGES;
}

int request_flags(const GpioLine& line) {
  int flags = line.is_active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
  switch (line.bias) {
    case GpioBias::as_is:
      break;
    case GpioBias::disabled:
      flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_DISABLE;
      break;
    case GpioBias::pull_up:
      flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP;
      break;
    case GpioBias::pull_down:
      flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN;
      break;
  }
  return flags;
}

}  // namespace

const char* GpioRequest::version() {
  return gpiod_version_string();
}

bool GpioRequest::has_sequence_numbers() {
  return false;
}

bool GpioRequest::open(const char* chip_path, std::span<const GpioLine> lines, const char* consumer,
                       Message& error) {
  close();
  gpiod_chip* const chip = gpiod_chip_open(chip_path);
  if (chip == nullptr) {
    error.set("%s: cannot open the GPIO chip: %s", chip_path, std::strerror(errno));
    return false;
  }
  chip_ = chip;
  for (const GpioLine& wanted : lines) {
    if (line_count_ == line_capacity) break;
    if (wanted.debounce_us != 0) {
      error.set("%s line %s: debouncing by the kernel needs libgpiod 2; leave it to the encoder", chip_path,
                wanted.line);
      close();
      return false;
    }
    const auto number = line_number(wanted.line);
    if (number && *number >= gpiod_chip_num_lines(chip)) {
      error.set("%s: has %u lines, there is no line %s", chip_path, gpiod_chip_num_lines(chip), wanted.line);
      close();
      return false;
    }
    gpiod_line* const line =
        number ? gpiod_chip_get_line(chip, *number) : gpiod_chip_find_line(chip, wanted.line);
    if (line == nullptr) {
      error.set("%s: has no line named \"%s\"; `gpioinfo` lists them", chip_path, wanted.line);
      close();
      return false;
    }
    const gpiod_line_request_config config{
        .consumer = consumer, .request_type = request_type(wanted.edges), .flags = request_flags(wanted)};
    if (gpiod_line_request(line, &config, 0) != 0) {
      const int why = errno;
      gpiod_line_update(line);
      const char* const user = gpiod_line_consumer(line);
      if (why == EBUSY) {
        error.set("%s line %s: in use by %s%s%s; stop that first", chip_path, wanted.line,
                  user != nullptr ? "\"" : "", user != nullptr ? user : "the kernel or another program",
                  user != nullptr ? "\"" : "");
      } else if (why == EPERM || why == EACCES) {
        error.set("%s line %s: no permission to use it", chip_path, wanted.line);
      } else {
        error.set("%s line %s: does not give edges%s: %s", chip_path, wanted.line,
                  wanted.bias != GpioBias::as_is ? " with this bias" : "", std::strerror(why));
      }
      close();
      return false;
    }
    lines_[line_count_++] = line;
    const int descriptor = gpiod_line_event_get_fd(line);
    const int flags = fcntl(descriptor, F_GETFL);
    if (descriptor < 0 || flags < 0 || fcntl(descriptor, F_SETFL, flags | O_NONBLOCK) != 0) {
      error.set("%s line %s: cannot poll it: %s", chip_path, wanted.line, std::strerror(errno));
      close();
      return false;
    }
  }
  return true;
}

void GpioRequest::close() {
  for (std::size_t i = 0; i < line_count_; ++i) gpiod_line_release(as_line(lines_[i]));
  line_count_ = 0;
  if (chip_ != nullptr) gpiod_chip_close(static_cast<gpiod_chip*>(chip_));
  chip_ = nullptr;
}

std::size_t GpioRequest::descriptor_count() const {
  return line_count_;
}

int GpioRequest::descriptor(std::size_t index) const {
  return gpiod_line_event_get_fd(as_line(lines_[index]));
}

int GpioRequest::read(std::size_t index, std::span<StampedEdge> edges) {
  std::array<gpiod_line_event, buffer_v1> events{};
  const auto capacity = static_cast<unsigned>(std::min(edges.size(), events.size()));
  const int count = gpiod_line_event_read_fd_multiple(descriptor(index), events.data(), capacity);
  for (int i = 0; i < count; ++i) {
    const gpiod_line_event& event = events[static_cast<std::size_t>(i)];
    edges[static_cast<std::size_t>(i)] = {
        .stamp_ns = nanoseconds(event.ts),
        .edge = {.line = static_cast<std::uint8_t>(index),
                 .is_rising = event.event_type == GPIOD_LINE_EVENT_RISING_EDGE}};
  }
  return count;
}

}  // namespace alces
