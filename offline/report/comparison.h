// A folder of results to show beside a map: tables as CSV, plots as pictures.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace alces::offline {

/// {"name", "tables": [{"name", "columns", "rows"}], "pictures": [{"name", "href"}]}, in natural order of the
/// files' names; other files are not looked at. Tables of more than 200 rows are data, not tables, and left
/// out. InputError, also when there is nothing to show.
[[nodiscard]] nlohmann::json read_comparison(const std::filesystem::path& folder);

}  // namespace alces::offline
