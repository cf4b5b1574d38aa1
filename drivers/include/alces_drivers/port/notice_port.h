// What a driver has to say to people: every event that it can raise has a source, a severity and a text.
#pragma once

#include <cstdint>

namespace alces {

enum class Severity : std::uint8_t { info, warning, error };
/// "info", "warning", "error".
[[nodiscard]] const char* to_string(Severity severity);

struct Notice {
  std::int64_t stamp_ns = 0;
  Severity severity = Severity::info;
  const char* source = "";  ///< "motor", "laser a", "encoder", ...: static storage
  const char* text =
      "";  ///< one clause that says what happened and, where one can, what to do: static storage
  std::int64_t value = 0;  ///< the number that goes with it (an abort code, a count); 0 where none does
  bool has_value = false;
  bool is_hexadecimal = false;  ///< the value is an object, an abort code: for people in hexadecimal
};

class NoticePort {
 public:
  virtual void raise(const Notice& notice) = 0;

 protected:
  ~NoticePort() = default;
};

}  // namespace alces
