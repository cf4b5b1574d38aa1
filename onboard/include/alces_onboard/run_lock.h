// Which alcesd runs on this machine: a lock on a file in the folder for such files, by which
// `alcesd --reset-motor` finds it. $RUNTIME_DIRECTORY (systemd's), else $XDG_RUNTIME_DIR, else /run/alces.
#pragma once

#include "alces_platform/linux/file_descriptor.h"
#include "alces_platform/linux/message.h"

namespace alces::onboard {

class RunLock {
 public:
  /// Held until the process ends. False: error() says why; another one may run.
  [[nodiscard]] bool take();
  [[nodiscard]] const char* error() const { return error_.text(); }

 private:
  FileDescriptor file_;
  Message error_;
};

/// Sends SIGUSR1 to the one that holds the lock. Error with ExitStatus::device where there is none, or where
/// it may not be sent a signal.
void reset_motor_of_running_program();

}  // namespace alces::onboard
