#include "alces_offline/text_numbers.h"

#include <charconv>
#include <limits>
#include <system_error>

namespace alces::offline {

const char* parse_any_number(const char* at, const char* end, double& value) {
  if (*at == '+' && *++at == '-') return nullptr;
  const auto [stop, error] = std::from_chars(at, end, value);
  if (error == std::errc::result_out_of_range) {
    // from_chars leaves the value alone; what it meant shows in the exponent's sign
    const char* exponent = at;
    while (exponent != stop && *exponent != 'e' && *exponent != 'E') ++exponent;
    const bool tiny = exponent == stop
                          ? *at == '0' || *at == '.' || (*at == '-' && (at[1] == '0' || at[1] == '.'))
                          : exponent[1] == '-';
    value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
    if (*at == '-') value = -value;
  } else if (error != std::errc{}) {
    return nullptr;
  }
  return ends_number(*stop) ? stop : nullptr;
}

}  // namespace alces::offline
