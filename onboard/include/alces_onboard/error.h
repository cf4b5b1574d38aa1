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
  hung = 7,           ///< a thread did not come back from a call of the system, and was left
};

class Error : public std::runtime_error {
 public:
  Error(ExitStatus status, const std::string& sentence) : std::runtime_error(sentence), status_(status) {}
  [[nodiscard]] ExitStatus exit_status() const { return status_; }

 private:
  ExitStatus status_;
};

/// Says the sentence and ends the process at once, without destructors: for when a thread had to be left that
/// still uses what they would take away.
[[noreturn]] void leave_process(ExitStatus status, const std::string& sentence);

}  // namespace alces::onboard
