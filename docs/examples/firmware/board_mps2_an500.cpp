// Start of a Cortex-M7 on Arm's MPS2 board (application note 500), real or QEMU's: vectors, floating-point
// unit, memory, main. Output goes to the debugger by semihosting (newlib's rdimon).
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "board.h"

extern "C" {
int main();
void __libc_init_array();           // newlib: constructors
void initialise_monitor_handles();  // rdimon: opens stdout
void reset();
void fault();

// Addresses that the linker script knows.
extern std::uint32_t data_load_begin[], data_begin[], data_end[], bss_begin[], bss_end[];
void _init() {}  // newlib calls them; crti.o, which is not linked, would hold them
void _fini() {}

extern std::uint32_t stack_low[], stack_high[];
}

namespace {
constexpr std::uint32_t untouched = 0x5AFE57AC;
volatile std::uint32_t& coprocessor_access = *reinterpret_cast<volatile std::uint32_t*>(0xE000ED88);

// Armv7-M, B1.5.3: the initial stack pointer, then the handlers of reset and of what else can happen without
// interrupts.
struct Vectors {
  std::uint32_t* stack;
  void (*handlers[15])();
};
__attribute__((section(".vectors"), used))
const Vectors vectors = {stack_high,
                         {reset, fault, fault, fault, fault, fault, nullptr, nullptr, nullptr, nullptr, fault,
                          fault, nullptr, fault, fault}};

// Everything under the caller's frame is painted, so that one sees later how deep the stack has been.
void paint_stack() {
  const auto* const here = static_cast<std::uint32_t*>(__builtin_frame_address(0));
  for (std::uint32_t* word = stack_low; word < here - 64; ++word) *word = untouched;
}
}  // namespace

void reset() {
  coprocessor_access = coprocessor_access | (0xFU << 20);  // the floating-point unit, for everybody
  __asm volatile("dsb\n isb" ::: "memory");
  std::copy(data_load_begin, data_load_begin + (data_end - data_begin), data_begin);
  std::fill(bss_begin, bss_end, 0);
  paint_stack();
  initialise_monitor_handles();
  __libc_init_array();
  std::exit(main());
}

void fault() {
  std::exit(70);  // what a debugger would stop at; QEMU ends with this status
}

namespace board {

std::size_t stack_used_bytes() {
  const std::uint32_t* deepest = stack_low;
  while (deepest < stack_high && *deepest == untouched) ++deepest;
  return static_cast<std::size_t>(stack_high - deepest) * sizeof(std::uint32_t);
}

void begin_counting() {}

void end_counting() {}

}  // namespace board
