// A computer with Linux: nothing to start.
#include <unistd.h>

#include "board.h"

namespace board {

std::size_t stack_used_bytes() {
  return 0;
}

void mark() {
  static_cast<void>(getppid());  // a system call that does nothing, and that a counter sees
}

}  // namespace board
