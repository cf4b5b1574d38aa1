// Replaces malloc and its kin, and operator new, of the program that includes this: while it is armed, every
// allocation on every thread is counted. For programs of one source file, with glibc, without sanitizers.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace alces::test {

inline std::atomic<bool> is_armed{false};
inline std::atomic<unsigned> allocations{0};

inline void count_allocation() {
  if (is_armed.load(std::memory_order_relaxed)) allocations.fetch_add(1, std::memory_order_relaxed);
}

/// Whether malloc and new are counted. Compilers leave out what is freed unseen, hence volatile.
inline bool trap_springs() {
  is_armed = true;
  void* volatile memory = std::malloc(100);
  std::free(memory);
  int* volatile number = new int(3);
  delete number;
  is_armed = false;
  return allocations.exchange(0) == 2;
}

}  // namespace alces::test

extern "C" {
void* __libc_malloc(std::size_t);                 // NOLINT(bugprone-reserved-identifier)
void* __libc_calloc(std::size_t, std::size_t);    // NOLINT(bugprone-reserved-identifier)
void* __libc_realloc(void*, std::size_t);         // NOLINT(bugprone-reserved-identifier)
void* __libc_memalign(std::size_t, std::size_t);  // NOLINT(bugprone-reserved-identifier)
void __libc_free(void*);                          // NOLINT(bugprone-reserved-identifier)

void* malloc(std::size_t bytes) {
  alces::test::count_allocation();
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  alces::test::count_allocation();
  return __libc_calloc(count, bytes);
}
void* realloc(void* memory, std::size_t bytes) {
  alces::test::count_allocation();
  return __libc_realloc(memory, bytes);
}
void* memalign(std::size_t alignment, std::size_t bytes) {
  alces::test::count_allocation();
  return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  alces::test::count_allocation();
  return __libc_memalign(alignment, bytes);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) {
  alces::test::count_allocation();
  *memory = __libc_memalign(alignment, bytes);
  return *memory == nullptr ? 12 : 0;  // ENOMEM
}
}

void* operator new(std::size_t bytes) {
  alces::test::count_allocation();
  if (void* const memory = __libc_malloc(bytes)) return memory;
  std::abort();
}
void operator delete(void* memory) noexcept {
  __libc_free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  __libc_free(memory);
}
