#include "alces_onboard/error.h"

#include <poll.h>
#include <unistd.h>

#include <cstdlib>

namespace alces::onboard {

void leave_process(ExitStatus status, const std::string& sentence) {
  const std::string line = "alcesd: " + sentence + "\n";
  // A terminal that takes nothing must not keep the end waiting.
  pollfd terminal{STDERR_FILENO, POLLOUT, 0};
  if (::poll(&terminal, 1, 0) == 1 && ::write(STDERR_FILENO, line.data(), line.size()) < 0) {
    // Nobody reads any more: the exit status says it, too.
  }
  std::_Exit(static_cast<int>(status));
}

}  // namespace alces::onboard
