// One block of memory, handed out from the front, never given back.
//
// An Arena without a block counts: the same constructors that lay out the real structures, run on a
// counting arena, say how many bytes they will need. Plan and allocation are one code path and cannot
// drift apart. Everything here is constexpr, so that the plan can size a `static` array.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>

namespace alces {

class Arena {
 public:
  /// Every array starts on a cache line; so must the block.
  static constexpr std::size_t alignment = 64;

  /// Counts bytes; its arrays are empty spans.
  constexpr Arena() = default;

  /// Hands out `block`, which must start on an `alignment` boundary and outlive everything in it.
  constexpr explicit Arena(std::span<std::byte> block) : block_(block), counting_(false) {}

  /// An array of `count` value-initialised T. Empty while counting; empty, and `overflowed()` from
  /// then on, when the block has no room left. O(count).
  template <typename T>
  constexpr std::span<T> allocate(std::size_t count) {
    static_assert(std::is_trivially_destructible_v<T>, "an arena runs no destructors");
    static_assert(alignof(T) <= alignment);
    const std::size_t begin = used_;
    if (begin > SIZE_MAX / 2 || count > (SIZE_MAX / 2 - begin) / sizeof(T)) {
      overflowed_ = true;
      return {};
    }
    const std::size_t end = begin + (count * sizeof(T) + alignment - 1) / alignment * alignment;
    if (counting_) {
      used_ = end;
      return {};
    }
    if (end > block_.size()) {
      overflowed_ = true;
      return {};
    }
    used_ = end;
    T* first = reinterpret_cast<T*>(block_.data() + begin);
    std::uninitialized_value_construct_n(first, count);
    return {first, count};
  }

  [[nodiscard]] constexpr std::size_t used_bytes() const { return used_; }
  [[nodiscard]] constexpr bool overflowed() const { return overflowed_; }

 private:
  std::span<std::byte> block_{};
  std::size_t used_ = 0;
  bool counting_ = true;
  bool overflowed_ = false;
};

}  // namespace alces
