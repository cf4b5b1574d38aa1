// A ring of slots between two threads: one puts in, one takes out, neither ever waits for the other.
//
// Slots stay where they are and are worked on in place: the producer claims the next free one, fills it and
// publishes it; the consumer looks at the front one and pops it. What a slot holds (a scan's points, say) is
// thus never copied by the ring, and never made anew. All calls are O(1), without a lock, a system call or
// the heap; what one thread wrote into a slot before publish() or pop() the other one sees after front() or
// claim().
//
// Memory is the caller's: as many slots as the span has, all of them usable. Waking a consumer that sleeps is
// not the ring's business: bell.h.
#pragma once

#include <atomic>
#include <cstddef>
#include <span>

namespace alces::onboard {

template <class Slot>
class SpscRing {
 public:
  explicit SpscRing(std::span<Slot> slots) : slots_(slots) {}
  SpscRing(const SpscRing&) = delete;
  SpscRing& operator=(const SpscRing&) = delete;

  // The producer's.
  /// The next free slot, as its last user left it; the same one until publish(). Null: the ring is full.
  [[nodiscard]] Slot* claim() {
    const std::size_t pushed = pushed_.load(std::memory_order_relaxed);
    if (distance(popped_.load(std::memory_order_acquire), pushed) == slots_.size()) return nullptr;
    return &slots_[place(pushed)];
  }
  /// The slot that claim() gave is ready. Only after a claim() that was not null.
  void publish() { pushed_.store(next(pushed_.load(std::memory_order_relaxed)), std::memory_order_release); }

  // The consumer's.
  /// The oldest slot that is ready; the same one until pop(). Null: there is none.
  [[nodiscard]] Slot* front() {
    const std::size_t popped = popped_.load(std::memory_order_relaxed);
    if (popped == pushed_.load(std::memory_order_acquire)) return nullptr;
    return &slots_[place(popped)];
  }
  /// The slot that front() gave is free again. Only after a front() that was not null.
  void pop() { popped_.store(next(popped_.load(std::memory_order_relaxed)), std::memory_order_release); }

  // Anybody's.
  [[nodiscard]] std::size_t capacity() const { return slots_.size(); }
  /// Slots that are ready; for either of the two threads a bound on one side, for others a rough figure.
  [[nodiscard]] std::size_t size() const {
    const std::size_t popped = popped_.load(std::memory_order_acquire);
    return distance(popped, pushed_.load(std::memory_order_acquire));
  }

 private:
  // Positions run through twice the capacity, so that full and empty differ.
  [[nodiscard]] std::size_t next(std::size_t position) const {
    return position + 1 == 2 * slots_.size() ? 0 : position + 1;
  }
  [[nodiscard]] std::size_t place(std::size_t position) const {
    return position < slots_.size() ? position : position - slots_.size();
  }
  [[nodiscard]] std::size_t distance(std::size_t from, std::size_t to) const {
    return to >= from ? to - from : to + 2 * slots_.size() - from;
  }

  static constexpr std::size_t cache_line_bytes = 64;
  std::span<Slot> slots_;
  alignas(cache_line_bytes) std::atomic<std::size_t> pushed_{0};
  alignas(cache_line_bytes) std::atomic<std::size_t> popped_{0};
};

}  // namespace alces::onboard
