// Work that is shared out over the cores by TBB.
//
// The thread sanitizer does not see how tasks of a TBB that was not built for it wait for each other, and
// would call every result that is handed over a race. Under it plain threads do the same, so that races in
// the work are found.
#pragma once

#include <cstddef>

#ifdef __SANITIZE_THREAD__
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>
#else
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>
#endif

namespace alces {

#ifndef __SANITIZE_THREAD__

/// body(0) ... body(count - 1), in any order. Each may write what no other touches. An exception ends the
/// work and comes out here.
template <typename Body>
void for_each_index(std::size_t count, const Body& body) {
  tbb::parallel_for(std::size_t{0}, count, body);
}

/// Sorts, not stably: equal elements must not differ.
template <typename Range, typename Less>
void sort_in_parallel(Range& range, const Less& less) {
  tbb::parallel_sort(range, less);
}

#else

template <typename Body>
void for_each_index(std::size_t count, const Body& body) {
  std::atomic<std::size_t> next = 0;
  std::mutex failing;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) body(i);
    } catch (...) {
      next = count;
      const std::lock_guard lock(failing);
      if (!failure) failure = std::current_exception();
    }
  };
  std::vector<std::thread> others(std::min<std::size_t>(count, 3));
  for (std::thread& other : others) other = std::thread(work);
  work();
  for (std::thread& other : others) other.join();
  if (failure) std::rethrow_exception(failure);
}

template <typename Range, typename Less>
void sort_in_parallel(Range& range, const Less& less) {
  std::sort(range.begin(), range.end(), less);
}

#endif

}  // namespace alces
