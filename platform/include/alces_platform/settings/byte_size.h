// Sizes as people write them: 64MiB, 16 MiB, 65536, 1.5GB.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace alces::settings {

/// A number and one of B, KiB, MiB, GiB (1024) or kB, MB, GB (1000), in any case; bytes without a unit. None
/// when it is something else, negative, or does not fit a size_t.
[[nodiscard]] std::optional<std::size_t> parse_byte_size(std::string_view text);

/// "16.0 MiB", "512 B": for people.
[[nodiscard]] std::string format_byte_size(std::size_t bytes);

/// "16MiB", "1536KiB", "1000": parse_byte_size() gives the same number.
[[nodiscard]] std::string exact_byte_size(std::size_t bytes);

}  // namespace alces::settings
