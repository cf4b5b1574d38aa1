#include "text_numbers.h"

#include <algorithm>

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

std::vector<std::string_view> split_words(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
    if (line.empty()) return words;
    words.push_back(line.substr(0, line.find_first_of(" \t\r")));
    line.remove_prefix(words.back().size());
  }
}

}  // namespace alces::offline
