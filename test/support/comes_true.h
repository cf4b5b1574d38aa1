// Waiting for another thread, in tests.
#pragma once

#include <chrono>
#include <thread>

namespace alces::test {

/// Waits for it, at most ten seconds.
template <class Condition>
bool comes_true(Condition condition) {
  for (int i = 0; i < 10'000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

}  // namespace alces::test
