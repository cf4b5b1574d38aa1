// What a program is at, for the one sentence that is left to say when memory runs out: kept in fixed memory,
// set and read without the heap. Of the main thread.
//
//   const Doing doing("writing", out);
//
// It is forgotten at the end of its scope, unless an exception leaves it: then it is what failed.
#pragma once

#include <array>
#include <exception>
#include <string_view>

namespace alces {

class Doing {
 public:
  explicit Doing(std::string_view what, std::string_view of = {})
      : before_(text()), exceptions_(std::uncaught_exceptions()) {
    std::size_t size = 0;
    for (const std::string_view part : {what, std::string_view(of.empty() ? "" : " "), of}) {
      for (const char c : part) {
        if (size + 1 < before_.size()) text()[size++] = c;
      }
    }
    text()[size] = '\0';
  }
  Doing(const Doing&) = delete;
  Doing& operator=(const Doing&) = delete;
  ~Doing() {
    if (std::uncaught_exceptions() <= exceptions_) text() = before_;
  }

  /// "" when nothing was said.
  [[nodiscard]] static const char* what() { return text().data(); }

 private:
  using Text = std::array<char, 256>;
  static Text& text() {
    static Text kept{};
    return kept;
  }

  Text before_;
  int exceptions_;
};

}  // namespace alces
