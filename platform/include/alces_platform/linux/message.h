// One sentence for people, made where something failed: fixed size, no heap. Longer text is cut, and ends in
// "...".
#pragma once

#include <array>
#include <cstddef>

namespace alces {

class Message {
 public:
  static constexpr std::size_t capacity = 320;

  /// printf's format.
  void set(const char* format, ...) __attribute__((format(printf, 2, 3)));
  void clear() { text_[0] = '\0'; }

  [[nodiscard]] bool empty() const { return text_[0] == '\0'; }
  /// Never null; valid until the next set() or clear().
  [[nodiscard]] const char* text() const { return text_.data(); }

 private:
  std::array<char, capacity> text_{};
};

/// A device's name (a path, an interface, host:port), copied: configurations may die before devices do.
class Name {
 public:
  static constexpr std::size_t capacity = 128;

  Name() = default;
  explicit Name(const char* text);

  [[nodiscard]] const char* text() const { return text_.data(); }
  [[nodiscard]] bool is_cut() const { return is_cut_; }  ///< it did not fit: as good as absent

 private:
  std::array<char, capacity> text_{};
  bool is_cut_ = false;
};

}  // namespace alces
