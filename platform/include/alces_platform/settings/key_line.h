// Where a key stands in a configuration's text, for complaints that only the program can make.
#pragma once

#include <cstddef>
#include <string_view>

namespace alces::settings {

/// The line of `key` in [table], from 1; 0: the text does not have it, or is no TOML.
[[nodiscard]] std::size_t key_line(std::string_view text, std::string_view table, std::string_view key);
/// Likewise of an entry, from 0, of the list `key`.
[[nodiscard]] std::size_t row_line(std::string_view text, std::string_view table, std::string_view key,
                                   std::size_t row);

}  // namespace alces::settings
