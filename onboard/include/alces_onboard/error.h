// Why alcesd cannot start or go on: one sentence, and the exit status that goes with it.
#pragma once

#include <stdexcept>
#include <string>

namespace alces::onboard {

enum class ExitStatus : int {
  done = 0,
  defect = 1,
  usage = 2,
  configuration = 3,  ///< unreadable, or with values that cannot be
  capacity = 4,       ///< the machine has not the memory or the threads
  device = 5,         ///< a device that will not come by itself, or a file that cannot be written
  motor = 6,          ///< the drive did not confirm that the motor stands without torque
};

class Error : public std::runtime_error {
 public:
  Error(ExitStatus status, const std::string& sentence) : std::runtime_error(sentence), status_(status) {}
  [[nodiscard]] ExitStatus exit_status() const { return status_; }

 private:
  ExitStatus status_;
};

}  // namespace alces::onboard
