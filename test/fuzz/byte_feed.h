// An input taken apart from its front: numbers, then zeros when it is at its end.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>

namespace alces::fuzz {

class ByteFeed {
 public:
  explicit ByteFeed(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  template <typename Number>
  [[nodiscard]] Number number() {
    Number value{};
    const std::span<const std::uint8_t> from = bytes(sizeof value);
    std::memcpy(&value, from.data(), from.size());
    return value;
  }
  [[nodiscard]] std::uint8_t byte() { return number<std::uint8_t>(); }
  /// Fewer at the end.
  [[nodiscard]] std::span<const std::uint8_t> bytes(std::size_t count) {
    const auto taken = rest_.first(std::min(count, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  [[nodiscard]] bool is_empty() const { return rest_.empty(); }

 private:
  std::span<const std::uint8_t> rest_;
};

}  // namespace alces::fuzz
