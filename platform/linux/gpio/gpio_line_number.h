// "17" is a number, "encoder-index" a name.
#pragma once

#include <cstdint>
#include <optional>

namespace alces {

[[nodiscard]] inline std::optional<unsigned> line_number(const char* text) {
  unsigned number = 0;
  if (*text == '\0') return std::nullopt;
  for (; *text != '\0'; ++text) {
    if (*text < '0' || *text > '9' || number > 100'000) return std::nullopt;
    number = number * 10 + static_cast<unsigned>(*text - '0');
  }
  return number;
}

}  // namespace alces
