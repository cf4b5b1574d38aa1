// Wakes a thread that waits for work. The one that waits:
//
//   const Bell::Strokes heard = bell.strokes();
//   if (there is work) do it; else bell.wait(heard);
//
// A stroke between the two lines ends the wait at once, so none is missed. ring() takes no lock: an atomic
// addition, and a system call only when somebody sleeps.
#pragma once

#include <atomic>
#include <cstdint>

namespace alces::onboard {

class Bell {
 public:
  using Strokes = std::uint32_t;

  void ring() {
    strokes_.fetch_add(1, std::memory_order_release);
    strokes_.notify_all();
  }
  [[nodiscard]] Strokes strokes() const { return strokes_.load(std::memory_order_acquire); }
  void wait(Strokes heard) const { strokes_.wait(heard, std::memory_order_acquire); }

 private:
  std::atomic<Strokes> strokes_{0};
};

}  // namespace alces::onboard
