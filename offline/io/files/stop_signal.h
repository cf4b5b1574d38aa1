// Ctrl-C and SIGTERM as a question that can be asked between two scans.
#pragma once

#include <csignal>

namespace alces::offline {

/// While it lives, the first SIGINT or SIGTERM is noted; a second one ends the program as usual. One at a
/// time.
class StopSignal {
 public:
  StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;
  ~StopSignal();

  /// The signal that came, 0 for none.
  [[nodiscard]] int received() const;

 private:
  struct sigaction old_interrupt_ {};
  struct sigaction old_terminate_ {};
};

}  // namespace alces::offline
