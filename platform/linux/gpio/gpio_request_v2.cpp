// libgpiod 2: one request, one descriptor and one kernel buffer for all lines; edges are numbered.
#include <fcntl.h>
#include <gpiod.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

#include "alces_platform/linux/gpio/gpio_request.h"
#include "gpio_line_number.h"

namespace alces {
namespace {

constexpr std::size_t kernel_buffer = 1024;  ///< edges; the most that the kernel grants

/// Calls the library's own function to free one of its objects.
template <auto function>
struct Free {
  template <class Object>
  void operator()(Object* object) const {
    function(object);
  }
};
using ChipInfo = std::unique_ptr<gpiod_chip_info, Free<gpiod_chip_info_free>>;
using LineInfo = std::unique_ptr<gpiod_line_info, Free<gpiod_line_info_free>>;
using LineSettings = std::unique_ptr<gpiod_line_settings, Free<gpiod_line_settings_free>>;
using LineConfig = std::unique_ptr<gpiod_line_config, Free<gpiod_line_config_free>>;
using RequestConfig = std::unique_ptr<gpiod_request_config, Free<gpiod_request_config_free>>;

gpiod_line_edge edge_detection(GpioEdges edges) {
  switch (edges) {
    case GpioEdges::rising:
      return GPIOD_LINE_EDGE_RISING;
    case GpioEdges::falling:
      return GPIOD_LINE_EDGE_FALLING;
    case GpioEdges::both:
      break;
  }
  return GPIOD_LINE_EDGE_BOTH;
}

gpiod_line_bias line_bias(GpioBias bias) {
  switch (bias) {
    case GpioBias::disabled:
      return GPIOD_LINE_BIAS_DISABLED;
    case GpioBias::pull_up:
      return GPIOD_LINE_BIAS_PULL_UP;
    case GpioBias::pull_down:
      return GPIOD_LINE_BIAS_PULL_DOWN;
    case GpioBias::as_is:
      break;
  }
  return GPIOD_LINE_BIAS_AS_IS;
}

/// The line's number on the chip; nothing, and the reason, when there is no such line.
std::optional<unsigned> find_line(gpiod_chip* chip, const char* chip_path, const char* line, Message& error) {
  if (const auto number = line_number(line)) {
    const ChipInfo information(gpiod_chip_get_info(chip));
    const std::size_t count = information ? gpiod_chip_info_get_num_lines(information.get()) : 0;
    if (*number < count) return number;
    error.set("%s: has %zu lines, there is no line %s", chip_path, count, line);
    return std::nullopt;
  }
  const int offset = gpiod_chip_get_line_offset_from_name(chip, line);
  if (offset >= 0) return static_cast<unsigned>(offset);
  error.set("%s: has no line named \"%s\"; `gpioinfo` lists them", chip_path, line);
  return std::nullopt;
}

/// Why the kernel refused: the first line that is in use, if one is.
void explain(gpiod_chip* chip, const char* chip_path, std::span<const GpioLine> lines,
             std::span<const unsigned> offsets, int why, Message& error) {
  for (std::size_t i = 0; why == EBUSY && i < offsets.size(); ++i) {
    const LineInfo information(gpiod_chip_get_line_info(chip, offsets[i]));
    if (!information || !gpiod_line_info_is_used(information.get())) continue;
    const char* const user = gpiod_line_info_get_consumer(information.get());
    error.set("%s line %s: in use by %s%s%s; stop that first", chip_path, lines[i].line,
              user != nullptr ? "\"" : "", user != nullptr ? user : "the kernel or another program",
              user != nullptr ? "\"" : "");
    return;
  }
  if (why == EPERM || why == EACCES) {
    error.set("%s: no permission to use its lines", chip_path);
  } else {
    error.set("%s: its lines do not give edges as asked for (edges, bias, debouncing): %s", chip_path,
              std::strerror(why));
  }
}

}  // namespace

const char* GpioRequest::version() {
  return gpiod_api_version();
}

bool GpioRequest::has_sequence_numbers() {
  return true;
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
  const LineConfig line_config(gpiod_line_config_new());
  const RequestConfig request_config(gpiod_request_config_new());
  const LineSettings settings(gpiod_line_settings_new());
  gpiod_edge_event_buffer* const buffer = gpiod_edge_event_buffer_new(read_capacity);
  buffer_ = buffer;
  if (!line_config || !request_config || !settings || buffer == nullptr) {
    error.set("%s: no memory for a request of lines", chip_path);
    close();
    return false;
  }
  for (const GpioLine& wanted : lines.first(std::min(lines.size(), line_capacity))) {
    const auto offset = find_line(chip, chip_path, wanted.line, error);
    if (!offset) {
      close();
      return false;
    }
    if (std::ranges::count(std::span(offsets_).first(line_count_), *offset) != 0) {
      error.set("%s line %s: asked for twice", chip_path, wanted.line);
      close();
      return false;
    }
    gpiod_line_settings_reset(settings.get());
    gpiod_line_settings_set_active_low(settings.get(), wanted.is_active_low);
    gpiod_line_settings_set_debounce_period_us(settings.get(), wanted.debounce_us);
    if (gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_INPUT) != 0 ||
        gpiod_line_settings_set_edge_detection(settings.get(), edge_detection(wanted.edges)) != 0 ||
        gpiod_line_settings_set_bias(settings.get(), line_bias(wanted.bias)) != 0 ||
        gpiod_line_settings_set_event_clock(settings.get(), GPIOD_LINE_CLOCK_MONOTONIC) != 0 ||
        gpiod_line_config_add_line_settings(line_config.get(), &*offset, 1, settings.get()) != 0) {
      error.set("%s line %s: libgpiod does not take these settings: %s", chip_path, wanted.line,
                std::strerror(errno));
      close();
      return false;
    }
    offsets_[line_count_++] = *offset;
  }
  gpiod_request_config_set_consumer(request_config.get(), consumer);
  gpiod_request_config_set_event_buffer_size(request_config.get(), kernel_buffer);
  gpiod_line_request* const request = gpiod_chip_request_lines(chip, request_config.get(), line_config.get());
  if (request == nullptr) {
    explain(chip, chip_path, lines, std::span(offsets_).first(line_count_), errno, error);
    close();
    return false;
  }
  request_ = request;
  const int polled = gpiod_line_request_get_fd(request);
  const int flags = fcntl(polled, F_GETFL);
  if (flags < 0 || fcntl(polled, F_SETFL, flags | O_NONBLOCK) != 0) {
    error.set("%s: cannot poll its lines: %s", chip_path, std::strerror(errno));
    close();
    return false;
  }
  return true;
}

