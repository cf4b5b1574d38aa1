// A line of a GPIO chip that the kernel simulates (gpio-sim): its level is pulled through a file in sysfs,
// and programs that watch the line see an edge, stamped by the kernel.
//
// The simulated interrupt comes from a work queue: two changes within some 0.1 ms may be seen as one edge, or
// none. Source: Documentation/admin-guide/gpio/gpio-sim.rst.
#pragma once

#include <string>

#include "alces_platform/linux/file_descriptor.h"

namespace alces::sim {

class GpioSimLine {
 public:
  /// `chip` as in vehicle.toml: a name, a path, a number or a label; `line`: a number. Pulls it down. False:
  /// error().
  [[nodiscard]] bool open(const std::string& chip, const std::string& line);
  [[nodiscard]] bool is_open() const { return static_cast<bool>(pull_); }
  [[nodiscard]] const std::string& error() const { return error_; }

  void set(bool is_high);

 private:
  FileDescriptor pull_;
  std::string error_;
};

}  // namespace alces::sim
