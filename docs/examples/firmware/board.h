// What differs between a microcontroller and a computer with an operating system.
#pragma once

#include <cstddef>

#ifdef FIRMWARE_ON_A_BOARD
/// Memory of its own for what is large; the linker script says where it lies.
#define IN_ARENA_MEMORY __attribute__((section(".arena")))
#else
#define IN_ARENA_MEMORY
#endif

namespace board {

/// Bytes of stack that were used since the start, at most; 0 where nobody knows.
[[nodiscard]] std::size_t stack_used_bytes();

/// Tells a counter of instructions outside (test/cross) that a stretch of interest begins, or ends.
void begin_counting();
void end_counting();

}  // namespace board
