// A thread whose end is waited for only so long. One that hangs in a call of the system (a disk that is
// stalled, a terminal that was stopped with Ctrl-S) cannot be ended: it is left, and what it uses must stay
// as it is until the process is gone. Whoever leaves one therefore ends the process without destructors
// (leave_process() in error.h).
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

#include "alces_drivers/stamp.h"

namespace alces::onboard {

class LeavableThread {
 public:
  LeavableThread() = default;
  LeavableThread(const LeavableThread&) = delete;
  LeavableThread& operator=(const LeavableThread&) = delete;
  /// Waits for a thread that was not joined, however long it takes.
  ~LeavableThread() {
    if (thread_.joinable()) thread_.join();
  }

  /// std::system_error when the system has no more threads.
  template <class Work>
  void start(Work work) {
    is_done_.store(false, std::memory_order_relaxed);
    thread_ = std::thread([this, work] {
      work();
      is_done_.store(true, std::memory_order_release);
    });
  }
  [[nodiscard]] bool is_running() const { return thread_.joinable(); }
  /// Its work is done, or there is none.
  [[nodiscard]] bool is_done() const { return !is_running() || is_done_.load(std::memory_order_acquire); }

  /// False: it did not end in time, and still runs.
  [[nodiscard]] bool join_within(std::int64_t limit_ns) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::nanoseconds(limit_ns);
    while (!is_done()) {
      if (std::chrono::steady_clock::now() >= deadline) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (thread_.joinable()) thread_.join();
    return true;
  }

 private:
  std::thread thread_;
  std::atomic<bool> is_done_{false};
};

}  // namespace alces::onboard