void GpioRequest::close() {
  if (request_ != nullptr) gpiod_line_request_release(static_cast<gpiod_line_request*>(request_));
  if (buffer_ != nullptr) gpiod_edge_event_buffer_free(static_cast<gpiod_edge_event_buffer*>(buffer_));
  if (chip_ != nullptr) gpiod_chip_close(static_cast<gpiod_chip*>(chip_));
  request_ = nullptr;
  buffer_ = nullptr;
  chip_ = nullptr;
  line_count_ = 0;
}

std::size_t GpioRequest::descriptor_count() const {
  return request_ != nullptr ? 1 : 0;
}

int GpioRequest::descriptor(std::size_t) const {
  return gpiod_line_request_get_fd(static_cast<gpiod_line_request*>(request_));
}

int GpioRequest::read(std::size_t, std::span<StampedEdge> edges) {
  auto* const buffer = static_cast<gpiod_edge_event_buffer*>(buffer_);
  const int count = gpiod_line_request_read_edge_events(static_cast<gpiod_line_request*>(request_), buffer,
                                                        std::min(edges.size(), read_capacity));
  for (int i = 0; i < count; ++i) {
    gpiod_edge_event* const event = gpiod_edge_event_buffer_get_event(buffer, static_cast<unsigned>(i));
    const auto known = std::span(offsets_).first(line_count_);
    const auto line = std::ranges::find(known, gpiod_edge_event_get_line_offset(event)) - known.begin();
    edges[static_cast<std::size_t>(i)] = {
        .stamp_ns = static_cast<std::int64_t>(gpiod_edge_event_get_timestamp_ns(event)),
        .edge = {.line = static_cast<std::uint8_t>(line),
                 .is_rising = gpiod_edge_event_get_event_type(event) == GPIOD_EDGE_EVENT_RISING_EDGE,
                 .sequence = static_cast<std::uint32_t>(gpiod_edge_event_get_line_seqno(event))}};
  }
  return count;
}

}  // namespace alces
