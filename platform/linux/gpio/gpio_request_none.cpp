// Built where CMake found no libgpiod.
#include "alces_platform/linux/gpio/gpio_request.h"

namespace alces {

const char* GpioRequest::version() {
  return "none";
}

bool GpioRequest::has_sequence_numbers() {
  return false;
}

bool GpioRequest::open(const char* chip_path, std::span<const GpioLine>, const char*, Message& error) {
  error.set("%s: this build has no GPIO; install libgpiod-dev and build again", chip_path);
  return false;
}

void GpioRequest::close() {}

std::size_t GpioRequest::descriptor_count() const {
  return 0;
}

int GpioRequest::descriptor(std::size_t) const {
  return -1;
}

int GpioRequest::read(std::size_t, std::span<StampedEdge>) {
  return 0;
}

}  // namespace alces
