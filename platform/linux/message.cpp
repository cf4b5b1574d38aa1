#include "alces_platform/linux/message.h"

#include <cstdarg>
#include <cstdio>
#include <cstring>

namespace alces {

void Message::set(const char* format, ...) {
  std::va_list arguments;
  va_start(arguments, format);
  const int length = std::vsnprintf(text_.data(), text_.size(), format, arguments);
  va_end(arguments);
  if (length >= static_cast<int>(capacity)) std::memcpy(text_.data() + capacity - 4, "...", 4);
}

Name::Name(const char* text) {
  const std::size_t length = std::strlen(text);
  is_cut_ = length >= capacity;
  std::memcpy(text_.data(), text, is_cut_ ? capacity - 1 : length);
}

}  // namespace alces
