// A list of at most `capacity` things in place: what configurations use for tables, without a heap.
#pragma once

#include <array>
#include <cstddef>
#include <initializer_list>
#include <span>

namespace alces {

template <class T, std::size_t capacity_>
class StaticVector {
 public:
  static constexpr std::size_t capacity = capacity_;

  constexpr StaticVector() = default;
  /// What does not fit is left out, and is_complete() says so.
  constexpr StaticVector(std::initializer_list<T> entries) {
    for (const T& entry : entries) is_complete_ = add(entry) && is_complete_;
  }

  /// False, and nothing changes, when the table is full.
  [[nodiscard]] constexpr bool add(const T& entry) {
    if (count_ == capacity_) return false;
    entries_[count_++] = entry;
    return true;
  }
  constexpr void clear() {
    count_ = 0;
    is_complete_ = true;
  }

  [[nodiscard]] constexpr std::size_t size() const { return count_; }
  [[nodiscard]] constexpr bool is_empty() const { return count_ == 0; }
  [[nodiscard]] constexpr bool is_complete() const { return is_complete_; }
  [[nodiscard]] constexpr std::span<const T> span() const { return {entries_.data(), count_}; }
  [[nodiscard]] constexpr const T& operator[](std::size_t entry) const { return entries_[entry]; }
  [[nodiscard]] constexpr T& operator[](std::size_t entry) { return entries_[entry]; }
  [[nodiscard]] constexpr const T* begin() const { return entries_.data(); }
  [[nodiscard]] constexpr const T* end() const { return entries_.data() + count_; }

 private:
  std::array<T, capacity_> entries_{};
  std::size_t count_ = 0;
  bool is_complete_ = true;
};

}  // namespace alces
