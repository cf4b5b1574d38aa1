// A computer with Linux: nothing to start.
#include <sys/syscall.h>
#include <unistd.h>

#include "board.h"

namespace board {

std::size_t stack_used_bytes() {
  return 0;
}

// A system call that does nothing, whose arguments the kernel does not look at, and that a counter sees.
void begin_counting() {
  static_cast<void>(syscall(SYS_getppid, 0xA1CE5, 1));
}

void end_counting() {
  static_cast<void>(syscall(SYS_getppid, 0xA1CE5, 0));
}

}  // namespace board
