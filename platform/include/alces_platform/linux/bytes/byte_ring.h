// Bytes that wait to be sent, in order, in a fixed room.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace alces {

template <std::size_t Capacity>
class ByteRing {
 public:
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  void clear() { size_ = 0; }

  /// All of the bytes, or none: false when there is no room.
  [[nodiscard]] bool push(std::span<const std::uint8_t> bytes) {
    if (bytes.size() > Capacity - size_) return false;
    const std::size_t end = (begin_ + size_) % Capacity;
    const std::size_t first = std::min(bytes.size(), Capacity - end);
    std::ranges::copy(bytes.first(first), data_.begin() + static_cast<std::ptrdiff_t>(end));
    std::ranges::copy(bytes.subspan(first), data_.begin());
    size_ += bytes.size();
    return true;
  }

  /// The oldest bytes, as many as lie in one piece and at most `limit`; at least one when neither is 0.
  [[nodiscard]] std::span<const std::uint8_t> front(std::size_t limit = Capacity) const {
    return {data_.data() + begin_, std::min({limit, size_, Capacity - begin_})};
  }
  void pop(std::size_t count) {
    begin_ = (begin_ + count) % Capacity;
    size_ -= count;
  }

 private:
  std::array<std::uint8_t, Capacity> data_{};
  std::size_t begin_ = 0;
  std::size_t size_ = 0;
};

}  // namespace alces
