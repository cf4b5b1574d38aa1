// The newest `capacity_` samples in order of their stamps; a further one takes the place of the oldest.
#pragma once

#include <array>
#include <cstdint>

namespace alces {

/// Sample has a member stamp_ns. push: O(1); upper_bound: O(log capacity), O(1) for the newest few.
template <class Sample, std::uint32_t capacity_>
class StampRing {
 public:
  static constexpr std::uint32_t capacity = capacity_;
  static_assert((capacity & (capacity - 1)) == 0, "a power of two");

  [[nodiscard]] std::uint32_t size() const { return size_; }
  [[nodiscard]] bool is_empty() const { return size_ == 0; }
  [[nodiscard]] bool is_full() const { return size_ == capacity; }

  /// 0 is the oldest.
  [[nodiscard]] const Sample& operator[](std::uint32_t index) const {
    return samples_[(begin_ + index) % capacity];
  }
  [[nodiscard]] const Sample& oldest() const { return (*this)[0]; }
  [[nodiscard]] const Sample& newest() const { return (*this)[size_ - 1]; }

  /// Its stamp must be after the newest one's.
  void push(const Sample& sample) {
    samples_[(begin_ + size_) % capacity] = sample;
    if (is_full()) {
      begin_ = (begin_ + 1) % capacity;
    } else {
      ++size_;
    }
  }

  void clear() { begin_ = size_ = 0; }
  /// Forgets the newest ones, down to `size`.
  void shrink_to(std::uint32_t size) { size_ = size < size_ ? size : size_; }

  /// Index of the first sample after the stamp; size() if there is none.
  [[nodiscard]] std::uint32_t upper_bound(std::int64_t stamp_ns) const {
    std::uint32_t low = 0;
    std::uint32_t high = size_;
    for (std::uint32_t near = 1; near < size_;
         near *= 2) {  // doubling back from the newest: that is where one asks
      if ((*this)[size_ - near].stamp_ns <= stamp_ns) {
        low = size_ - near + 1;
        break;
      }
      high = size_ - near;
    }
    while (low < high) {
      const std::uint32_t middle = low + (high - low) / 2;
      if ((*this)[middle].stamp_ns <= stamp_ns) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }

 private:
  std::array<Sample, capacity> samples_{};
  std::uint32_t begin_ = 0;
  std::uint32_t size_ = 0;
};

}  // namespace alces
