// How late poses are: from a scan's last ray to its pose, with all that a loop takes.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace alces::onboard {

class ScanLatency {
 public:
  void add(std::int64_t latency_ns) {
    newest_[count_++ % newest_.size()] = latency_ns;
    worst_ns_ = std::max(worst_ns_, latency_ns);
  }
  /// Of the last 64; 0: there is none.
  [[nodiscard]] std::int64_t median_ns() const {
    std::array<std::int64_t, capacity> sorted = newest_;
    const std::size_t known = std::min(count_, capacity);
    if (known == 0) return 0;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(known / 2);
    std::nth_element(sorted.begin(), middle, sorted.begin() + static_cast<std::ptrdiff_t>(known));
    return *middle;
  }
  /// Of all.
  [[nodiscard]] std::int64_t worst_ns() const { return worst_ns_; }

 private:
  static constexpr std::size_t capacity = 64;
  std::array<std::int64_t, capacity> newest_{};
  std::size_t count_ = 0;
  std::int64_t worst_ns_ = 0;
};

}  // namespace alces::onboard
