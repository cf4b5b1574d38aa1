#include "alces_platform/settings/byte_size.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <utility>

namespace alces::settings {
namespace {

constexpr std::array<std::pair<std::string_view, double>, 8> units = {{{"", 1},
                                                                       {"b", 1},
                                                                       {"kib", 1024.0},
                                                                       {"mib", 1024.0 * 1024},
                                                                       {"gib", 1024.0 * 1024 * 1024},
                                                                       {"kb", 1e3},
                                                                       {"mb", 1e6},
                                                                       {"gb", 1e9}}};

}  // namespace

std::optional<std::size_t> parse_byte_size(std::string_view text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || !std::isfinite(number) || number < 0) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  std::string unit(text);
  for (char& c : unit) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const auto& [name, bytes] : units) {
    if (unit != name) continue;
    const double size = std::floor(number * bytes);
    if (size >= 9.2e18) return std::nullopt;
    return static_cast<std::size_t>(size);
  }
  return std::nullopt;
}

std::string format_byte_size(std::size_t bytes) {
  const auto size = static_cast<double>(bytes);
  if (bytes < 1024) return fmt::format("{} B", bytes);
  if (size < 1024.0 * 1024) return fmt::format("{:.1f} KiB", size / 1024);
  if (size < 1024.0 * 1024 * 1024) return fmt::format("{:.1f} MiB", size / (1024.0 * 1024));
  return fmt::format("{:.2f} GiB", size / (1024.0 * 1024 * 1024));
}

std::string exact_byte_size(std::size_t bytes) {
  constexpr std::array<std::pair<std::size_t, const char*>, 3> powers{
      {{std::size_t{1} << 30, "GiB"}, {std::size_t{1} << 20, "MiB"}, {std::size_t{1} << 10, "KiB"}}};
  for (const auto& [size, name] : powers) {
    if (bytes != 0 && bytes % size == 0) return fmt::format("{}{}", bytes / size, name);
  }
  return fmt::format("{}", bytes);
}

}  // namespace alces::settings
