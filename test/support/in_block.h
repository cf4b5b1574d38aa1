// A structure of the library in a block of exactly the size that its own plan asks for.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>

#include "alces/arena.h"

namespace alces::test {

/// Bytes on the heap that start where an arena wants them to.
class Block {
 public:
  explicit Block(std::size_t bytes)
      : size_(bytes), data_(new (std::align_val_t{Arena::alignment}) std::byte[bytes + 1]) {}
  [[nodiscard]] std::span<std::byte> bytes() const { return {data_.get(), size_}; }

 private:
  struct Release {
    void operator()(std::byte* data) const { operator delete[](data, std::align_val_t{Arena::alignment}); }
  };
  std::size_t size_;
  std::unique_ptr<std::byte[], Release> data_;
};

template <typename T>
class InBlock {
 public:
  template <typename... Arguments>
  explicit InBlock(const Arguments&... arguments)
      : block_(plan(arguments...)), arena_(block_.bytes()), value_(arena_, arguments...) {
    if (arena_.overflowed() || arena_.used_bytes() != block_.bytes().size()) std::abort();
  }
  InBlock(const InBlock&) = delete;
  InBlock& operator=(const InBlock&) = delete;

  T& operator*() { return value_; }
  T* operator->() { return &value_; }
  const T& operator*() const { return value_; }
  const T* operator->() const { return &value_; }

 private:
  template <typename... Arguments>
  static std::size_t plan(const Arguments&... arguments) {
    Arena counting;
    const T counted(counting, arguments...);
    return counting.used_bytes();
  }

  Block block_;
  Arena arena_;
  T value_;
};

}  // namespace alces::test
