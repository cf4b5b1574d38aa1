#include "stop_signal.h"

#include <atomic>

namespace alces::offline {
namespace {

std::atomic<int> signal_received{0};
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler may not wait");

void note(int number) {
  signal_received.store(number, std::memory_order_relaxed);
}

}  // namespace

StopSignal::StopSignal() {
  signal_received.store(0, std::memory_order_relaxed);
  struct sigaction action {};
  action.sa_handler = note;
  action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &old_interrupt_);
  sigaction(SIGTERM, &action, &old_terminate_);
}

StopSignal::~StopSignal() {
  sigaction(SIGINT, &old_interrupt_, nullptr);
  sigaction(SIGTERM, &old_terminate_, nullptr);
}

int StopSignal::received() const {
  return signal_received.load(std::memory_order_relaxed);
}

}  // namespace alces::offline
